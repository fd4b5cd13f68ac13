# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Effects on each joint separately, and the order of their parameters."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from armid_ros.effects.action import Action, direction, DryFriction
from armid_ros.effects.base import Arm, Effect
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


class JointStates(NamedTuple):
    """
    Time, position, velocity and motion direction of the k joints of an effect.

    Attributes
    ----------
    t : ndarray, shape (..., 1)
        Time since the start of the recording [s].
    q, dq : ndarray, shape (..., k)
        Positions [rad or m] and velocities.
    forwards : ndarray, shape (..., k)
        Direction of motion, from -1 to 1.

    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    forwards: FloatArray


@dataclass(frozen=True)
class JointLaw(Effect):
    """Base class of effects whose joint torque depends only on time and that joint's motion."""

    #: Whether the torque acts on the link side of an elastic transmission.
    on_links: ClassVar[bool] = False

    @abstractmethod
    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """
        Return the joint torques per unit of each quantity, one array (..., k) per quantity.

        A law that depends on the direction of motion holds the joint at rest, between two levels
        that depend on nothing else.

        """

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the regressor of the effect along a motion, shape (N, n, P)."""
        side = arm.link_motion(motion) if self.on_links else motion
        own = self.indices(motion.joints)
        states = (part[:, own] for part in (side.q, side.dq, direction(side)))
        return _placed(own, motion, self.law(JointStates(motion.t[:, np.newaxis], *states)))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with the torque; a jump at zero velocity becomes dry friction."""
        places, n = self.indices(arm.robot.joints), arm.robot.n_joints
        first, *others = values.reshape(len(places), -1).T
        # a slice takes less time than indices, and the plant calls the law in every step
        own = slice(None) if places == list(range(n)) else np.array(places, dtype=np.intp)

        def total(x: JointStates) -> FloatArray:
            law, *laws = self.law(x)
            tau = first * law
            for amplitude, law in zip(others, laws, strict=True):
                tau += amplitude * law
            return tau

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            moving = dq[..., own]
            forwards = np.copysign(1.0, moving)
            found = total(JointStates(t[..., np.newaxis], q[..., own], moving, forwards))
            if self.holds_at_rest:
                found -= middle + half * forwards
            if isinstance(own, slice):
                return found
            tau = np.zeros(np.shape(q))
            tau[..., own] = found
            return tau

        if self.on_links:
            return Action(link_torque=torque)
        if not self.holds_at_rest:
            return Action(torque=torque)
        rest, ahead = np.zeros(len(places)), np.ones(len(places))
        lower, upper = (total(JointStates(rest[:1], rest, rest, s * ahead)) for s in (-1.0, 1.0))
        middle, half = (upper + lower) / 2.0, (upper - lower) / 2.0
        return Action(torque=torque, dry_friction=DryFriction(np.eye(n)[places], lower, upper))


def joint_columns(effect: Effect, motion: Motion, *quantities: FloatArray) -> FloatArray:
    """
    Return the regressor (N, n, P) of an effect that acts on each joint separately.

    Parameters
    ----------
    effect : Effect
        Effect with the joints.
    motion : Motion
        Motion with the joint order.
    *quantities : ndarray, shape (N, n)
        One array per quantity of the effect: dtau_j / dtheta_j for all joints of the motion.

    Returns
    -------
    ndarray, shape (N, n, P)
        Zero where a parameter belongs to another joint.

    """
    own = effect.indices(motion.joints)
    every = own == list(range(motion.n_joints))
    return _placed(own, motion, quantities if every else [x[:, own] for x in quantities])


def scatter(effect: Effect, values: FloatArray, robot: Robot) -> FloatArray:
    """
    Arrange an effect's values as an array with a column per robot joint, zero for other joints.

    Parameters
    ----------
    effect : Effect
        Effect with k joints.
    values : ndarray, shape (k c,)
        Values of c quantities or shapes, joint by joint.
    robot : Robot
        The arm.

    Returns
    -------
    ndarray, shape (c, n)

    """
    rows = values.reshape(len(effect.joints), -1).T
    spread = np.zeros((len(rows), robot.n_joints))
    spread[:, effect.indices(robot.joints)] = rows
    return spread


def _placed(own: list[int], motion: Motion, quantities: Sequence[FloatArray]) -> FloatArray:
    """Arrange torques of the joints `own`, per unit of each quantity, as a regressor (N, n, P)."""
    n, count = len(own), len(quantities)
    columns = np.zeros((len(motion), motion.n_joints * n * count))
    places: Any = slice(None, None, (n + 1) * count)  # takes less time than indices
    if own != list(range(motion.n_joints)):
        places = count * (n * np.array(own, dtype=np.intp) + np.arange(n))
    for number, values in enumerate(quantities):
        columns[:, number:][:, places] = values
    return columns.reshape(*motion.q.shape, n * count)
