# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sections of a diagnosis: named effects, errors, candidates, detectable sizes."""

from __future__ import annotations

from collections.abc import Sequence
import math

from armid_ros.diagnosis import Diagnosis, Finding
from armid_ros.diagnosis.next_run.isolability import DISTINCT, Isolability
from armid_ros.diagnosis.search.cause import bounds_of_change
from armid_ros.diagnosis.search.ranking import CauseResult
from armid_ros.diagnosis.verdict.document import Detectable
from armid_ros.diagnosis.verdict.finding import Gap
from armid_ros.diagnosis.verdict.words import by_cause, share_interval_in_words
from armid_ros.estimate import name_in_words
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import (
    Bar,
    BarChart,
    Cells,
    DataTable,
    Fold,
    Panels,
    Paragraph,
    TableCell,
)
from armid_ros.report.charts import Chart, Role, Series
from armid_ros.report.notation import (
    counted,
    digits,
    percent,
    pretty,
    probability,
    value_of,
    with_interval,
)
from armid_ros.report.page import Section, Templated
import numpy as np

_DETECTABLE = (
    'Effect',
    'Detectable from',
    'At the worst joint from',
    'Not detectable with this motion in',
)


def share_bars(diagnosis: Diagnosis) -> BarChart:
    """Return bars with the share of the squared torque error that each cause explains."""
    rows, taken = [], 0.0
    for group in by_cause(diagnosis.findings):
        one = group[0]
        where = ', '.join(one.place_of(joint) for joint in one.joints) or 'whole arm'
        if len(one.joints) > 3:
            where = f'{len(one.joints)} joints'
        names = ' and '.join(name_in_words(other.name) for other in group)
        share = max(one.share, 0.0)
        taken += share
        text = percent(one.share) + share_interval_in_words(one)
        rows.append((f'{names}, {where}', [Bar(share, 'after', text)]))
    rest = max(1.0 - taken, 0.0)
    rows.append(('unexplained (noise included)', [Bar(rest, 'floor', percent(rest))]))
    # the gap is the sum of squares, each joint in units of its floor; noise is part of it
    held_out = diagnosis.gap is not None and diagnosis.gap.predicted
    data = 'recordings not used for the fit' if held_out else 'cross-validation'
    legend = f'share of the difference explained ({data}; 95 % intervals)'
    return BarChart(rows, [('after', legend)], full=1.0)


def named_rows(
    findings: Sequence[Finding], certain: bool = False
) -> list[tuple[str, str, str, str]]:
    """
    Return table rows with the parameters of named effects and their 95 % intervals.

    Parameters
    ----------
    findings : sequence of Finding
        The effects.
    certain : bool
        Whether to leave out insignificant values if the effect has significant ones.

    """
    rows = []
    for finding in findings:
        values = finding.rows
        if certain:
            values = [row for row in values if excludes_zero(row[1], row[2])] or values
        rows += [
            (
                name_in_words(finding.name),
                name.words,
                finding.place_of(name.joint) or 'whole arm',
                value_of(finding, name, value, std, had),
            )
            for name, value, std, had in values
        ]
        masses = [row[1] for row in values if row[0].unit == 'kg' and excludes_zero(*row[1:3])]
        rows += [
            (
                name_in_words(finding.name),
                name.words.replace('first moment', 'centre of mass'),
                finding.place_of(name.joint) or 'whole arm',
                with_interval(value / masses[0], std / abs(masses[0]), 'm'),
            )
            for name, value, std, _ in values
            if finding.weighs and masses and name.unit == 'kg m' and not certain
        ]
    return rows


def named_section(findings: Sequence[Finding]) -> Section:
    """Return the section with the parameters of the named effects."""
    heads = ('Effect', 'Parameter', 'Joint', 'Value, 95 %')
    return Section('Parameters', [DataTable(heads, named_rows(findings), (0, 1, 2))])


