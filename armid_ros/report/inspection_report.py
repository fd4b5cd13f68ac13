# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pages of `armid inspect` (a recording) and `armid check` (a description)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_ros.estimate import measured
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.inspection import Inspection, LinkCheck, Remark
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import (
    Bar,
    BarChart,
    DataTable,
    FactList,
    Panels,
    Paragraph,
    VerdictSection,
)
from armid_ros.report.charts import Chart, Series
from armid_ros.report.notation import (
    counted,
    digits,
    plain,
    pretty,
    robot_label,
    sentence,
    with_interval,
)
from armid_ros.report.page import Page, Section, Templated
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
import numpy as np

HEADS = (
    'link',
    'mass, URDF [kg]',
    'measured [kg]',
    'centre, URDF [m]',
    'measured [m]',
    'explains',
)
#: Colour of each verdict.
_TONES = {
    **{'unfit': 'bad', 'doubtful': 'fair', 'ready': 'good'},
    **{'wrong': 'bad', 'look': 'fair', 'clean': 'good'},
}


def inspection_report(found: Inspection, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
    """
    Return the HTML page of an inspected recording, with all curves.

    Parameters
    ----------
    found : Inspection
        Result of the inspection.
    origin : ResultOrigin
        Name or path of the description, files, versions, and the next step.

    """
    recording = found.recording
    grade = inspection_word(found)
    first = 1 if grade == 'ready' else 2
    texts = [remark.text for remark in found.remarks]
    texts.insert(first - 1, found.verdict)  # not worse than the worst remark
    sentences = [sentence(text.replace('`', '')) for text in texts]
    verdict = VerdictSection(
        grade, _TONES[grade], sentences[:first], sentences[first:], step=origin.step
    )
    sections = [
        _contents_section(found),
        Section(
            'Joints',
            [
                DataTable(joint_heads(found), joint_rows(found)),
                Paragraph(
                    'Speed: 99th percentile, from the positions. Step: smallest change of a '
                    'position between samples. Velocity ratio: recorded velocity over the '
                    'derivative of the positions; 1 if units and signs agree.',
                    'hint',
                ),
            ],
        ),
        _curves_section(found),
    ]
    name = Path(recording.source).name or 'recording'
    subtitle = ' · '.join(
        filter(
            None,
            (robot_label(origin.robot), recording.topic, counted(recording.n_joints, 'joint')),
        )
    )
    title = f'Inspection of {name}'
    return Page(title, subtitle, verdict, sections, origin.provenance, recording.joints).html()


def inspection_word(found: Inspection) -> str:
    """Return the verdict on a recording as a word: 'ready', 'doubtful' or 'unfit'."""
    weights = {remark.weight for remark in found.remarks}
    return 'unfit' if 'bad' in weights else 'doubtful' if 'doubt' in weights else 'ready'


def check_word(remarks: Sequence[Remark], found: LinkCheck | None) -> str:
    """Return the verdict on a URDF as a word: 'clean', 'look' (suspicious) or 'wrong'."""
    weights = {remark.weight for remark in remarks}
    # with a smaller share explained, an effect may be missing instead
    if 'bad' in weights or (found is not None and found.wrong and found.explained >= 0.9):
        return 'wrong'
    return 'look' if 'doubt' in weights or (found is not None and found.wrong) else 'clean'


def headline(remarks: Sequence[Remark], found: LinkCheck | None) -> tuple[str, ...]:
    """Return sentences on a checked URDF: finding, torque error and suspicious values."""
    suspicious = [pretty(sentence(one.text)) for one in remarks if one.weight != 'note']
    impossible = [one for one in remarks if one.weight == 'bad']
    values = suspicious or ['No impossible or suspicious value in the description.']
    if found is None:
        return (*values, *([] if impossible else ['Add a recording to check the masses.']))
    errors = (
        f'Torque error: {digits(found.error_percent)} % with the links of the URDF, '
        f'{digits(found.fitted_error_percent)} % with fitted links.'
    )
    if found.fault:
        first = sentence(f'the recording cannot check the links: {found.fault}')
    elif found.agrees:
        first = 'The links of the URDF agree with the recording.'
    elif found.explained < 0.9:  # with a smaller share, links are not the cause
        first = 'More than three links of the URDF are wrong, or --effects lacks an effect.'
    else:
        known = [text for k in found.wrong if (text := _wrong_mass(found, k))]
        others = [found.joints[k] for k in found.wrong if not _wrong_mass(found, k)]
        if others:
            known.append(f'has a wrong mass distribution at {" and ".join(others)}')
        rivals = ''.join(f' or {found.joints[k]}' for k in found.rivals)
        first = f'The URDF {" and ".join(known)}{rivals}, if the other links are right.'
    if found.wrong and not suspicious:
        return first, errors
    return (*values, first, errors) if impossible else (first, errors, *values)


def _wrong_mass(found: LinkCheck, k: int) -> str:
    """Return a text such as 'is 0.8 kg too light at elbow'; '' for an insignificant error."""
    change, reach = found.measured_mass[k] - found.mass[k], HALF_WIDTH * found.mass_std[k]
    if not abs(change) > reach:
        return ''
    size = with_interval(abs(float(change)), float(found.mass_std[k]), 'kg')
    word = 'light' if change > 0.0 else 'heavy'
    return f'is {size} too {word} at {found.joints[k]}'


def link_rows(found: LinkCheck) -> list[tuple[str, ...]]:
    """Return a table row for each link, with the columns of `HEADS`."""
    return [
        (
            f'{link} ({found.joints[k]})',
            f'{found.mass[k]:.4g}',
            _interval(found.measured_mass[k : k + 1], found.mass_std[k : k + 1]),
            '-'
            if np.isnan(found.centre[k, 0])
            else ', '.join(f'{x:.3f}' for x in found.centre[k]),
            _interval(found.measured_centre[k], found.centre_std[k]),
            '-' if found.agrees else f'{100.0 * max(0.0, found.explains[k]):.0f} %',
        )
        for k, link in enumerate(found.links)
    ]


def _interval(values: FloatArray, std: FloatArray) -> str:
    """Format values with the largest of their 95 % half-widths; NaN becomes '-'."""
    if np.isnan(values).any():
        return '-'
    reach = float(HALF_WIDTH * std.max())
    return f'{", ".join(measured(float(v), reach)[0] for v in values)} ± {measured(0.0, reach)[1]}'


def description_check_report(
    remarks: Sequence[Remark], links: LinkCheck | None, origin: ResultOrigin
) -> str:
    """Return the HTML page of a checked robot description (URDF)."""
    first, *others = headline(remarks, links)
    grade, bars = check_word(remarks, links), None
    notes = [sentence(one.text) for one in remarks if one.weight == 'note']
    if links is not None and not links.fault:
        others = [text for text in others if not text.startswith('Torque error')]  # bars
        errors = links.error_percent, links.fitted_error_percent
        before, after = (Bar(error, 'after', f'{digits(error)} %') for error in errors)
        rows = [('with the links of the URDF', [before]), ('with fitted links', [after])]
        bars = BarChart(rows, [('after', 'torque error, rms')])
    verdict = VerdictSection(grade, _TONES[grade], [first, *others], notes, bars, origin.step)
    sections = []
    if links is not None:
        hint = (
            'Centres of mass are in the frame of the joint that moves the link. Intervals: 95 %. '
            'A dash: as described, or not identifiable from this motion. Explains: share of the '
            'torque error that this link explains if all other links are right.'
        )
        table = DataTable(HEADS, link_rows(links), (0, 3, 4))
        sections.append(Section('Links', [table, Paragraph(hint, 'hint')]))
    title = f'Check of {robot_label(origin.robot)}'
    names = () if links is None else (*links.joints, *links.links)
    return Page(title, '', verdict, sections, origin.provenance, names).html()


def recording_facts(found: Inspection) -> list[tuple[str, str]]:
    """Return names and values of facts on a recording: sampling, gaps, period, repairs."""
    sampling, recording, trial = found.sampling, found.recording, found.trial
    motion = 'does not repeat'
    if sampling.period is not None:
        motion = f'repeats after {sampling.period:.2f} s, {sampling.periods:.1f} times'
    facts = [
        ('Duration', f'{sampling.duration:.2f} s, {len(recording)} samples'),
        (
            'Rate',
            f'{plain(sampling.rate_hz, 4)} Hz, steps vary by {100 * sampling.jitter:.1f} %',
        ),
        ('Longest step', f'{plain(1000 * sampling.longest_step)} ms'),
        ('Gaps', str(sampling.gaps) if sampling.gaps else 'none'),
        ('Motion', motion),
        ('Clock', recording.clock),
        ('Reading', recording.report.describe()),
    ]
    if trial is not None and trial.cutoff_hz is not None:
        facts.append(('Cut-off', f'{trial.cutoff_hz:.3g} Hz would be chosen by identify'))
    return facts


def _contents_section(found: Inspection) -> Section:
    """Return the section with the topics and the sampling of a recording."""
    blocks: list[Templated] = [FactList(recording_facts(found))]
    if found.topics:
        rows = [
            (
                topic.name + ' (read)' * (topic.name == found.recording.topic),
                str(topic.count),
                topic.type_name,
                ', '.join(topic.joints),
            )
            for topic in found.topics
        ]
        heads = ('Topic', 'Messages', 'Type', 'Joints')
        blocks.insert(0, DataTable(heads, rows, (0, 2, 3)))
    return Section('Contents', blocks)


def _curves_section(found: Inspection) -> Section:
    recording, robot = found.recording, found.robot
    blocks: list[Templated] = [
        Paragraph(
            'Unfiltered signals. Of long recordings, the extremes of short intervals are drawn. '
            'Drag across a plot to zoom all plots.',
            'hint',
        )
    ]
    for k, (name, unit) in enumerate(zip(recording.joints, found.units, strict=True)):
        levels: list[tuple[float, str]] = []
        if robot is not None:
            low, high = recording.q[:, k].min(), recording.q[:, k].max()
            reach = max(high - low, 1e-6)
            levels = [
                (float(limit), 'limit')
                for limit in (robot.lower[k], robot.upper[k])
                if np.isfinite(limit) and low - reach < limit < high + reach
            ]
        quantities = (
            ('position', unit, recording.q, levels),
            ('velocity', f'{unit}/s', recording.dq, levels[:0]),
            ('effort', 'N' if unit == 'm' else 'N m', recording.tau, levels[:0]),
        )
        panels: list[tuple[str, str, list[Templated]]] = []
        for quantity, own, values, lines in quantities:
            if values is not None:
                chart = Chart.over_time(
                    recording.t,
                    [Series(quantity, values[:, k], 'after')],
                    f'{quantity} [{own}]',
                    height=160,
                    link='time',
                    levels=lines,
                    legend=False,
                )
                panels.append((name if not panels else '\N{NO-BREAK SPACE}', '', [chart]))
        blocks.append(Panels(panels, three=True))
    chart = Chart.over_time(
        recording.t[1:],
        [Series('step', 1e3 * np.diff(recording.t), 'residual')],
        'step [ms]',
        height=150,
        legend=False,
    )
    return Section('Curves', [*blocks, Panels([('Time between samples', '', [chart])])])


def joint_heads(found: Inspection) -> tuple[str, ...]:
    """Return the column heads of the joint table, with units if all joints have equal units."""
    alike, unit = len(set(found.units)) == 1, found.units[0]
    length, speed, torque = (
        f' [{one}]' if alike else '' for one in (unit, f'{unit}/s', 'N' if unit == 'm' else 'N m')
    )
    return (
        'joint',
        f'from{length}',
        'to',
        f'speed{speed}',
        'moving',
        'step',
        'velocity ratio',
        f'effort, rms{torque}',
        'largest',
    )


def joint_rows(found: Inspection) -> list[tuple[str, ...]]:
    """Return a table row for each joint, with the columns of `joint_heads`."""
    alike = len(set(found.units)) == 1
    rows = []
    for joint, unit in zip(found.joints, found.units, strict=True):
        step = f'{joint.step:.2g}' if joint.step else '-'
        if 0.0 < joint.step < 1e-7:  # [rad or m]; smaller than the step of any encoder of an arm
            step = '< 1e-7'
        efforts = (joint.effort_rms, joint.effort_largest)
        rows.append(
            (
                joint.name,
                f'{joint.lower:.3g}',
                f'{joint.upper:.3g}' + ('' if alike else f' {unit}'),
                digits(joint.speed),
                f'{100 * joint.moving:.0f} %',
                step,
                '-' if joint.velocity_ratio is None else f'{joint.velocity_ratio:.3g}',
                *('-' if effort is None else digits(effort) for effort in efforts),
            )
        )
    return rows
