# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap of every joint: without what was named, with it, and the floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis.verdict.finding import Gap, Overlay
from armid_ros.motion import FloatArray
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.charts import Chart, Role, Series, thinned
from armid_ros.report.notation import digits, torque_unit
from armid_ros.report.page import Section
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class GapBars(Section):
    """
    Errors before and after, compared with the noise floor.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    gap : Gap
        The numbers.
    floor : str
        What the floor is, in words.
    patched : bool
        Whether anything was added to the model.
    harmful : bool
        Whether it was not kept, as it makes the model worse in some joint.

    """

    title: ClassVar[str] = 'Gap'
    template: ClassVar[str] = 'gap.html'

    robot: Robot
    gap: Gap
    floor: str
    patched: bool
    harmful: bool = False

    @property
    def bars(self) -> BarChart:
        """Root mean square errors of each joint, in units of its floor."""
        roles: list[tuple[Role, str, FloatArray]] = [
            ('before', 'before', self.gap.before),
            ('after', 'after', self.gap.after),
            ('floor', 'floor', self.gap.floor),
        ]
        if not self.patched:
            roles = [('before', 'error', self.gap.after), roles[-1]]
        rows = []
        for joint, name in enumerate(self.robot.joints):
            unit = torque_unit(self.robot, joint)
            if not any(errors[joint] for _, _, errors in roles):  # at rest: no row counts
                rows.append((name, [Bar(0.0, 'floor', 'not judged')]))
                continue
            least = max(float(self.gap.floor[joint]), 1e-12)
            bars = [
                Bar(float(errors[joint]) / least, role, f'{digits(float(errors[joint]))} {unit}')
                for role, _, errors in roles
            ]
            rows.append((name, bars))
        return BarChart(rows, '', [(role, label) for role, label, _ in roles])

    @property
    def where(self) -> str:
        """Return what it was measured on."""
        return 'recordings that were not used' if self.gap.predicted else self.gap.data


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
    patched : bool
        Whether anything was added to the model.
    names : mapping of str to str
        What each recording is called.

    """

    title: ClassVar[str] = 'Measured and modelled'
    template: ClassVar[str] = 'overlay.html'

    robot: Robot
    gap: Gap
    patched: bool
    names: Mapping[str, str]

    @property
    def joint(self) -> int:
        """Return the joint with the largest gap."""
        return int(np.argmax(self.gap.chi2_before))

    @property
    def name(self) -> str:
        """Its name."""
        return self.robot.joints[self.joint]

    @property
    def source(self) -> str:
        """Return what the recording is called that is shown."""
        return self.names.get(self.overlay.source, self.overlay.source)

    @property
    def overlay(self) -> Overlay:
        """Return the recording in which it is largest."""
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
        told = np.flatnonzero(shown.trajectory.informative[:, j])
        moving = slice(told[0], told[-1] + 1) if len(told) else slice(None)
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
                *self._models(before[kept], after[kept]),
            ],
            '',
            f'torque [{unit}]',
            link='overlay',
        )
        residual = Chart(
            t[kept],
            [
                Series('twice the floor', -band, 'floor', 'band', band),
                *self._models((measured - before)[kept], (measured - after)[kept]),
            ],
            'time [s]',
            f'residual [{unit}]',
            height=170,
            link='overlay',
            symmetric=True,
        )
        return torque, residual

    def _models(self, before: FloatArray, after: FloatArray) -> list[Series]:
        if not self.patched:
            return [Series('model', after, 'before')]
        return [Series('before', before, 'before'), Series('after', after, 'after')]
