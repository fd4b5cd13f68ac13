# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Page of a comparison of two identifications, and its sentences."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from armid_ros.estimate import measured
from armid_ros.identification.assess.comparison import Comparison, LoadChange
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH
from armid_ros.report.blocks import (
    Cells,
    DataTable,
    FactList,
    IntervalTrack,
    Legend,
    Paragraph,
    TableCell,
    VerdictSection,
)
from armid_ros.report.notation import counted, digits, robot_label, sentence, with_interval
from armid_ros.report.page import Page, Section
from armid_ros.report.parameter_tables import estimate_text, full_label, parameter_folds
from armid_ros.report.provenance import ResultOrigin

#: Columns of the table of changes.
HEADS = ('parameter', 'before', 'after', 'difference, 95 %')
_WHY = {
    'motion': 'not identified by the motion of the {other}',
    'effect': 'not in the model of the {other}',
    'grouping': 'summed with other parameters by the data of the {other}',
}


def compare_report(comparison: Comparison, origin: ResultOrigin) -> str:
    """
    Return the HTML page of a comparison of two identifications.

    Parameters
    ----------
    comparison : Comparison
        Two identifications.
    origin : ResultOrigin
        Files, versions, and the next step.

    """
    facts = []
    for heading, side in (('First', comparison.before), ('Second', comparison.after)):
        text = f'{side.source}: {robot_label(side.robot)}'
        if side.error_percent is not None:
            text += f'; torque error over all joints {side.error_percent:.2f} %'
        facts.append((heading, text))
    rows = change_rows(comparison)
    box = VerdictSection(
        *verdict(comparison),
        change_sentences(comparison),
        _beware(comparison),
        step=next_step(comparison),
        command=origin.step,
    )
    sections = [
        *([Section('What changed', [DataTable(HEADS, rows, (0, 3))])] if rows else []),
        changes_section(comparison),
        Section('Input', [FactList(facts)]),
    ]
    title = f'Comparison of two identifications of {robot_label(comparison.after.robot)}'
    subtitle = f'{comparison.before.source} · {comparison.after.source}'
    joints = dict.fromkeys(one.parameter.joint for one in comparison.changes)
    names = [*filter(None, joints)]
    return Page(title, subtitle, box, sections, origin.provenance, names).html()


def verdict(comparison: Comparison) -> tuple[str, str]:
    """Return the verdict on two identifications: text and colour of the badge."""
    if comparison.unusable:
        return 'unusable', 'bad'
    if comparison.anything:
        return 'changed', 'fair'
    if comparison.not_compared:
        return 'unchanged in part', 'fair'
    return 'unchanged', 'good'


def next_step(comparison: Comparison) -> str:
    """Return the advice to the user after a comparison of two identifications."""
    if comparison.anything or comparison.unusable:
        return 'If you expected this, use the later model. If not, diagnose the later recordings.'
    return 'Identify from all recordings together, for smaller intervals.'


def change_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """Return a table row for each changed parameter, with the columns of `HEADS`."""
    rows: list[tuple[str, ...]] = []
    for change in comparison.changed:
        before, _ = estimate_text(change.before, change.before_std)
        after, _ = estimate_text(change.after, change.after_std)
        by = '+' * (change.difference > 0.0)
        by += with_interval(change.difference, change.std, change.parameter.unit)
        if before != 'includes 0':
            by += f' ({100.0 * change.difference / abs(change.before):+.0f} %)'
        rows.append((full_label(change.parameter), before, after, by))
    return rows


