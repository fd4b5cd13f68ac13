# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Controllers: linear feedback on a rigid body, computed torque, velocity loops of motors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, freeze, Motion
from armid_ros.robots import Robot
from armid_ros.simulation.plant import Plant
import numpy as np
import pinocchio as pin

#: Natural frequency of the closed loop [rad/s]. 8 Hz is stiff for an arm, and slow enough for 1
#: kHz control of a joint with half the inertia of its model.
BANDWIDTH = 50.0


#: Desired position, velocity and acceleration, each of shape (n,).
Desired = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class LinearFeedback:
    """
    Feedback control law: inverse dynamics, plus a spring and a damper on every joint.

    tau = ID(q, s dq, w^2 e + 2 w de + s ddq_d) + kp e + kd de + feedforward, e = q_d - q.

    Attributes
    ----------
    robot : Robot
        The rigid body of the inverse dynamics ID.
    added_inertia : ndarray, shape (n, n)
        Inertia added to the inertia matrix of the robot [kg m^2].
    bandwidth : float
        w, the bandwidth of the feedback on the acceleration [rad/s].
    follows : bool
        Whether ID contains velocity and reference acceleration: s is 1 if so, otherwise 0.
    weighs : bool
        Whether ID contains gravity.
    stiffness, damping : float or ndarray, shape (n,)
        kp [N m/rad or N/m] and kd [N m s/rad or N s/m].

    """

    robot: Robot
    added_inertia: FloatArray
    bandwidth: float = 0.0
    follows: bool = False
    weighs: bool = True
    stiffness: FloatArray | float = 0.0
    damping: FloatArray | float = 0.0
    _body: Robot = field(init=False, repr=False)
    _data: pin.Data = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Set the rigid body for the inverse dynamics, and allocate memory for it."""
        body = self.robot if self.weighs else self.robot.with_gravity(np.zeros(3))
        object.__setattr__(self, '_body', body)
        object.__setattr__(self, '_data', body.model.createData())

    @classmethod
    def of(cls, arm: ArmModel, **terms: Any) -> LinearFeedback:
        """Return a feedback law for an arm's rigid body, including inertia added by effects."""
        action = arm.action()
        robot = action.robot or arm.robot
        none = np.zeros((robot.n_joints, robot.n_joints))
        return cls(robot, none if action.inertia is None else action.inertia, **terms)

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Return the sum of feedback and feedforward torque, (n,) [N m]; see `Controller`."""
        behind, slower = desired[0] - q, desired[1] - dq
        ddq = self.bandwidth**2 * behind
        ddq += 2.0 * self.bandwidth * slower
        if self.follows:
            ddq += desired[2]
        tau = self._body.inverse_dynamics(self._data, q, self.follows * dq, ddq)
        tau += self.added_inertia.dot(ddq)
        tau += self.stiffness * behind
        tau += self.damping * slower
        tau += feedforward
        return tau


class Controller:
    """
    Control law: torque as a function of the measured and the desired motion.

    It uses the true position and velocity, of the motors if joints are elastic. Sensors
    distort the recording only. The drives apply their torque limits to the commanded torque.

    Attributes
    ----------
    acts_once : bool
        Whether the controller has a state, so that it may act only once per step.
    feedback : LinearFeedback, or None
        The control law as a `LinearFeedback`; None if it has another form.

    """

    acts_once: ClassVar[bool] = False
    feedback: LinearFeedback | None = None

    def __init__(self, feedback: LinearFeedback | None = None) -> None:
        """Set the linear feedback law; a subclass with another law overrides `torque`."""
        self.feedback = feedback

    def in_initial_state(self) -> Controller:
        """Return a controller in the initial state; the same object if it is stateless."""
        return self

    def targets(self, desired: Motion, previous: FloatArray | None = None) -> Motion:
        """
        Return the desired motion of the motors, with the feedforward torque.

        The reference has one row per step. `previous` is the previously commanded position, shape
        (n,), if any, for the first row.

        """
        return desired.with_torque(self.feedforward(desired))

    def feedforward(self, desired: Motion) -> FloatArray:
        """Return the torques that depend on the desired motion only, shape (N, n) [N m]."""
        return np.zeros_like(desired.q)

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """
        Return the joint torque to apply in the present step, shape (n,) [N m].

        Parameters
        ----------
        q, dq : ndarray, shape (n,)
            Position and velocity of the arm.
        desired : tuple of ndarray, each of shape (n,)
            Position, velocity and acceleration of the reference.
        feedforward : ndarray, shape (n,)
            Row of `feedforward` for the present step.

        """
        assert self.feedback is not None, f'{type(self).__name__} has no feedback and no torque'
        return self.feedback.torque(q, dq, desired, feedforward)


class ComputedTorque(Controller):
    """
    Inverse dynamics of a nominal arm, with feedback that acts on the acceleration.

    tau = ID(q, dq, ddq_d + 2 omega (dq_d - dq) + omega^2 (q_d - q)) + friction at dq_d.
    Source: Siciliano et al. 2009, section 8.5.2.

    Parameters
    ----------
    arm : ArmModel
        The controller's model of the arm. Its friction is compensated at the reference velocity.
    bandwidth : float
        Natural frequency omega of every joint [rad/s], critically damped.

    """

    feedback: LinearFeedback

    def __init__(self, arm: ArmModel, bandwidth: float = BANDWIDTH) -> None:
        self.arm = arm
        self.feedback = LinearFeedback.of(arm, bandwidth=bandwidth, follows=True)

    def feedforward(self, desired: Motion) -> FloatArray:
        """Return the torques of friction and other effects along the reference, shape (N, n)."""
        action = self.arm.action()
        depends = action.dry_friction is not None and action.dry_friction.load_share is not None
        load = self.arm.load(desired) if depends else np.zeros_like(desired.q)
        effort = action.effort(desired, desired, load)
        return np.asarray(effort - desired.ddq @ self.feedback.added_inertia.T)


@dataclass(frozen=True, eq=False)
class VelocityLoop:
    """
    Gains of proportional-integral controllers of motor velocities, updated at every step.

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
        """Freeze the gains of the velocity loop."""
        freeze(self, 'proportional', 'integral')


