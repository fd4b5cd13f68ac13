# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the torque of an arm, with all effects, by its motion."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.arm.arm_model import ArmModel
from armid_ros.effects import Hysteresis, law_derivatives
from armid_ros.model import inverse_dynamics_derivatives
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class TorqueSlope:
    """
    Derivatives of an arm's true joint torque by q, dq and ddq along a motion.

    The torque is that of ``ArmModel.joint_torque``. The direction of motion in dry friction, and
    the twist between motors and links, are held constant.

    Attributes
    ----------
    motion : Motion
        N samples.
    by_q, by_dq, by_ddq : ndarray, shape (N, n, n)
        Derivatives; element [k, j, m] is that of the torque of joint j by joint m in sample k.
    hysteresis : Hysteresis or None
        Friction that also depends on the motion before a sample.

    """

    motion: Motion
    by_q: FloatArray = field(repr=False)
    by_dq: FloatArray = field(repr=False)
    by_ddq: FloatArray = field(repr=False)
    hysteresis: Hysteresis | None

    @classmethod
    def of(cls, arm: ArmModel, motion: Motion) -> TorqueSlope:
        """Differentiate the joint torque of an arm along a motion."""
        action, link = arm.along(motion).action(), arm.link_motion(motion)
        slopes = inverse_dynamics_derivatives(arm.body, arm.rigid_body_motion(link))
        if arm.quasi_static:
            slopes = slopes[0], np.zeros_like(slopes[1]), np.zeros_like(slopes[2])
        together = arm.with_load_friction(motion, np.concatenate(slopes, axis=2))
        by_q, by_dq, by_ddq = np.split(together, 3, axis=2)
        if action.damping is not None:
            by_dq = by_dq + action.damping
        if action.inertia is not None:
            by_ddq = by_ddq + action.inertia
        for law, side in ((action.torque, motion), (action.link_torque, link)):
            if law is not None:
                more = law_derivatives(law, side)
                by_q, by_dq = by_q + more[0], by_dq + more[1]
        return cls(motion, by_q, by_dq, by_ddq, action.hysteresis)

    def pullback(self, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return the derivatives by q, dq and ddq of a weighted sum of all joint torques.

        Parameters
        ----------
        weights : ndarray, shape (N, n)
            Weight of each joint torque.

        Returns
        -------
        tuple of ndarray, each of shape (N, n)

        """
        row = weights[:, np.newaxis]
        by_q, by_dq, by_ddq = ((row @ by)[:, 0] for by in (self.by_q, self.by_dq, self.by_ddq))
        if self.hysteresis is not None:
            by_q = by_q + self.hysteresis.pullback(self.motion.q, self.motion.dq, weights)
        return by_q, by_dq, by_ddq
