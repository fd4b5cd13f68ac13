# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A run that is planned: its motion within the limits, its clearance, what it will show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.excitation import Design, FourierTrajectory, Limits
from armid_ros.motion import FloatArray, Motion
from armid_ros.report.charts import Chart, Level, Series
from armid_ros.report.families import grouping, parameter_families, rigid_label
from armid_ros.report.notation import digits, pretty
from armid_ros.report.page import Section
from armid_ros.report.silhouettes import Silhouettes
import numpy as np


@dataclass(frozen=True)
class PlannedMotion(Section):
    """
    The joints' paths, rates and torques against the limits in force.

    Attributes
    ----------
    limits : Limits
        What was to be kept.
    motion : Motion
        The run, with the torque that the prior model says.
    shares : mapping of str to ndarray, shape (n,)
        Of the excitation alone; see `used_shares`.

    """

    title: ClassVar[str] = 'Motion and limits'
    template: ClassVar[str] = 'planned_motion.html'

    limits: Limits
    motion: Motion
    shares: Mapping[str, FloatArray]

    @property
    def rows(self) -> list[tuple[str, list[str]]]:
        """Joint, and how much of each limit it uses."""
        return [
            (
                joint,
                [
                    (f'{100.0 * share[j]:.0f} %' if share[j] > 0.0 else 'no limit')
                    for share in self.shares.values()
                ],
            )
            for j, joint in enumerate(self.limits.joints)
        ]

    @property
    def panels(self) -> list[tuple[str, list[Chart]]]:
        """Joint, and charts of its position, velocity, acceleration and torque."""
        return [(joint, self._charts(j)) for j, joint in enumerate(self.limits.joints)]

    def _charts(self, j: int) -> list[Chart]:
        limits, motion = self.limits, self.motion
        assert motion.tau is not None
        quantities = (
            ('position', motion.q, limits.lower, limits.upper),
            ('velocity', motion.dq, -limits.velocity, limits.velocity),
            ('acceleration', motion.ddq, -limits.acceleration, limits.acceleration),
            ('torque', motion.tau, -limits.torque, limits.torque),
        )
        return [
            Chart(
                motion.t,
                [Series(name, values[:, j], 'residual')],
                'time [s]' if name == 'torque' else '',
                f'{name} [{pretty(limits.unit(name, j))}]',
                height=180 if name == 'torque' else 145,
                link='planned',
                levels=[Level(float(e[j])) for e in (lower, upper) if np.isfinite(e[j])],
                legend=False,
            )
            for name, values, lower, upper in quantities
        ]


@dataclass(frozen=True)
class PlannedClearance(Section):
    """
    How far bodies are apart, from each other and from what stands around.

    Attributes
    ----------
    t : ndarray, shape (N,)
        Time [s].
    curves : mapping of str to ndarray, shape (N,)
        Smallest distance of each kind [m].
    margin : float
        What was to be kept [m].
    notes : sequence of str
        What was not looked at.

    """

    title: ClassVar[str] = 'Clearance'
    template: ClassVar[str] = 'planned_clearance.html'

    t: FloatArray
    curves: Mapping[str, FloatArray]
    margin: float
    notes: Sequence[str]

    @property
    def chart(self) -> Chart:
        """Distances over time."""
        roles = ('residual', 'before')
        return Chart(
            self.t,
            [
                Series(name, 100.0 * curve, 'residual' if role == 'residual' else 'before')
                for (name, curve), role in zip(self.curves.items(), roles, strict=False)
            ],
            'time [s]',
            'distance [cm]',
            height=240,
            link='planned',
            levels=[Level(100.0 * self.margin, f'{100.0 * self.margin:g} cm to keep')],
        )


#: Name, sum, joint, value of the description, deviation, relative, length of the bar [%].
_Row = tuple[str, str, str, str, str, str, float]


@dataclass(frozen=True)
class Foreseen(Section):
    """
    What the run will tell of every parameter.

    Attributes
    ----------
    design : Design
        The run and its information.
    links : sequence of str
        Names of the links, in the order of their numbers.

    """

    title: ClassVar[str] = 'Expected accuracy'
    template: ClassVar[str] = 'foreseen.html'

    design: Design
    links: Sequence[str] = ()

    @property
    def families(
        self,
    ) -> list[tuple[str, str, bool, list[_Row]]]:
        """Heading, unit, whether rigid, and the rows of each kind, known best first."""
        names = self.design.information.parameters
        return [
            (
                title,
                unit,
                names[members[0]].rigid,
                self._rows(members),
            )
            for (title, unit), members in parameter_families(names).items()
        ]

    def _rows(self, members: Sequence[int]) -> list[_Row]:
        """Return the rows of a kind."""
        information, described = self.design.information, self.design.described
        size = information.std / information.scale
        longest = max((size[k] for k in members if np.isfinite(size[k])), default=1.0)
        rows = []
        for k in sorted(members, key=lambda k: float(size[k])):
            name, std, value = information.parameters[k], information.std[k], described[k]
            seen, known = bool(np.isfinite(std)), name.rigid or value != 0.0  # noqa: RUF069 - an effect without a value
            relative = f'{digits(100.0 * std / abs(value))} %' if value and seen else ''
            rows.append(
                (
                    rigid_label(name, self.links) if name.rigid else name.name,
                    grouping(name, self.links) if name.rigid else '',
                    name.joint,
                    f'{value:.3g}' if known else 'not known',
                    digits(float(std)) if seen else 'not seen',
                    relative if std < abs(value) or not relative else '> 100 %',
                    round(100.0 * float(size[k] / longest), 1) if seen else 100.0,
                )
            )
        return rows


@dataclass(frozen=True)
class Harmonics(Section):
    """
    How the motion of each joint is made up.

    Attributes
    ----------
    trajectory : FourierTrajectory
        One period.

    """

    title: ClassVar[str] = 'Spectrum'
    template: ClassVar[str] = 'harmonics.html'

    trajectory: FourierTrajectory

    @property
    def frequencies(self) -> list[str]:
        """Frequency of each harmonic [Hz]."""
        harmonics = np.arange(1, self.trajectory.harmonics + 1)
        return [f'{k / self.trajectory.period:.3g} Hz' for k in harmonics]

    @property
    def rows(self) -> list[tuple[str, list[tuple[str, int]]]]:
        """Joint, and the velocity amplitude of each harmonic with its share of the largest."""
        size = np.hypot(self.trajectory.a, self.trajectory.b)
        share = size / np.maximum(size.max(axis=1, keepdims=True), 1e-12)
        return [
            (joint, [(digits(a), round(55.0 * s)) for a, s in zip(size[j], share[j], strict=True)])
            for j, joint in enumerate(self.trajectory.joints)
        ]


@dataclass(frozen=True)
class ArmPoses(Section):
    """
    The arm at instants of the run.

    Attributes
    ----------
    drawing : Silhouettes
        Outlines of the bodies.
    obstacles : str
        Names of what stands around the arm.

    """

    title: ClassVar[str] = 'Poses'
    template: ClassVar[str] = 'poses.html'

    drawing: Silhouettes
    obstacles: str
