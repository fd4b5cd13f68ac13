# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is left without a name, learned: torque over position and velocity, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.charts import image_data
from armid_ros.report.notation import digits, percent, position_unit, torque_unit
from armid_ros.report.page import Section
from armid_ros.residual import JointResidual, Residual, TABLE_FILE
import numpy as np

#: Cells of a picture along position and velocity.
_CELLS = 80, 60
_POSITIVE, _NEGATIVE, _UNSURE = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.5, 0.5, 0.5)


@dataclass(frozen=True)
class Picture:
    """
    A map of one joint at its middle load.

    Attributes
    ----------
    joint : str
        The joint.
    torque, std : str
        Images of the torque and of its deviation, as data.
    alt : str
        The same in words.
    peak, unsure : str
        The largest torque and the largest deviation, with units.
    left, right, low, high : str
        Ends of position and velocity, with units.

    """

    joint: str
    torque: str
    std: str
    alt: str
    peak: str
    unsure: str
    left: str
    right: str
    low: str
    high: str


@dataclass(frozen=True)
class ResidualMap(Section):
    """
    Maps of what has no name.

    Attributes
    ----------
    residual : Residual
        What was learned.

    """

    title: ClassVar[str] = 'Learned residual'
    template: ClassVar[str] = 'residual_map.html'
    table: ClassVar[str] = TABLE_FILE

    residual: Residual

    @property
    def rows(self) -> Sequence[tuple[str, ...]]:
        """Joint, rms without and with the map, shares of the map, the law and its share."""
        return [
            (
                one.joint,
                f'{digits(one.before)} {self._unit(one)}',
                f'{digits(one.after)} {self._unit(one)}',
                percent(one.gain),
                _alone(one),
                'none of few terms' if one.law is None else one.law.text,
                '' if one.law is None else percent(one.law.share),
            )
            for one in self.residual.joints
        ]

    @property
    def pictures(self) -> list[Picture]:
        """Return a map a joint."""
        return [self._picture(one) for one in self.residual.joints]

    def _unit(self, one: JointResidual) -> str:
        robot = self.residual.base.robot
        return torque_unit(robot, robot.joints.index(one.joint))

    def _picture(self, one: JointResidual) -> Picture:
        robot = self.residual.base.robot
        unit, length = self._unit(one), position_unit(robot, robot.joints.index(one.joint))
        q, dq = (one.axis(number, count) for number, count in enumerate(_CELLS))
        load = np.full((len(dq), len(q)), one.ranges[2].mean())
        inputs = np.stack([*np.meshgrid(q, dq[::-1]), load], axis=-1)
        torque, std = one.learned.torque(inputs), one.learned.std(inputs)
        peak = max(float(np.abs(torque).max()), 1e-12)
        most = inputs[np.unravel_index(np.argmax(np.abs(torque)), torque.shape)]
        return Picture(
            joint=one.joint,
            torque=image_data(
                np.where((torque >= 0.0)[..., None], _POSITIVE, _NEGATIVE), torque / peak
            ),
            std=image_data(np.broadcast_to(_UNSURE, (*std.shape, 3)), std / one.learned.amplitude),
            alt=f'most at {digits(most[0])} {length} and {digits(most[1])} {length}/s',
            peak=f'{digits(peak)} {unit}',
            unsure=f'{digits(one.learned.amplitude)} {unit}',
            left=f'{digits(q[0])} {length}',
            right=f'{digits(q[-1])} {length}',
            low=f'{digits(dq[0])} {length}/s',
            high=f'{digits(dq[-1])} {length}/s',
        )


def _alone(one: JointResidual) -> str:
    """Return the share of held-out recordings."""
    if one.held_out is None:
        return ''
    return 'worse' if one.held_out < 0.0 else percent(one.held_out)
