# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What makes an arm follow a reference: computed torque, or PD with gravity compensation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
from armid_ros.simulation.plant import middle_position
import numpy as np
import numpy.typing as npt
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

    tau = ID(q, dq, ddq_d + 2 zeta omega (dq_d - dq) + omega^2 (q_d - q)) + friction at dq_d.
    Source: Siciliano et al. 2009, section 8.5.2.

    Attributes
    ----------
    arm : ArmModel
        What the controller believes of the arm. Its friction is compensated at the reference
        velocity.
    bandwidth : float or ndarray, shape (n,)
        Natural frequency omega of every joint [rad/s].
    damping_ratio : float or ndarray, shape (n,)
        Damping ratio zeta.

    """

    arm: ArmModel
    bandwidth: float | FloatArray = BANDWIDTH
    damping_ratio: float | FloatArray = 1.0
    _robot: Robot = field(init=False, repr=False)
    _data: pin.Data = field(init=False, repr=False)
    _gains: tuple[FloatArray, FloatArray] = field(init=False, repr=False)
    _inertia: FloatArray | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the gains and collect what the effects of the nominal arm do."""
        action = self.arm.action()
        robot = action.robot or self.arm.robot
        omega = _per_joint(self.bandwidth, robot, 'bandwidth')
        zeta = _per_joint(self.damping_ratio, robot, 'damping ratio')
        object.__setattr__(self, '_robot', robot)
        object.__setattr__(self, '_data', robot.model.createData())
        object.__setattr__(self, '_gains', (omega**2, 2.0 * zeta * omega))
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
        stiffness, damping = self._gains
        ddq = stiffness * (q_desired - q)
        ddq += damping * (dq_desired - dq)
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

    Attributes
    ----------
    arm : ArmModel
        What the controller believes of the arm; only its gravity torque is used.
    stiffness : float or ndarray, shape (n,), or None
        kp [N m/rad or N/m]; None for a natural frequency of 50 rad/s of the joint on its own, in
        the middle of the range of motion.
    damping : float or ndarray, shape (n,), or None
        kd [N m s/rad or N s/m]; None for critical damping of that joint.

    """

    arm: ArmModel
    stiffness: float | FloatArray | None = None
    damping: float | FloatArray | None = None
    _robot: Robot = field(init=False, repr=False)
    _data: pin.Data = field(init=False, repr=False)
    _gains: tuple[FloatArray, FloatArray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the gains, or choose them."""
        action = self.arm.action()
        robot = action.robot or self.arm.robot
        data = robot.model.createData()
        inertia = np.diag(pin.crba(robot.model, data, middle_position(robot))).copy()
        if action.inertia is not None:
            inertia += np.diag(action.inertia)
        stiffness = inertia * BANDWIDTH**2
        if self.stiffness is not None:
            stiffness = _per_joint(self.stiffness, robot, 'stiffness')
        damping = 2.0 * np.sqrt(inertia * stiffness)
        if self.damping is not None:
            damping = _per_joint(self.damping, robot, 'damping')
        object.__setattr__(self, '_robot', robot)
        object.__setattr__(self, '_data', data)
        object.__setattr__(self, '_gains', (stiffness, damping))

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Return spring, damper and gravity, shape (n,)."""
        stiffness, damping = self._gains
        tau = pin.computeGeneralizedGravity(self._robot.model, self._data, q)
        tau += stiffness * (desired[0] - q)
        tau += damping * (desired[1] - dq)
        return np.asarray(tau)


def _per_joint(value: npt.ArrayLike, robot: Robot, what: str) -> FloatArray:
    array = np.asarray(value, dtype=float)
    n = robot.n_joints
    if array.shape not in ((), (n,)) or not np.all(np.isfinite(array)) or np.any(array < 0.0):
        raise ModelError(
            f'{robot.name}: {what} has to be one number, or one for each of {n} joints, finite '
            f'and not negative; got {array.tolist()}'
        )
    return read_only(np.broadcast_to(array, (n,)))
