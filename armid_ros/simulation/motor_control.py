# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Drives of an arm with elastic joints: velocity loops, with or without model feedforward."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.simulation.controller import BANDWIDTH, Controller, Desired, Targets
from armid_ros.simulation.plant import Plant
import numpy as np
import pinocchio as pin

#: Largest share of a motor's velocity that one sample of its loop may remove.
_QUICKEST = 0.3


@dataclass(frozen=True, eq=False)
class VelocityLoop:
    """
    Proportional-integral control of the motor velocities, sampled at every step of the plant.

    tau_k = kp e_k + ki s_k, with e_k = reference - velocity and s_k = s_k-1 + dt e_k.

    Attributes
    ----------
    proportional : ndarray, shape (n,)
        kp [N m s/rad], at the joints.
    integral : ndarray, shape (n,)
        ki [N m/rad].

    """

    proportional: FloatArray
    integral: FloatArray

    def __post_init__(self) -> None:
        """Freeze the gains."""
        object.__setattr__(self, 'proportional', read_only(self.proportional))
        object.__setattr__(self, 'integral', read_only(self.integral))

    def torque(self, error: FloatArray, integral: FloatArray) -> FloatArray:
        """Return the torque for errors of velocity [rad/s] and their integral [rad], (n,)."""
        return np.asarray(self.proportional * error + self.integral * integral)


@dataclass(eq=False)
class MotorControl(Controller):
    """
    A controller with a velocity loop on every motor; the integrals of the errors are its state.

    Attributes
    ----------
    loop : VelocityLoop
        The loops; the integral of the velocity error is the position error.
    dt : float
        Time between two actions of the loops, a step of the plant [s].
    guide : Plant, or None
        Model of the arm for the feedforward. Its torque along the reference is added to the torque
        of the loops, and the twist of its springs is added to the motor positions. None: no
        feedforward.
    integral : ndarray, shape (n,)
        Integral of the velocity error [rad].

    """

    loop: VelocityLoop
    dt: float
    guide: Plant | None = None
    integral: FloatArray = field(init=False, repr=False)
    acts_once: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Set the integrals to zero."""
        self.integral = np.zeros(len(self.loop.proportional))

    @classmethod
    def of(cls, plant: Plant) -> MotorControl:
        """
        Return loops designed for an arm with elastic joints, with that arm as the model.

        The velocity gain is the smallest of three values: the gain of a rigid joint for 8 Hz, the
        gain sqrt(K M) that damps the link on its spring best, and the largest stable gain of a
        sampled loop on a rotor. The position gain makes the joint critically damped.

        """
        robot, springs = plant.robot, plant.springs
        if springs is None:
            raise ModelError(f'{robot.name}: its joints are rigid; use ComputedTorque')
        joints, e = springs.joints, len(springs.joints)
        link = np.diag(pin.crba(robot.model, robot.model.createData(), robot.middle_pose))
        rotor = np.array(np.diag(springs.rotors)[e:])
        rotor[joints] = np.diag(springs.rotors)[:e]
        inertia = link + rotor
        gain = 2.0 * BANDWIDTH * inertia
        gain[joints] = np.minimum.reduce(
            [
                gain[joints],
                np.sqrt(springs.transmission.stiffness * link[joints]),
                _QUICKEST * rotor[joints] / plant.dt,
            ]
        )
        return cls(VelocityLoop(gain, gain**2 / (4.0 * inertia)), plant.dt, plant)

    def started(self) -> MotorControl:
        """Return the same loops with zero integrals."""
        return replace(self)

    def targets(self, desired: Motion, asked: FloatArray | None = None) -> Targets:
        """
        Return the targets of the motors for a motion of the links.

        The torque of the reference, if any, is added to the torque of the loops.

        """
        tau = np.zeros_like(desired.q) if desired.tau is None else np.array(desired.tau)
        q = desired.q
        if self.guide is not None and self.guide.springs is not None:
            load = inverse_dynamics(self.guide.robot, desired)
            q = self.guide.springs.at_motors(q, self.guide.springs.twist(load))
            tau += load + self.guide.action.effort(desired, desired, load)
        before = np.concatenate([q[:1] - self.dt * desired.dq[:1], q[:-1]])
        if asked is not None:
            before[1:2] = asked
        return Targets(q, (q - before) / self.dt, np.zeros_like(q), tau)

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Update the integrals and return the torque, shape (n,)."""
        error = desired[1] - dq
        self.integral = self.integral + self.dt * error
        return self.loop.torque(error, self.integral) + feedforward
