# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a recording holds: topics, time, joints, curves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.inspection import Inspection, JointFacts
from armid_ros.motion import FloatArray
from armid_ros.report.charts import Chart, Level, Series, thinned
from armid_ros.report.notation import digits, plain
from armid_ros.report.page import Section
import numpy as np

#: Samples of one curve on the page.
_MOST = 2000
_LINK = 'time'
#: No encoder of an arm resolves less [rad or m].
_FINEST = 1e-7


@dataclass(frozen=True)
class ContentsSection(Section):
    """Topics of the bag, and how it is sampled."""

    title: ClassVar[str] = 'What is in it'
    template: ClassVar[str] = 'inspection_contents.html'

    found: Inspection

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Return what is to be said of its time."""
        sampling, recording = self.found.sampling, self.found.recording
        rate = plain(sampling.rate_hz, 4)
        facts = [
            ('Duration', f'{sampling.duration:.2f} s, {len(recording)} samples'),
            (
                'Rate',
                f'{rate} Hz, steps vary by {100 * sampling.jitter:.1f} %',
            ),
            ('Longest step', f'{plain(1000 * sampling.longest_step)} ms'),
            ('Gaps', str(sampling.gaps) if sampling.gaps else 'none'),
            ('Motion', repetition(self.found)),
            ('Clock', recording.clock),
            ('Reading', recording.report.describe()),
        ]
        trial = self.found.trial
        if trial is not None and trial.cutoff_hz is not None:
            facts.append(('Cut-off', f'{trial.cutoff_hz:.3g} Hz would be chosen by identify'))
        return facts


@dataclass(frozen=True)
class JointTable(Section):
    """Ranges, speeds and efforts."""

    title: ClassVar[str] = 'Joints'
    template: ClassVar[str] = 'table.html'
    hint: ClassVar[str] = (
        'Speed: 99th percentile, from the positions. Step: smallest change of position between '
        'samples. Dq ratio: recorded velocity over the derivative of the positions; 1 if units '
        'and signs agree. Effort: rms and maximum.'
    )

    found: Inspection

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns, with units; none is broken within its unit."""
        heads, units = list(joint_heads(self.found)), set(self.found.units)
        if len(units) == 1:
            for column, like in ((2, 1), (5, 1), (8, 7)):
                heads[column] += heads[like][heads[like].index(' [') :]
        return tuple(head.replace('N m', 'N\N{NO-BREAK SPACE}m') for head in heads)

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """One row a joint."""
        return joint_rows(self.found)


@dataclass(frozen=True)
class RecordingCurves(Section):
    """All that was recorded, over time."""

    title: ClassVar[str] = 'Curves'
    template: ClassVar[str] = 'inspection_curves.html'

    found: Inspection

    @property
    def joints(self) -> list[tuple[str, list[Chart]]]:
        """Name and charts of every joint."""
        return [(name, self._charts(k)) for k, name in enumerate(self.found.recording.joints)]

    @property
    def steps(self) -> Chart:
        """Time between samples."""
        t = self.found.recording.t
        steps = 1e3 * np.diff(t)
        chosen = thinned(steps, most=_MOST)
        return Chart(
            t[1:][chosen],
            [Series('step', steps[chosen], 'residual')],
            'time [s]',
            'step [ms]',
            height=150,
            legend=False,
        )

    def _charts(self, k: int) -> list[Chart]:
        recording, robot, unit = self.found.recording, self.found.robot, self.found.units[k]
        levels: list[Level] = []
        if robot is not None:
            low, high = recording.q[:, k].min(), recording.q[:, k].max()
            reach = max(high - low, 1e-6)
            levels = [
                Level(float(limit), 'limit')
                for limit in (robot.lower[k], robot.upper[k])
                if np.isfinite(limit) and low - reach < limit < high + reach
            ]
        torque = 'N' if unit == 'm' else 'N m'
        charts = [_chart(recording.t, recording.q[:, k], f'position [{unit}]', levels)]
        if recording.dq is not None:
            charts.append(_chart(recording.t, recording.dq[:, k], f'velocity [{unit}/s]'))
        if recording.tau is not None:
            charts.append(_chart(recording.t, recording.tau[:, k], f'effort [{torque}]'))
        return charts


def _chart(t: FloatArray, y: FloatArray, label: str, levels: list[Level] | None = None) -> Chart:
    chosen = thinned(y, most=_MOST)
    series = [Series(label.split(' ')[0], y[chosen], 'after')]
    return Chart(t[chosen], series, 'time [s]', label, 160, _LINK, levels or (), legend=False)


def repetition(found: Inspection) -> str:
    """Say whether the motion repeats."""
    sampling = found.sampling
    if sampling.period is None:
        return 'does not repeat'
    return f'repeats after {sampling.period:.2f} s, {sampling.periods:.1f} times'


def joint_heads(found: Inspection) -> tuple[str, ...]:
    """Return the heads of the table of joints; with units, where all joints have the same."""
    alike = len(set(found.units)) == 1
    length = f' [{found.units[0]}]' if alike else ''
    speed = f' [{found.units[0]}/s]' if alike else ''
    torque = (' [N]' if found.units[0] == 'm' else ' [N m]') if alike else ''
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
    return [
        _row(joint, '' if alike else f' {unit}')
        for joint, unit in zip(found.joints, found.units, strict=True)
    ]


def _step(size: float) -> str:
    """Write the smallest change of a position; of what no encoder resolves, that it is less."""
    if size and size < _FINEST:
        return f'< {_FINEST:.0e}'.replace('e-0', 'e-')
    return f'{size:.2g}' if size else '-'


def _row(joint: JointFacts, unit: str) -> tuple[str, ...]:
    efforts = (joint.effort_rms, joint.effort_largest)
    return (
        joint.name,
        f'{joint.lower:.3g}',
        f'{joint.upper:.3g}{unit}',
        digits(joint.speed),
        f'{100 * joint.moving:.0f} %',
        _step(joint.step),
        '-' if joint.velocity_ratio is None else f'{joint.velocity_ratio:.3g}',
        *('-' if effort is None else digits(effort) for effort in efforts),
    )