def change_sentences(comparison: Comparison) -> tuple[str, ...]:
    """Return sentences on the changes between two identifications, most important first."""
    lines = []
    for side in comparison.unusable:
        assert side.fit is not None
        reason = side.fit.reason[:1].lower() + side.fit.reason[1:].rstrip('.')
        lines.append(
            f'{side.source} is unusable: {reason}. Find the missing effect with armid diagnose.'
        )
    if comparison.factors:
        named = ', '.join(f'{joint} {factor:.3g}' for joint, factor in comparison.factors.items())
        lines.append(
            f'Inertia and friction of {comparison.after.source} are those of '
            f'{comparison.before.source} times one factor per joint ({named}): one of the two has '
            'efforts in another unit, such as currents. Convert them with --current-gain, and '
            'identify again.'
        )
        return tuple(lines)
    if comparison.load is not None:
        lines += _load(comparison, comparison.load)
    else:
        for one in comparison.changed[:1]:
            verb = 'rose' if one.difference > 0.0 else 'fell'
            start, _ = measured(one.before, HALF_WIDTH * one.std)
            end = with_interval(one.after, one.std, one.parameter.unit)
            lines.append(sentence(f'{full_label(one.parameter)} {verb} from {start} to {end}'))
    lines += [_count_sentence(comparison), *_residuals(comparison), *_not_compared(comparison)]
    for group in comparison.changed_together:
        parameters = f'The effects at {group.joint}' if group.joint else 'The inertial parameters'
        lines.append(
            f'{parameters} changed as a group (p = {group.p_value:.1g}), though none of the '
            f'{len(group.parameters)} parameters changed significantly alone.'
        )
    rigid = [c for c in comparison.changed if c.parameter.rigid]
    if comparison.load is None and len(rigid) > max(2, len(comparison.changed) / 2):
        lines.append(
            f'Mainly inertial parameters changed, most clearly at {rigid[0].parameter.joint}: a '
            'tool or load was added or removed, or gravity or mounting differ.'
        )
    if not comparison.anything:
        worn = [c for c in comparison.changes if not c.parameter.rigid] or comparison.changes
        known = [c for c in worn if excludes_zero(c.before, c.before_std)]
        # 3.5 standard deviations of the parameters that wear
        sizes = sorted(350.0 * c.std / abs(c.before) for c in known)
        if sizes:
            lines.append(
                f'Smallest detectable change: {sizes[0]:.2g} % for the best-determined '
                f'parameter, {sizes[len(sizes) // 2]:.2g} % for the median one.'
            )
    return tuple(lines)


def _count_sentence(comparison: Comparison) -> str:
    """Return a sentence on how many of the compared parameters changed."""
    changed, others = comparison.changed, len(comparison.not_compared)
    count = counted(len(comparison.changes), 'parameter') + ' that both have' * bool(others)
    not_compared = (
        f'; {others} more {"was" if others == 1 else "were"} not compared' if others else ''
    )
    joints = ', '.join(dict.fromkeys(c.parameter.joint for c in changed if c.parameter.joint))
    places = f', at {joints}' if joints else ''
    if comparison.load is not None and all(c.parameter.rigid for c in changed):
        return f'The load explains the {len(changed)} changed of {count}{places}{not_compared}.'
    if changed or comparison.changed_together:
        return f'{len(changed)} of {count} changed significantly{places}{not_compared}.'
    exception = ', but the residuals did' if comparison.changed_residuals else ''
    if comparison.unusable:
        exception = ', but one model is unusable'
    return f'None of {count} changed significantly{exception}{not_compared}.'


def _residuals(comparison: Comparison) -> Iterator[str]:
    """Yield a sentence on each joint whose residual changed, and a sentence on the reason."""
    for change in comparison.changed_residuals:
        errors = change.before_error, change.after_error
        ranks = ('second', 'first') if change.ratio > 1.0 else ('first', 'second')
        times = change.ratio if change.ratio > 1.0 else 1.0 / change.ratio if change.ratio else inf
        shares = ''
        if errors[0] is not None and errors[1] is not None:
            shares = f' ({digits(errors[0])} and {digits(errors[1])} % of the torque)'
        yield (
            f'{change.joint}: the residual of the {ranks[0]} model is {digits(times)} times that '
            f'of the {ranks[1]}{shares}.'
        )
    if comparison.changed_residuals:
        if any(one.why == 'effect' for one in comparison.not_compared):
            yield 'The models have different effects, which may be the reason.'
        else:
            yield 'No parameter of the two models explains this difference.'