@dataclass(eq=False)
class MotorControl(Controller):
    """
    Controller with a proportional-integral velocity loop on every motor.

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
        """Set the integrals of the velocity errors to zero."""
        self.integral = np.zeros(len(self.loop.proportional))

    @classmethod
    def of(cls, plant: Plant) -> MotorControl:
        """
        Return a controller with velocity loops that are designed for an arm with elastic joints.

        The feedforward uses the same arm. The velocity gain is the smallest of three gains: that
        of a rigid joint for 8 Hz; sqrt(K M), with the best damping of the link on its spring; and
        the largest stable one of a sampled loop on a rotor. The position gain makes the joint
        critically damped.

        """
        robot, springs = plant.robot, plant.springs
        if springs is None:
            raise ModelError(f'{robot.name} has only rigid joints; use ComputedTorque')
        joints, e = springs.joints, len(springs.joints)
        link = np.diag(robot.inertia(robot.model.createData(), robot.middle_pose))
        rotor = np.array(np.diag(springs.rotors)[e:])
        rotor[joints] = np.diag(springs.rotors)[:e]
        inertia = link + rotor
        gain = 2.0 * BANDWIDTH * inertia
        # largest share of a motor's velocity that one sample of its loop may remove
        gain[joints] = np.minimum.reduce(
            [
                gain[joints],
                np.sqrt(springs.transmission.stiffness * link[joints]),
                0.3 * rotor[joints] / plant.dt,
            ]
        )
        return cls(VelocityLoop(gain, gain**2 / (4.0 * inertia)), plant.dt, plant)

    def in_initial_state(self) -> MotorControl:
        """Return a controller with the same velocity loops and zero integrals."""
        return replace(self)

    def targets(self, desired: Motion, previous: FloatArray | None = None) -> Motion:
        """
        Return the desired motion of the motors for a desired motion of the links.

        The torque of the reference, if any, is added to the torque of the loops.

        """
        tau = np.zeros_like(desired.q) if desired.tau is None else np.array(desired.tau)
        q = desired.q
        if self.guide is not None and self.guide.springs is not None:
            load = inverse_dynamics(self.guide.robot, desired)
            q = self.guide.springs.at_motors(q, self.guide.springs.twist(load))
            tau += load + self.guide.action.effort(desired, desired, load)
        before = np.concatenate([q[:1] - self.dt * desired.dq[:1], q[:-1]])
        if previous is not None:
            before[1:2] = previous
        dq = (q - before) / self.dt
        return Motion(desired.joints, desired.t, q, dq, np.zeros_like(q), tau)

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Return the torque of the velocity loops, shape (n,), and update their integrals."""
        error = desired[1] - dq
        self.integral = self.integral + self.dt * error
        torque = self.loop.proportional * error + self.loop.integral * self.integral
        return torque + feedforward
