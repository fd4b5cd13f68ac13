# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What an effect is: one physical cause of joint torque beside the rigid body.

An effect is written once and used three times. The simulator asks how it acts (``action``), the
identifier how the torques depend on its parameters (``columns``), the diagnosis whether that
dependence explains a residual. An effect of the joints has its quantities once per joint; an
effect of the whole arm has no joints and its quantities once.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, TYPE_CHECKING

from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel

#: A unit of a revolute joint and what it becomes on a prismatic one.
_PRISMATIC_UNITS = {
    'N m': 'N',
    'N m s/rad': 'N s/m',
    'kg m^2': 'kg',
}


@dataclass(frozen=True)
class Quantity:
    """
    One physical quantity that an effect has per joint, or once for the arm.

    Attributes
    ----------
    name : str
        Standard term, such as 'viscous_coefficient'.
    unit : str
        SI unit on a revolute joint.
    lower, upper : float
        What is physically possible.

    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class DryFriction:
    """
    Friction that can hold: a torque of any size between two levels while its velocity is zero.

    Attributes
    ----------
    directions : ndarray, shape (m, n)
        Velocity of each of m friction elements as a combination of the joint velocities.
    lower, upper : ndarray, shape (m,)
        Torque while the element moves backwards, and forwards [N m]; lower <= upper.

    """

    directions: FloatArray
    lower: FloatArray
    upper: FloatArray

    def torque(self, dq: FloatArray) -> FloatArray:
        """
        Return the joint torques for moving joints; the middle of the levels for one at rest.

        Parameters
        ----------
        dq : ndarray, shape (..., n)
            Joint velocities.

        """
        half, middle = (self.upper - self.lower) / 2, (self.upper + self.lower) / 2
        return np.asarray((half * np.sign(dq @ self.directions.T) + middle) @ self.directions)


@dataclass(frozen=True)
class Action:
    """
    How effects with given values act on the plant; what is not used stays None.

    The actuator has to supply damping @ dq + inertia @ ddq + dry friction + torque(t, q, dq) on
    top of the rigid body's torque.

    Attributes
    ----------
    damping : ndarray, shape (n, n), or None
        Viscous matrix [N m s/rad].
    inertia : ndarray, shape (n, n), or None
        Constant inertia seen by the joints only [kg m^2].
    dry_friction : DryFriction, or None
        Friction with a sticking phase.
    torque : callable (t, q, dq) -> ndarray (..., n), or None
        Anything else that depends smoothly on the state [N m].
    robot : Robot, or None
        The rigid body that takes the place of the nominal one.

    """

    damping: FloatArray | None = None
    inertia: FloatArray | None = None
    dry_friction: DryFriction | None = None
    torque: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None = None
    robot: Robot | None = None


@dataclass(frozen=True)
class Effect(ABC):
    """
    One kind of effect on some joints of an arm.

    Attributes
    ----------
    joints : tuple of str
        The joints it acts on; empty for an effect of the whole arm.

    """

    joints: tuple[str, ...] = field(default=())

    name: ClassVar[str]
    summary: ClassVar[str]
    quantities: ClassVar[tuple[Quantity, ...]]
    #: Whether the torque of a joint at rest is anything between two levels, and so says nothing.
    holds_at_rest: ClassVar[bool] = False

    @classmethod
    def on(cls, robot: Robot, joints: tuple[str, ...] | None = None) -> Effect:
        """
        Make the effect for a robot: on the joints named, or wherever it applies by default.

        Raises
        ------
        ModelError
            If the robot has no such joint.

        """
        chosen = cls._default_joints(robot) if joints is None else joints
        unknown = [name for name in chosen if name not in robot.joints]
        if unknown:
            raise ModelError(
                f"{cls.name}: {robot.name} has no joint '{unknown[0]}'; "
                f'its joints are {", ".join(robot.joints)}'
            )
        return cls(tuple(chosen))

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return robot.joints

    @property
    def owners(self) -> tuple[str, ...]:
        """Joints that have the quantities once each; one empty name for the whole arm."""
        return self.joints or ('',)

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Name the P parameters, owner by owner."""
        return tuple(
            ParameterName(q.name, owner, joint_unit(q.unit, owner, robot))
            for owner in self.owners
            for q in self.quantities
        )

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return what is physically possible: lower and upper bounds, each of shape (P,)."""
        lower = np.array([q.lower for q in self.quantities] * len(self.owners))
        upper = np.array([q.upper for q in self.quantities] * len(self.owners))
        return lower, upper

    @abstractmethod
    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """
        Differentiate the joint torques by the parameters, at the arm as it is.

        Returns
        -------
        ndarray, shape (N, n, P)
            dtau/dtheta, exact for an effect that is linear in its parameters.

        """

    @abstractmethod
    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """
        Say how the effect acts on the plant with given parameter values.

        Parameters
        ----------
        values : ndarray, shape (P,)
            Parameter values.
        arm : ArmModel
            The arm it acts on, with the effects before it applied.

        """

    def indices(self, motion_joints: tuple[str, ...]) -> list[int]:
        """Return the columns of the effect's joints among the joints of a motion or robot."""
        return [motion_joints.index(joint) for joint in self.joints]


def joint_unit(unit: str, joint: str, robot: Robot) -> str:
    """Return a unit as it is on the joint: 'N m' is 'N' on a prismatic one."""
    if joint and robot.prismatic[robot.joints.index(joint)]:
        return _PRISMATIC_UNITS.get(unit, unit)
    return unit


def joint_columns(effect: Effect, motion: Motion, *quantities: FloatArray) -> FloatArray:
    """
    Place the sensitivities of an effect that acts on each of its joints alone.

    Parameters
    ----------
    effect : Effect
        Gives the joints.
    motion : Motion
        Gives the joint order.
    *quantities : ndarray, shape (N, n)
        One array per quantity of the effect: dtau_j / dtheta_j for all joints of the motion.

    Returns
    -------
    ndarray, shape (N, n, P)
        Zero where a parameter belongs to another joint.

    """
    count = len(quantities)
    columns = np.zeros((len(motion), motion.n_joints, count * len(effect.joints)))
    for position, joint in enumerate(effect.indices(motion.joints)):
        for offset, values in enumerate(quantities):
            columns[:, joint, count * position + offset] = values[:, joint]
    return columns


def scatter(effect: Effect, values: FloatArray, robot: Robot) -> FloatArray:
    """
    Spread the values of a joint effect over all joints of the robot, zero elsewhere.

    Returns
    -------
    ndarray, shape (number of quantities, n)

    """
    spread = np.zeros((len(effect.quantities), robot.n_joints))
    spread[:, effect.indices(robot.joints)] = values.reshape(len(effect.joints), -1).T
    return spread
