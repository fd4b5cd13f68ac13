# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What makes an arm follow a reference: computed torque, or PD with gravity compensation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

from armid_ros.arm import ArmModel
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

#: Natural frequency of the closed loop [rad/s]: 8 Hz, stiff for an arm, and slow enough for 1 kHz
#: control of a joint that is half as heavy as its model.
BANDWIDTH = 50.0


#: Position, velocity and acceleration to have; and with the torque of the feedforward; each (n,).
Desired = tuple[FloatArray, FloatArray, FloatArray]
Target = tuple[Desired, FloatArray]


@dataclass(frozen=True, eq=False)
class Targets:
    """
    What a controller is to do at N successive steps.

    Attributes
    ----------
    q, dq, ddq : ndarray, shape (N, n)
        Where the motors are to be [rad or m, s].
    feedforward : ndarray, shape (N, n)
        Torque that the controller derives from the reference alone [N m].

    """

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    feedforward: FloatArray

    def __iter__(self) -> Iterator[Target]:
        """Yield what to do at one step after the other."""
        return zip(zip(self.q, self.dq, self.ddq, strict=True), self.feedforward, strict=True)

    def __getitem__(self, rows: slice) -> Targets:
        """Return some of the steps."""
        return Targets(self.q[rows], self.dq[rows], self.ddq[rows], self.feedforward[rows])

    def __len__(self) -> int:
        """Return the number of steps N."""
        return len(self.q)


class Controller(ABC):
    """
    A law from where the arm is, and where it should be, to the torque it is given.

    It sees the true position and velocity: sensors distort what is recorded, not what moves the
    arm; where joints give way, those of the motors. Torque limits are the drives', applied to what
    it asks for.

    Attributes
    ----------
    acts_once : bool
        Whether it keeps something from step to step, so that it may act once a step only.

    """

    acts_once: ClassVar[bool] = False

    def started(self) -> Controller:
        """Return one that has kept nothing yet: this one, where it never does."""
        return self

    def targets(self, desired: Motion, asked: FloatArray | None = None) -> Targets:
        """
        Return what to do to follow a reference that has one row per step.

        A controller that has acted for the first of them already is told what it asked for then,
        positions of shape (n,).

        """
        return Targets(desired.q, desired.dq, desired.ddq, self.feedforward(desired))

    def feedforward(self, desired: Motion) -> FloatArray:
        """Return torques that depend on the reference only, shape (N, n) [N m]."""
        return np.zeros_like(desired.q)

    @abstractmethod
    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """
        Return the torque to apply now.

        Parameters
        ----------
        q, dq : ndarray, shape (n,)
            Position and velocity of the arm.
        desired : tuple of ndarray, each of shape (n,)
            Position, velocity and acceleration of the reference.
        feedforward : ndarray, shape (n,)
            Row of `feedforward` that belongs to now.

        """


@dataclass(frozen=True, eq=False)
class ComputedTorque(Controller):
    """
    Inverse dynamics of a nominal arm, with feedback on the acceleration.

    tau = ID(q, dq, ddq_d + 2 omega (dq_d - dq) + omega^2 (q_d - q)) + friction at dq_d.
    Source: Siciliano et al. 2009, section 8.5.2.

    Attributes
    ----------
    arm : ArmModel
        What the controller believes of the arm. Its friction is compensated at the reference
        velocity.
    bandwidth : float
        Natural frequency omega of every joint [rad/s], critically damped.

    """

    arm: ArmModel
    bandwidth: float = BANDWIDTH
    _robot: Robot = field(init=False, repr=False)
    _data: pin.Data = field(init=False, repr=False)
    _inertia: FloatArray | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Collect what the effects of the nominal arm do."""
        action = self.arm.action()
        robot = action.robot or self.arm.robot
        object.__setattr__(self, '_robot', robot)
        object.__setattr__(self, '_data', robot.model.createData())
        object.__setattr__(self, '_inertia', action.inertia)

    def feedforward(self, desired: Motion) -> FloatArray:
        """Return damping, dry friction and other torques at the reference, shape (N, n)."""
        action = self.arm.action()
        depends = action.dry_friction is not None and action.dry_friction.load_share is not None
        load = self.arm.load(desired) if depends else np.zeros_like(desired.q)
        effort = action.effort(desired, desired, load)
        return effort if self._inertia is None else effort - desired.ddq @ self._inertia.T

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Return the computed torque, shape (n,)."""
        q_desired, dq_desired, ddq_desired = desired
        ddq = self.bandwidth**2 * (q_desired - q)
        ddq += 2.0 * self.bandwidth * (dq_desired - dq)
        ddq += ddq_desired
        tau: FloatArray = pin.rnea(self._robot.model, self._data, q, dq, ddq)
        if self._inertia is not None:
            tau += self._inertia.dot(ddq)
        tau += feedforward
        return tau


@dataclass(frozen=True, eq=False)
class GravityPD(Controller):
    """
    A spring and a damper on every joint, and the torque that holds the nominal arm.

    tau = kp (q_d - q) + kd (dq_d - dq) + g(q). Source: Siciliano et al. 2009, section 8.5.1.
    Each joint on its own, in the middle of the range of motion, is critically damped at 50 rad/s.

    Attributes
    ----------
    arm : ArmModel
        What the controller believes of the arm; only its gravity torque is used.
    stiffness, damping : ndarray, shape (n,)
        kp [N m/rad or N/m] and kd [N m s/rad or N s/m].

    """

    arm: ArmModel
    stiffness: FloatArray = field(init=False)
    damping: FloatArray = field(init=False)
    _robot: Robot = field(init=False, repr=False)
    _data: pin.Data = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Choose the gains."""
        action = self.arm.action()
        robot = action.robot or self.arm.robot
        data = robot.model.createData()
        inertia = np.diag(pin.crba(robot.model, data, robot.middle_pose)).copy()
        if action.inertia is not None:
            inertia += np.diag(action.inertia)
        stiffness = inertia * BANDWIDTH**2
        object.__setattr__(self, '_robot', robot)
        object.__setattr__(self, '_data', data)
        object.__setattr__(self, 'stiffness', read_only(stiffness))
        object.__setattr__(self, 'damping', read_only(2.0 * np.sqrt(inertia * stiffness)))

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Return spring, damper and gravity, shape (n,)."""
        tau = pin.computeGeneralizedGravity(self._robot.model, self._data, q)
        tau += self.stiffness * (desired[0] - q)
        tau += self.damping * (desired[1] - dq)
        return np.asarray(tau)
