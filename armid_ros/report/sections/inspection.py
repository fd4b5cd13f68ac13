# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a recording holds: topics, time, joints, curves."""

from __future__ import annotations

from armid_ros.inspection import Inspection
from armid_ros.report.blocks import (
    ContentSection,
    DataTable,
    FactList,
    PageBlock,
    Panels,
    Paragraph,
)
from armid_ros.report.charts import Chart, Level, Series, thinned
from armid_ros.report.notation import digits, plain
import numpy as np

#: Samples of one curve on the page.
_MOST = 2000
#: No encoder of an arm resolves less [rad or m].
_FINEST = 1e-7


def recording_facts(found: Inspection) -> list[tuple[str, str]]:
    """Return how a recording is sampled, whether it repeats, and what reading it met."""
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


def contents_section(found: Inspection) -> ContentSection:
    """Return the topics of a bag, and how it is sampled."""
    blocks: list[PageBlock] = [FactList(recording_facts(found))]
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
    return ContentSection('What is in it', blocks)


def joints_section(found: Inspection) -> ContentSection:
    """Return ranges, speeds and efforts; no head is broken within its unit."""
    heads = list(joint_heads(found))
    if len(set(found.units)) == 1:
        for column, like in ((2, 1), (5, 1), (8, 7)):
            heads[column] += heads[like][heads[like].index(' [') :]
    heads = [head.replace('N m', 'N\N{NO-BREAK SPACE}m') for head in heads]
    said = (
        'Speed: 99th percentile, from the positions. Step: smallest change of position between '
        'samples. Dq ratio: recorded velocity over the derivative of the positions; 1 if units '
        'and signs agree. Effort: rms and maximum.'
    )
    table = DataTable(heads, joint_rows(found), kind='tight')
    return ContentSection('Joints', [table, Paragraph(said, 'hint')])


def curves_section(found: Inspection) -> ContentSection:
    """Return all that was recorded, over time."""
    recording, robot = found.recording, found.robot
    blocks: list[PageBlock] = [
        Paragraph(
            'Unfiltered signals. Long recordings are drawn by the extremes of short intervals. '
            'Drag to zoom all curves.',
            'hint',
        )
    ]
    for k, (name, unit) in enumerate(zip(recording.joints, found.units, strict=True)):
        levels: list[Level] = []
        if robot is not None:
            low, high = recording.q[:, k].min(), recording.q[:, k].max()
            reach = max(high - low, 1e-6)
            levels = [
                Level(float(limit), 'limit')
                for limit in (robot.lower[k], robot.upper[k])
                if np.isfinite(limit) and low - reach < limit < high + reach
            ]
        quantities = (
            ('position', unit, recording.q, levels),
            ('velocity', f'{unit}/s', recording.dq, levels[:0]),
            ('effort', 'N' if unit == 'm' else 'N m', recording.tau, levels[:0]),
        )
        panels: list[tuple[str, str, list[PageBlock]]] = []
        for quantity, own, values, lines in quantities:
            if values is not None:
                chosen = thinned(values[:, k], most=_MOST)
                chart = Chart(
                    recording.t[chosen],
                    [Series(quantity, values[chosen, k], 'after')],
                    'time [s]',
                    f'{quantity} [{own}]',
                    height=160,
                    link='time',
                    levels=lines,
                    legend=False,
                )
                panels.append((name if not panels else '\N{NO-BREAK SPACE}', '', [chart]))
        blocks.append(Panels(panels, three=True))
    steps = 1e3 * np.diff(recording.t)
    chosen = thinned(steps, most=_MOST)
    chart = Chart(
        recording.t[1:][chosen],
        [Series('step', steps[chosen], 'residual')],
        'time [s]',
        'step [ms]',
        height=150,
        legend=False,
    )
    return ContentSection('Curves', [*blocks, Panels([('Time between samples', '', [chart])])])


def joint_heads(found: Inspection) -> tuple[str, ...]:
    """Return the heads of the table of joints; with units, where all joints have the same."""
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
        'dq ratio',
        f'effort{torque}',
        'largest',
    )


def joint_rows(found: Inspection) -> list[tuple[str, ...]]:
    """Return a row for each joint: name, range, speed, moving, step, velocity ratio, efforts."""
    alike = len(set(found.units)) == 1
    rows = []
    for joint, unit in zip(found.joints, found.units, strict=True):
        step = f'{joint.step:.2g}' if joint.step else '-'
        if 0.0 < joint.step < _FINEST:
            step = f'< {_FINEST:.0e}'.replace('e-0', 'e-')
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
