# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A machine and its wearer: stiffness of the ties, gait by torque, forces, poses, assumptions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.assumptions import Assumption
from armid_ros.papers.exo.report.poses import Drawing
from armid_ros.report.charts import Chart, Role, Series
from armid_ros.report.notation import measured
from armid_ros.report.page import Section
import numpy as np

_ROLES: tuple[Role, ...] = ('residual', 'predicted', 'before', 'measured')


@dataclass(frozen=True)
class Stiffness(Section):
    """
    What ties the two, with intervals.

    Attributes
    ----------
    found : sequence of Interaction
        One stiffness for all, then one for each.
    truth : mapping of str to float
        True stiffness by segment [N/m], where the data were simulated; empty otherwise.

    """

    title: ClassVar[str] = 'Stiffness'
    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'stiffness.html'

    found: Sequence[Interaction]
    truth: Mapping[str, float]

    @property
    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Segment, stiffness, half width of the 95 % interval, bias without correction, truth."""
        rows = []
        for found in self.found:
            for k, segment in enumerate(found.segments):
                true = self.truth.get(segment)
                rows.append(
                    (
                        segment.replace('_', ' '),
                        *measured(found.stiffness[k], HALF_WIDTH * found.std[k]),
                        f'{100.0 * found.bias[k] / found.stiffness[k]:+.2f} %',
                        '' if true is None else f'{true:g}',
                    )
                )
        return rows

    @property
    def noise(self) -> list[tuple[str, str]]:
        """Noise that was found in the data."""
        found = self.found[0]
        angles = np.degrees(found.position_noise)
        return [
            ('Noise of the angles, as filtered', f'{_range(angles)}°'),
            ('Noise of the torques, as filtered', f'{_range(found.torque_noise)} N m'),
        ]


def _range(values: FloatArray) -> str:
    """Return the least and the largest of values to two digits, once if they are alike."""
    ends = dict.fromkeys(f'{end:.2g}' for end in (values.min(), values.max()))
    return ' to '.join(ends)


@dataclass(frozen=True)
class Forces(Section):
    """
    What each segment feels of the other machine.

    Attributes
    ----------
    abscissa : ndarray, shape (N,)
        Gait cycle or time.
    abscissa_name : str
        What it is, with its unit.
    forces : ndarray, shape (N, S, 3)
        On the machine [N].
    segments : sequence of str
        Their names.
    tau, without : ndarray, shape (N, n)
        Torques of the machine's joints with springs and without [N m].
    joints : sequence of str
        Names of the joints.

    """

    title: ClassVar[str] = 'Interaction'
    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'forces.html'

    abscissa: FloatArray
    abscissa_name: str
    forces: FloatArray
    segments: Sequence[str]
    tau: FloatArray
    without: FloatArray
    joints: Sequence[str]

    @property
    def chart(self) -> Chart:
        """Force of every spring."""
        size = np.linalg.norm(self.forces, axis=2)
        return Chart(
            self.abscissa,
            [
                Series(name.replace('_', ' '), size[:, k], _ROLES[k % len(_ROLES)])
                for k, name in enumerate(self.segments)
            ],
            self.abscissa_name,
            'force [N]',
            height=260,
        )

    @property
    def torques(self) -> list[tuple[str, Chart]]:
        """Torque of every joint with springs and without."""
        return [
            (
                joint,
                Chart(
                    self.abscissa,
                    [
                        Series('alone', self.without[:, k], 'measured'),
                        Series('with springs', self.tau[:, k], 'residual'),
                    ],
                    self.abscissa_name,
                    'torque [N m]',
                    height=180,
                    link='torques',
                ),
            )
            for k, joint in enumerate(self.joints)
        ]

    @property
    def rows(self) -> list[tuple[str, str, str]]:
        """Segment, mean and largest force."""
        size = np.linalg.norm(self.forces, axis=2)
        return [
            (name.replace('_', ' '), f'{size[:, k].mean():.0f}', f'{size[:, k].max():.0f}')
            for k, name in enumerate(self.segments)
        ]


@dataclass(frozen=True)
class Poses(Section):
    """
    Both bodies at instants of the motion.

    Attributes
    ----------
    drawing : Drawing
        Lines of both and where the springs are.

    """

    title: ClassVar[str] = 'Poses'
    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'poses.html'

    drawing: Drawing


@dataclass(frozen=True)
class Assumptions(Section):
    """
    What the source leaves open.

    Attributes
    ----------
    assumptions : mapping of str to Assumption
        By name.

    """

    title: ClassVar[str] = 'Assumptions'
    package: ClassVar[str] = 'armid_ros.papers.exo.report'
    template: ClassVar[str] = 'assumptions.html'

    assumptions: Mapping[str, Assumption]

    @property
    def rows(self) -> list[tuple[str, str, str]]:
        """Name, value with unit, reason."""
        return [
            (name.replace('_', ' '), _shown(entry), entry.reason)
            for name, entry in self.assumptions.items()
        ]


def _shown(entry: Assumption) -> str:
    value = entry.value
    if isinstance(value, dict):
        text = ', '.join(f'{name} {number:g}' for name, number in value.items())
    elif isinstance(value, list):
        text = ', '.join(f'{number:g}' for number in value)
    else:
        text = f'{value:g}' if isinstance(value, float) else str(value)
    return f'{text} {entry.unit}'.strip()