def _load(comparison: Comparison, load: LoadChange) -> tuple[str, str]:
    """Return sentences on a load that explains all changes of inertial parameters."""
    joints = {
        (
            int(c.parameter.name.split(' ')[0].lstrip('Imxyz')) if c.parameter.rigid else 0
        ): c.parameter.joint
        for c in comparison.changes
    }
    named = [
        f'the link of {joints[number]}' if number in joints else f'link {number}'
        for number in (load.link, *load.rivals)
    ]
    verb = 'was added to' if load.mass > 0.0 else 'was removed from'
    where = ''
    if load.center is not None:
        centre = ', '.join(f'{x:z.3f}' for x in load.center)
        where = f'Its centre is at ({centre}) m in the frame of its joint. '
    rivals = ''
    if load.rivals:
        rivals = f', or equally well {" or ".join(named[1:])}'
    mass = with_interval(abs(load.mass), load.mass_std, 'kg')
    return (
        f'A load of {mass} {verb} {named[0]}{rivals}.',
        f'{where}The load explains all changes of the inertial parameters.',
    )


def _not_compared(comparison: Comparison) -> tuple[str, ...]:
    """Return sentences on the parameters that only one of the two models has."""
    lines = []
    sides = ('first', 'second', comparison.only_before), ('second', 'first', comparison.only_after)
    for side, other, found in sides:
        for why, template in _WHY.items():
            some = [one for one in found if one.why == why]
            if some:
                reason = template.format(other=other)
                # a line names six parameters
                shown = ', '.join(full_label(one.parameter) for one in some[:6])
                more = f' and {len(some) - 6} more' * (len(some) > 6)
                count = counted(len(some), 'parameter')
                lines.append(f'{count} of the {side} only: {reason} ({shown}{more}).')
    return tuple(lines)


def _beware(comparison: Comparison) -> tuple[str, ...]:
    """Return sentences on the limitations of a comparison of two identifications."""
    lines = []
    for given in (comparison.before, comparison.after):
        if given.fit is None:
            lines.append(f'{given.source} does not contain the torque error of the fit.')
    fits = comparison.before.fit, comparison.after.fit
    if all(fits) and not comparison.residuals:
        lines.append('Residuals are not compared: the files do not contain them joint by joint.')
    known = comparison.before.kinematics and comparison.after.kinematics  # one robot, then
    if not known and comparison.before.robot != comparison.after.robot:
        lines.append(
            f'The robots have different names, {comparison.before.robot} and '
            f'{comparison.after.robot}; they may not be the same.'
        )
    return tuple(lines)


def changes_section(comparison: Comparison) -> Section:
    """Return the section with all parameters of both identifications side by side."""
    changes = comparison.changes

    def cells(k: int) -> Cells:
        one = changes[k]
        before, after = (
            ' ±\N{NO-BREAK SPACE}'.join(estimate_text(value, std)).replace(
                'includes 0 ', 'includes 0, '
            )
            for value, std in ((one.before, one.before_std), (one.after, one.after_std))
        )
        unknown = 'includes' in before and 'includes' in after
        return (
            before,
            TableCell(after, 'changed' if one.changed else 'unknown' * unknown),
            f'{one.deviations:+.1f}',
            IntervalTrack(one.after, HALF_WIDTH * one.after_std, one.before),
        )

    return Section(
        'Side by side',
        [
            Paragraph(
                'Significant changes are in bold (5 % family-wise false-alarm rate). Each row has '
                'its own scale, with zero in the middle.'
            ),
            Legend([('after', 'second, with its 95 % interval'), ('tick', 'first')]),
            *parameter_folds(
                tuple(one.parameter for one in changes),
                ('First', 'Second', 'Difference / std', ''),
                cells,
                changed=[one.changed for one in changes],
            ),
        ],
    )
