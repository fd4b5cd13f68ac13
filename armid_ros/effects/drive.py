# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The drive train: the inertia of what turns before the gear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from armid_ros.effects.base import Action, Effect, joint_columns, Quantity, scatter
from armid_ros.motion import FloatArray, Motion
import numpy as np

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel


@dataclass(frozen=True)
class RotorInertia(Effect):
    """
    Inertia of the rotor and gear, seen at the joint, tau = Ia ddq.

    Ia is the rotor's inertia times the gear ratio squared; gyroscopic coupling is neglected, as
    is usual for geared arms. The same as Izz of the link for the first joint, exactly.
    Source: Khalil and Dombre 2002, section 9.4.

    """

    name = 'rotor_inertia'
    summary = 'inertia of rotor and gear, seen by its own joint only'
    quantities = (Quantity('rotor_inertia', 'kg m^2', lower=0.0),)

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return dtau/dIa = ddq [rad/s^2], shape (N, n, P)."""
        return joint_columns(self, motion, motion.ddq)

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return the inertia on the diagonal."""
        (inertia,) = scatter(self, values, arm.robot)
        return Action(inertia=np.diag(inertia))