def evidence_section(diagnosis: Diagnosis) -> Section:
    """Return the section with residuals of the worst joints over position and other variables."""
    folds = []
    total = 'the explained part' if diagnosis.findings else 'the difference'
    for number, place in enumerate(diagnosis.where[:3]):
        blocks: list[Templated] = []
        if place.axes and place.mean_share >= 0.005:
            blocks.append(
                Paragraph(
                    f'The mean residual, {digits(place.mean)} {place.unit}, is subtracted; it is '
                    f'{percent(place.mean_share)} of the mean square. Shares are of the rest.'
                )
            )
        varies = max(1.0 - place.mean_share, 1e-9)
        panels = []
        for axis in place.axes:
            share = percent(max(axis.share - place.mean_share, 0.0) / varies)
            chart = Chart(
                axis.centres,
                [Series('mean residual', axis.means - place.mean, 'before', 'trend')],
                f'{axis.name} [{pretty(axis.unit)}]',
                f'residual [{place.unit}]',
                height=170,
                symmetric=True,
                legend=False,
            )
            panels.append((f'{axis.name}: {share} of the mean square', '', [chart]))
        named = [
            name_in_words(one.name) for one in diagnosis.findings if place.joint in one.joints
        ]
        line = f'{place.joint}: {100 * place.share_of_gap:.0f} % of {total}, '
        line += ' and '.join(named) or place.signature
        folds.append(Fold(line, [*blocks, Panels(panels)], opened=number == 0))
    return Section('Residual by variable', folds)


def minor_section(diagnosis: Diagnosis, patched: bool) -> Section:
    """Return the section on significant effects that are negligible or fail on held-out data."""
    rows = [
        (
            name_in_words(one.name),
            ', '.join(one.joints) or 'whole arm',
            value_of(one, one.parameters[0], one.values[0], one.std[0]) if one.values else '',
            percent(one.share),
            probability(one.p),
        )
        for one in diagnosis.minor
    ]
    share = 'Share of the difference' if diagnosis.findings else 'Share of the remaining error'
    not_in_model = '' if patched else ' None of them is in model.yaml.'
    return Section(
        'Minor effects',
        [
            Paragraph(
                'Statistically significant but negligible, or not confirmed by held-out data.'
                f'{not_in_model} A value may stand for another effect with a similar torque.'
            ),
            DataTable(('Effect', 'Joints', 'Value, 95 %', share, 'p value'), rows, (0, 1, 2, 3)),
        ],
    )


def detectable_section(sizes: Sequence[Detectable]) -> Section:
    """Return the section with the detectable size of each effect, at the best and worst joint."""
    rows = [_detectable_row(name, sizes) for name in dict.fromkeys(one.name for one in sizes)]
    return Section(
        'Smallest detectable effects',
        [
            Paragraph(
                'Smaller effects may exist without being named. The limit is five standard '
                'deviations of the value, at a torque above the misfit of the model.'
            ),
            Fold(
                f'Sizes of {len(rows)} effects',
                [DataTable(_DETECTABLE, rows, tuple(range(len(_DETECTABLE))))],
            ),
        ],
    )


def isolability_section(isolability: Isolability) -> Section:
    """Return the section on the effects that a planned motion can detect and distinguish."""
    kinds, apart = isolability.of_kinds()
    near = (apart < DISTINCT) & ~np.eye(len(kinds), dtype=bool)
    names = [name_in_words(kind) for kind in kinds]
    rows: list[Cells] = []
    for name in dict.fromkeys(one.name for one in isolability.effects):
        others = np.flatnonzero(near[kinds.index(name)]) if name in kinds else ()
        alike = ', '.join(names[k] for k in others)
        rows.append((*_detectable_row(name, isolability.effects), alike))
    similar: list[Cells] = [
        (
            f'{k + 1} {name}',
            *(
                TableCell('=' if near[k, j] else '', shade=round(55.0 * (1.0 - apart[k, j])))
                for j in range(len(kinds))
            ),
        )
        for k, name in enumerate(names)
    ]
    heads = (*_DETECTABLE, 'Not distinguishable from')
    return Section(
        'Isolability',
        [
            Paragraph(
                'Smallest sizes of effects that this run makes detectable: five standard '
                'deviations of the value, for a known arm and the assumed torque noise. Two '
                'effects are not distinguishable if one reproduces the torque of the other to '
                '10 % (rms).'
            ),
            DataTable(heads, rows, tuple(range(len(heads)))),
            Paragraph(
                'Similarity of two effects, by number: the darker, the more similar. "=": the '
                'effect of the column can reproduce that of the row.'
            ),
            DataTable(
                ('Effect', *(str(k + 1) for k in range(len(kinds)))), similar, kind='matrix'
            ),
        ],
    )


def _detectable_row(name: str, sizes: Sequence[Detectable]) -> tuple[str, str, str, str]:
    """Return the table cells of one effect, with the columns `_DETECTABLE`."""
    own = [one for one in sizes if one.name == name]
    finite = sorted((s for s in own if math.isfinite(s.size)), key=lambda s: s.size)
    ends = []  # the smallest and the largest detectable size, each with its joints
    for one in (*finite[:1], *finite[-1:]):
        unit = '' if one.parameter is None else f' {pretty(one.parameter.unit)}'
        where = f' in {", ".join(one.joints)}' if one.joints else ''
        ends.append(f'{digits(one.size)}{unit.rstrip()}{where}')
    best, worst = ends or ('', '')
    never = '; '.join(', '.join(s.joints) or 'the arm' for s in own if not math.isfinite(s.size))
    return name_in_words(name), best, worst if worst != best else '', never


