# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Difference of gravity from the model: magnitude, or tilt of the base.

Joint torques are linear in the gravity vector. Both effects use the same three exact columns.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.effects.action import Action
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.quantities import Quantity
from armid_ros.effects.traits import TRAITS
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
from scipy.spatial.transform import Rotation


class _GravityEffect(Effect):
    """Base class of effects that change the gravity of the whole arm."""

    changes_body = True

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return ()

    def __post_init__(self) -> None:
        """Raise a ModelError if joints are given, as gravity acts on the whole arm."""
        if self.joints:
            raise ModelError(f'{self.name} acts on the whole arm, not on joint {self.joints[0]}')
        super().__post_init__()


@dataclass(frozen=True)
class GravityMagnitude(_GravityEffect):
    """
    Change of the magnitude of gravity relative to the model, |g| = |g_model| + dg.

    After a fit of the base parameters, it is identifiable only through masses that also cause
    inertia torques. Fast motion makes it identifiable.

    """

    name = 'gravity_magnitude'
    summary = 'gravity stronger or weaker than in the model'
    quantities = (Quantity('gravity_difference', 'm/s^2', typical=(0.05, 10.0)),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the joint torques per unit of gravity difference [N m per m/s^2], (N, n, 1)."""
        direction = _unit(arm.robot.gravity)[:, np.newaxis]
        return np.asarray(arm.gravity_columns(motion) @ direction)

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether gravity keeps its direction; a reversal would be a tilt of the base."""
        return bool(values[0] > -np.linalg.norm(arm.robot.gravity))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action whose robot has gravity of the changed magnitude."""
        gravity = arm.robot.gravity
        return Action(robot=arm.robot.with_gravity(gravity + values[0] * _unit(gravity)))


@dataclass(frozen=True)
class BaseTilt(_GravityEffect):
    """
    Tilt of the robot base relative to the base in the model.

    The base is turned by the rotation vector (tilt_x, tilt_y) about two axes normal to gravity.
    These are its own x and y axes for a base that is upright in the model. A rotation about
    gravity has no effect. Confounded with an encoder offset of the first joint when its axis is
    horizontal.

    """

    name = 'base_tilt'
    summary = 'tilt of the base relative to the model'
    quantities = tuple(
        Quantity(name, 'rad', lower=-np.pi, upper=np.pi, typical=(0.003, 0.1))
        for name in ('tilt_x', 'tilt_y')
    )
    linear = False

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the derivatives of the torques by tilt_x and tilt_y [N m/rad], (N, n, 2)."""
        values, size = arm.values_of(self), 1e-5  # step of the differences [rad]
        turned = [
            (_turned(arm.robot.gravity, values + step) - _turned(arm.robot.gravity, values - step))
            / (2.0 * size)
            for step in size * np.eye(2)
        ]
        return np.asarray(arm.gravity_columns(motion) @ np.transpose(turned))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action whose robot has the gravity vector in the frame of the tilted base."""
        return Action(robot=arm.robot.with_gravity(_turned(arm.robot.gravity, values)))


@dataclass(frozen=True)
class GravityVector(_GravityEffect):
    """
    Change of the gravity vector relative to the model, in direction and magnitude.

    The torque is exactly linear in the vector at any angle. A search uses this effect, and reports
    the result as base_tilt and gravity_magnitude.

    """

    name = BaseTilt.name
    traits = TRAITS[name]
    summary = 'gravity of another direction or size than in the model'
    quantities = tuple(Quantity(f'gravity_difference_{axis}', 'm/s^2') for axis in 'xyz')

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the joint torques per gravity component [N m per m/s^2], shape (N, n, 3)."""
        return arm.gravity_columns(motion)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action whose robot has the changed gravity vector."""
        return Action(robot=arm.robot.with_gravity(arm.robot.gravity + values))

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return the equivalent base_tilt and gravity_magnitude, each with its values."""
        before = np.array(arm.robot.gravity)
        after = before + values
        lengths = np.linalg.norm(before), np.linalg.norm(after)
        # the rotation vector of the base
        axis = np.cross(after, before)
        sine, cosine = float(np.linalg.norm(axis)), float(after @ before)
        tilt = np.array([0.0 if cosine >= 0.0 else np.pi, 0.0])
        if sine > 1e-12 * max(float(lengths[0] * lengths[1]), 1e-300):
            tilt = np.arctan2(sine, cosine) * (_horizontal_axes(before) @ axis) / sine
        return (BaseTilt(), tilt), (GravityMagnitude(), np.array([lengths[1] - lengths[0]]))


def with_exact_vector(kinds: Sequence[type[Effect]]) -> list[type[Effect]]:
    """Replace BaseTilt by GravityVector if GravityMagnitude is also among the effect classes."""
    both = BaseTilt in kinds and GravityMagnitude in kinds
    return [GravityVector if both and kind is BaseTilt else kind for kind in kinds]


def _turned(gravity: FloatArray, tilt: FloatArray) -> FloatArray:
    """Return the gravity vector in the frame of a base that is tilted by two angles [rad]."""
    rotation = Rotation.from_rotvec(tilt @ _horizontal_axes(gravity))
    return np.asarray(rotation.inv().apply(np.array(gravity)))


def _unit(gravity: FloatArray) -> FloatArray:
    """Return the unit vector along gravity; raise a ModelError if gravity is zero."""
    length = np.linalg.norm(gravity)
    if not length > 0.0:
        raise ModelError('gravity is zero, so no effect can change or tilt it; set --gravity')
    return np.asarray(gravity / length)


def _horizontal_axes(gravity: FloatArray) -> FloatArray:
    """Return two unit vectors normal to gravity, shape (2, 3): x and y if gravity is along -z."""
    down = _unit(gravity)
    upright, _ = Rotation.align_vectors([-down], [[0.0, 0.0, 1.0]])
    return np.asarray(upright.apply(np.eye(3)[:2]))
