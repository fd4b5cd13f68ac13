# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an arm carries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from armid_ros.effects.base import Action, Effect, Quantity
from armid_ros.model import LINK_PARAMETERS, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel

_UNITS = ('kg', 'kg m', 'kg m', 'kg m') + ('kg m^2',) * 6


@dataclass(frozen=True)
class Payload(Effect):
    """
    A body fixed to a link, the last one by default: mass, first moments and inertia.

    All ten are about the frame of the link's joint, so they add to the link's own and are linear.
    The same as the last link's parameters, exactly: a payload can be told from them only against
    a model that is known without it.

    """

    name = 'payload'
    summary = 'a body fixed to a link'
    quantities = tuple(
        Quantity(f'payload_{name}', unit, lower=0.0 if name == 'm' else -np.inf)
        for name, unit in zip(LINK_PARAMETERS, _UNITS, strict=True)
    )

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return robot.joints[-1:]

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return the link's own columns of the regressor, shape (N, n, P)."""
        return regressor(arm.robot, motion)[:, :, self._rows(arm.robot)]

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return the robot with the body added to its link."""
        parameters = arm.robot.rigid_parameters.copy()
        parameters[self._rows(arm.robot)] += values
        return Action(robot=arm.robot.with_inertias(parameters))

    def _rows(self, robot: Robot) -> list[int]:
        size = len(LINK_PARAMETERS)
        return [size * joint + i for joint in self.indices(robot.joints) for i in range(size)]