def candidates_section(diagnosis: Diagnosis) -> Section:
    """Return the section with the share of the residual that each effect alone explains."""
    explanation = diagnosis.explanation
    names = {finding.name for finding in diagnosis.findings}
    rows = [
        (
            TableCell(
                name_in_words(trial.effect.name),
                'changed' if trial.effect.name in names else '',
            ),
            ', '.join(trial.effect.joints) or 'whole arm',
            percent(trial.share),
            f'{trial.gain / 2.0:.1f}',
            _candidate_value(diagnosis, trial),
            percent(trial.visible),
        )
        for trial in (() if explanation is None else explanation.candidates[:15])
    ]
    if not rows:
        nothing = Paragraph('No effect explains any of the residual.')
        return Section('Candidates', [nothing])
    heads = ('Effect', 'Joints', 'Share', 'Evidence', 'Value, 95 %', 'Visible')
    verb = 'was' if len(rows) == 1 else 'were'
    return Section(
        'Candidates',
        [
            Fold(
                f'{counted(len(rows), "cause")} that {verb} compared, the likeliest first',
                [
                    Paragraph(
                        'Each cause alone, with its best-fitting shape. Share: part of the '
                        'squared residual that the cause explains; similar causes explain the '
                        'same part. Evidence: logarithm of the Bayes factor. Visible: part of the '
                        'torque of the cause that other parameters cannot reproduce.'
                    ),
                    DataTable(heads, rows, (0, 1)),
                ],
            )
        ],
    )


def _candidate_value(diagnosis: Diagnosis, trial: CauseResult) -> str:
    """Format the first value of a candidate, or 'includes 0' or 'not possible'."""
    arm, effect, kept = diagnosis.arm, trial.effect, list(trial.kept)
    if diagnosis.explanation is not None:
        arm = diagnosis.explanation.given
    lower, upper = (bound[kept] for bound in bounds_of_change(effect, arm))
    slack = HALF_WIDTH * trial.std
    if not np.all((trial.values > lower - slack) & (trial.values < upper + slack)):
        return 'not possible'
    if not excludes_zero(trial.values, trial.std).any():
        return 'includes 0'
    name = effect.parameters(arm.robot)[kept[0]]
    return with_interval(float(trial.values[0]), float(trial.std[0]), name.unit)


def gap_section(diagnosis: Diagnosis, gap: Gap) -> Section:
    """Return the section with each joint's torque error, without and with named effects."""
    usual_error, harmful = diagnosis.baseline, bool(diagnosis.harmful)
    recordings = 'recordings not used for the fit' if gap.predicted else 'the diagnosed recordings'
    unpatched = ' The model in model.yaml does not have the named cause.' * harmful
    return Section(
        'Error of each joint',
        [
            Paragraph(
                f'Root mean square error of each joint on {recordings}, the worst joint first. '
                'Bars are in units of the usual error of the joint, which is '
                f'{usual_error}.{unpatched}'
            ),
            gap_bars(diagnosis, gap),
        ],
    )


def gap_bars(diagnosis: Diagnosis, gap: Gap) -> BarChart:
    """Return bars of each joint's torque error over its usual error, the worst joint first."""
    robot = diagnosis.arm.robot
    roles: list[tuple[Role, str, FloatArray]] = [
        ('before', 'given model', gap.before),
        ('after', 'with the named cause' if diagnosis.findings else 'error', gap.after),
    ]
    roles = roles if diagnosis.findings else roles[1:]
    rows, first = [], roles[0][2]
    for joint in np.argsort(-first / np.maximum(gap.floor, 1e-12)):
        name = robot.joints[joint]
        if not any(errors[joint] for _, _, errors in roles):  # at rest: no row counts
            rows.append((name, [Bar(0.0, 'floor', 'at rest, not compared')]))
            continue
        unit, least = robot.torque_units[joint], max(float(gap.floor[joint]), 1e-12)
        bars = []
        for role, _, errors in roles:
            error, ratio = float(errors[joint]), float(errors[joint]) / least
            bars.append(Bar(ratio, role, f'{digits(ratio)} times usual ({digits(error)} {unit})'))
        rows.append((name, [*bars, Bar(1.0, 'floor', '')]))
    legend = [(role, label) for role, label, _ in roles]
    return BarChart(rows, [*legend, ('floor', 'usual error of the joint')])
