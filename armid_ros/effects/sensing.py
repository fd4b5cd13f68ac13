# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a torque reading contains that the arm does not need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from armid_ros.effects.base import Action, Effect, joint_columns, Quantity, scatter
from armid_ros.motion import FloatArray, Motion
import numpy as np

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel


@dataclass(frozen=True)
class TorqueOffset(Effect):
    """
    Constant torque, in motion and at rest, tau = offset.

    Confounded with asymmetric Coulomb friction while the joint moves and with the preload of a
    spring.
    Source: Gautier, Janot and Vandanjon 2013.

    """

    name = 'torque_offset'
    summary = 'constant torque, in motion and at rest'
    quantities = (Quantity('torque_offset', 'N m'),)

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return dtau/doffset = 1 [-], shape (N, n, P)."""
        return joint_columns(self, motion, np.ones_like(motion.q))

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return the constant torque."""
        (offset,) = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.broadcast_to(offset, np.shape(dq))

        return Action(torque=torque)
