# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap of every joint: without what was named, with it, and the noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis.verdict.gap import Gap, Overlay
from armid_ros.motion import FloatArray
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.charts import Chart, Series, thinned
from armid_ros.report.notation import digits, torque_unit
from armid_ros.report.page import Section
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class GapBars(Section):
    """
    Errors before and after, beside the noise floor.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    gap : Gap
        The numbers.

    """

    title: ClassVar[str] = 'Gap'
    template: ClassVar[str] = 'gap.html'

    robot: Robot
    gap: Gap

    @property
    def bars(self) -> BarChart:
        """Root mean square errors of each joint."""
        rows = []
        for joint, name in enumerate(self.robot.joints):
            unit = torque_unit(self.robot, joint)
            numbers = (
                (self.gap.before[joint], 'before'),
                (self.gap.after[joint], 'after'),
                (self.gap.floor[joint], 'floor'),
            )
            bars = [
                Bar(float(value), role, f'{digits(float(value))} {unit}')  # type: ignore[arg-type]
                for value, role in numbers
            ]
            rows.append((name, bars))
        roles = [('before', 'before'), ('after', 'after'), ('floor', 'noise floor')]
        return BarChart(rows, 'N m', roles, scale_by_row=True)  # type: ignore[arg-type]

    @property
    def closed(self) -> str:
        """Share of the gap that is closed, in per cent."""
        return f'{100.0 * self.gap.closed:.0f}'


@dataclass(frozen=True)
class GapOverlay(Section):
    """
    Measured torque and both models, in the joint and recording where the gap was largest.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    gap : Gap
        The curves.

    """

    title: ClassVar[str] = 'Measured and modelled'
    template: ClassVar[str] = 'overlay.html'

    robot: Robot
    gap: Gap

    @property
    def joint(self) -> int:
        """The joint with the largest gap."""
        return int(np.argmax(self.gap.loss_before))

    @property
    def name(self) -> str:
        """Its name."""
        return self.robot.joints[self.joint]

    @property
    def overlay(self) -> Overlay:
        """The recording in which it is largest."""
        j = self.joint

        def size(overlay: Overlay) -> float:
            left = (overlay.measured - overlay.before)[:, j] / overlay.sigma[j]
            return float(np.mean(left**2))

        return max(self.gap.overlays, key=size)

    @property
    def charts(self) -> tuple[Chart, Chart]:
        """Torques while the joint moves, and residuals with a band of two standard deviations."""
        j, shown = self.joint, self.overlay
        unit = torque_unit(self.robot, j)
        told = np.flatnonzero(shown.trajectory.told[:, j])
        moving = slice(told[0], told[-1] + 1)
        measured, before, after = (
            x[moving, j] for x in (shown.measured, shown.before, shown.after)
        )
        t = shown.trajectory.t[moving]
        kept = thinned(measured, measured - before, measured - after)
        band: FloatArray = np.full(len(kept), 2.0 * shown.sigma[j])
        torque = Chart(
            t[kept],
            [
                Series('measured', measured[kept], 'measured'),
                Series('before', before[kept], 'before'),
                Series('after', after[kept], 'after'),
            ],
            '',
            f'torque [{unit}]',
            link='overlay',
        )
        residual = Chart(
            t[kept],
            [
                Series('two sigma of the noise', -band, 'floor', 'band', band),
                Series('before', (measured - before)[kept], 'before'),
                Series('after', (measured - after)[kept], 'after'),
            ],
            'time [s]',
            f'residual [{unit}]',
            height=170,
            link='overlay',
            symmetric=True,
        )
        return torque, residual
