# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs from the base to a joint: cables, balancers, bumpers."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.effects.base import Arm, Unexplained
from armid_ros.effects.joint_law import JointLaw, JointStates
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class JointSpring(JointLaw):
    """
    Spring on a joint, such as a cable, a hose or a balancer, tau = k q + preload.

    The preload is the torque at q = 0, which is -k times the rest position. The torque depends on
    position only, not on speed, payload or gravity. Without stiffness it equals a torque_offset.
    Confounded with the first moment of the link over a small range; tilting the base, or removing
    the hose, distinguishes them.

    """

    name = 'joint_spring'
    summary = 'spring on a joint: cable, hose, balancer'
    quantities = (
        Quantity('spring_stiffness', 'N m/rad', lower=0.0, typical=(0.05, 50.0)),
        Quantity('spring_preload', 'N m', typical=(0.01, 50.0)),
    )

    on_links = True

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the spring torque per unit of stiffness, q, and per unit of preload, 1."""
        return x.q, np.ones_like(x.q)


@dataclass(frozen=True)
class SoftLimit(JointLaw):
    """
    Elastic stops at both ends of the joint range, which push back beyond a position.

    tau = k_up max(q - q_up, 0) - k_low max(q_low - q, 0), zero between q_low and q_up. Confounded
    with a hardening joint_spring; motion outside the bumpers distinguishes them.

    """

    name = 'soft_limit'
    summary = 'bumper or elastic end stop'
    quantities = (
        Quantity('lower_stiffness', 'N m/rad', lower=0.0, typical=(2.0, 2000.0)),
        Quantity('upper_stiffness', 'N m/rad', lower=0.0, typical=(2.0, 2000.0)),
    )
    shapes = (
        Shape('lower_position', 'rad', -1e4, 1e4, -1.0, (-2.0, -1.5, -1.0, -0.5)),
        Shape('upper_position', 'rad', -1e4, 1e4, 1.0, (0.5, 1.0, 1.5, 2.0)),
    )

    on_links = True

    def _default_shape(self, robot: Robot) -> FloatArray:
        joints = self.indices(robot.joints)
        lower, upper = robot.lower[joints], robot.upper[joints]
        known = np.isfinite(lower) & np.isfinite(upper)
        # default position of bumpers: this share of the range of motion from either end
        margin = 0.15 * np.where(known, upper - lower, 0.0)
        edges = np.stack([lower + margin, upper - margin], axis=1)
        return np.where(known[:, np.newaxis], edges, self.shape_values)

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return start values of the stop positions, near the ends of the recorded motion."""
        motion = unexplained.motion
        q = arm.link_motion(motion).q[:, self.indices(motion.joints)]
        lowest, highest = q.min(axis=0)[:, np.newaxis], q.max(axis=0)[:, np.newaxis]
        # shares of the range of the recorded motion between which a search places bumpers
        depth = (highest - lowest) * np.array((0.02, 0.05, 0.1, 0.2, 0.3))
        return lowest + depth, highest - depth

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of lower and upper stiffness: signed compressions [rad]."""
        lower, upper = self.shape_values.T
        return -np.maximum(lower - x.q, 0.0), np.maximum(x.q - upper, 0.0)
