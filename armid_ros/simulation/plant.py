# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plant: an arm model prepared for integration, its state, and checks of its masses."""

from __future__ import annotations

import math
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.effects import Action, DryFriction, TorqueLaw
from armid_ros.effects.action import sum_laws
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.model.pseudo_inertia import Consistency, pseudo_inertia
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import NO_MASS, Robot
from armid_ros.robots.reference import limit_slack
from armid_ros.robots.robot import PER_LINK
from armid_ros.simulation.contacts import Contacts, Modes, split_constant
from armid_ros.simulation.springs import Elasticity, ElasticJoints
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.linalg import eigh, LinAlgError


def require_masses(robot: Robot) -> None:
    """Raise a ModelError if a robot has links of negative mass; the message names the links."""
    masses = robot.rigid_parameters[::PER_LINK]
    negative = [
        f"'{name}' ({mass:g} kg)"
        for name, mass in zip(robot.links, masses, strict=True)
        if mass < 0.0
    ]
    if negative:
        links = ', '.join(negative)
        raise ModelError(f'{robot.name}: negative mass of links {links}; correct the description')


def possible_loads(robot: Robot, values: FloatArray) -> bool:
    """
    Return whether all loads are physically possible bodies within the reach of the arm.

    Parameters
    ----------
    robot : Robot
        The arm; its reach is the sum of the distances between its joints, at least 1 m.
    values : ndarray, shape (10 m,)
        Ten parameters of each load, about the joint that carries it.

    """
    places = [placement.translation for placement in robot.model.jointPlacements]
    reach = max(1.0, float(np.sum(np.linalg.norm(places, axis=1))))
    for body in np.reshape(values, (-1, PER_LINK)):
        found = Consistency.of('', body)
        possible = found.eigenvalues[0] >= -1e-9 * found.eigenvalues[-1]
        if not possible or np.linalg.norm(found.center) > reach:
            return False
    return True


def require_any_mass(robot: Robot) -> None:
    """
    Raise a ModelError if no link of a robot has mass; all joint torques would be zero.

    Raises
    ------
    ModelError
        If no link has a mass; the message names the description and its links.

    """
    if np.all(np.abs(robot.rigid_parameters[::PER_LINK]) < NO_MASS):
        raise ModelError(
            f'{robot.path or robot.name}: no link has a mass ({", ".join(robot.links)}), so there '
            'is no model to compare with. Give the links an <inertial>, or identify the arm first '
            '(armid identify) and give its model.yaml with --model'
        )


def inertia_error(robot: Robot) -> ModelError:
    """Return the error to raise for an inertia matrix that is not positive definite."""
    odd = [
        f"'{name}' ({values[0]:g} kg)"
        for name, values in zip(
            robot.links, robot.rigid_parameters.reshape(-1, PER_LINK), strict=True
        )
        if np.any(values) and np.linalg.eigvalsh(pseudo_inertia(values))[0] < 0.0
    ]
    links = f'links {", ".join(odd)} are not possible bodies; ' if odd else ''
    return ModelError(
        f'{links}the inertia matrix is not positive definite: identify with --physical, or '
        'correct the description'
    )


class Rotors(NamedTuple):
    """
    Motion of the e motors of elastic joints, converted to the joint side of the gears.

    Attributes
    ----------
    twist : ndarray, shape (e,)
        Position of the motors minus position of their links [rad or m].
    dq, ddq : ndarray, shape (e,)
        Velocity and acceleration of the motors.

    """

    twist: FloatArray
    dq: FloatArray
    ddq: FloatArray


class State(NamedTuple):
    """
    State of a plant at the beginning of a step: motion, friction modes and springs.

    Attributes
    ----------
    steps : int
        Time as a number of steps of the plant.
    t : float
        Time [s], steps times the step.
    q, dq : ndarray, shape (n,)
        Position [rad or m] and velocity of the links.
    ddq : ndarray, shape (n,)
        Mean acceleration over the last step; with springs, the present acceleration.
    modes : tuple of int, length m
        Mode of each dry friction element: 1 slipped forwards, -1 slipped backwards, 0 stuck.
    memory : ndarray, shape (h,)
        States of the friction with hysteresis.
    rotors : Rotors, or None
        The motors with independent motion; None if all joints are rigid.

    """

    steps: int
    t: float
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    modes: Modes
    memory: FloatArray
    rotors: Rotors | None = None


class Plant:
    """
    Arm model, prepared for the simulation of its motion.

    The motor and the link of a rigid joint have the same velocity. If elasticity is given, motor
    and link of joints with joint_elasticity and rotor_inertia have different velocities. Otherwise
    they have the same velocity, and the springs only change the position readings.

    Parameters
    ----------
    arm : ArmModel
        Rigid body and effects.
    dt : float
        Step [s].
    hard_stops : bool
        Whether the joints stop at the position limits of the robot. Rigid joints stop without
        bouncing. The stop of a link on a spring is a damped spring, which yields by some
        milliradians. Its frequency is 32 Hz with the inertia in the middle of the ranges and the
        default step.
    elasticity : Elasticity, optional
        How elastic joints are simulated; by default all joints are rigid.

    Raises
    ------
    ModelError
        If the step is not positive, or the arm cannot move as a body.

    Attributes
    ----------
    robot : Robot
        The rigid body with the changes of the effects, such as a payload.
    contacts : Contacts
        Friction elements that can stick, m of them.
    damping : ndarray, shape (n, n)
        Viscous matrix [N m s/rad].
    added_inertia : ndarray, shape (n, n)
        Inertia added to that of the rigid body: rotors, and the implicit part of the damping
        [kg m^2].
    constant : ndarray, shape (n,), or None
        Constant torque that the actuators have to supply [N m].
    torque : callable (t, q, dq) -> ndarray (n,), or None
        Any other torque that the actuators have to supply, on the motor side of springs.
    action : Action
        Actions of the effects on the arm and on its sensors.
    springs : ElasticJoints, or None
        Springs between motors and links; None if all joints are rigid.
    sensing : Action
        Action of the effects on the readings of the motors.
    data : pinocchio.Data
        Scratch memory of the rigid-body algorithms; two threads therefore need two plants.

    """

    def __init__(
        self,
        arm: ArmModel,
        dt: float = 1e-3,
        hard_stops: bool = True,
        elasticity: Elasticity | None = None,
    ) -> None:
        if not (math.isfinite(dt) and dt > 0.0):
            raise ModelError(f'the simulation step has to be a positive time, not {dt} s')
        self.arm, self.dt, self.hard_stops = arm, dt, hard_stops
        self.action: Action = arm.action()
        self.robot: Robot = self.action.robot or arm.robot
        robot, n = self.robot, self.robot.n_joints
        zero = np.zeros((n, n))
        self.damping: FloatArray = zero if self.action.damping is None else self.action.damping
        inertia = zero if self.action.inertia is None else self.action.inertia
        friction, constant = split_constant(self.action.dry_friction, n)
        self.contacts = Contacts.of(friction)
        self.constant: FloatArray | None = constant if constant.any() else None
        self.data = robot.model.createData()
        mass = np.array(robot.inertia(self.data, robot.middle_pose))
        moved = np.abs(np.diag(mass + inertia))
        still = int(np.argmin(moved))
        if moved[still] < 1e-15:
            joint = robot.joints[still]
            link = robot.description.by_name[joint].child
            raise ModelError(
                f"{robot.name}: joint '{joint}' moves no mass and no inertia, so "
                f"its acceleration is infinite; give link '{link}' an <inertial>"
            )
        weight = _damping_weight(robot, mass + inertia, self.damping, dt)
        self.added_inertia: FloatArray = inertia + weight * dt * self.damping
        laws = [self.action.torque]
        self.springs: ElasticJoints | None = None
        self.sensing: Action = self.action
        if elasticity is None:
            laws.append(self.action.link_torque)
        else:
            self.springs = ElasticJoints.of(arm, elasticity, friction.directions, mass, dt)
            self.sensing = self.springs.sensing
        self.torque: TorqueLaw | None = sum_laws([law for law in laws if law is not None])

    def state(
        self,
        q: npt.ArrayLike,
        dq: npt.ArrayLike | None = None,
        ddq: npt.ArrayLike | None = None,
        steps: int = 0,
    ) -> State:
        """
        Return the plant state for given positions and velocities, by default at rest.

        The weight of the links twists the springs, and motors have the velocity of their links.

        Raises
        ------
        TrajectoryError
            If a joint is beyond its stop; the message names the joint.

        """
        n = self.robot.n_joints
        position, velocity, acceleration = (
            read_only(np.broadcast_to(0.0 if x is None else np.asarray(x, dtype=float), (n,)))
            for x in (q, dq, ddq)
        )
        if self.hard_stops:
            lower, upper, slack = self.robot.lower, self.robot.upper, limit_slack(self.robot)
            beyond = (position < lower - slack) | (position > upper + slack)
            for joint in np.flatnonzero(beyond)[:1]:
                unit = self.robot.position_units[joint]
                raise TrajectoryError(
                    f"{self.robot.name}: joint '{self.robot.joints[joint]}' cannot be at "
                    f'{position[joint]:.4g} {unit}, beyond its stops at {lower[joint]:.4g} and '
                    f'{upper[joint]:.4g} {unit}'
                )
            position = read_only(np.clip(position, lower, upper))
        modes = tuple(np.sign(self.contacts.directions @ velocity).astype(int).tolist())
        slipping = self.action.hysteresis
        memory = np.empty(0) if slipping is None else slipping.start(velocity)
        rotors = None
        if self.springs is not None:
            still = np.zeros(n)
            load = self.robot.inverse_dynamics(self.data, position, still, still)
            joints = self.springs.joints
            rotors = Rotors(self.springs.twist(load), velocity[joints], acceleration[joints])
        t = steps * self.dt
        return State(steps, t, position, velocity, acceleration, modes, memory, rotors)

    def weight(self, q: FloatArray, dq: FloatArray) -> FloatArray:
        """Return the joint torques due to gravity, Coriolis and centrifugal forces, (n,) [N m]."""
        if self.robot.mechanism is None:
            return np.asarray(pin.nonLinearEffects(self.robot.model, self.data, q, dq))
        return self.robot.inverse_dynamics(self.data, q, dq, np.zeros(len(q)))

    def motors(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions, velocities and accelerations of the motors, each of shape (n,)."""
        _, _, q, dq, ddq, _, _, rotors = state
        if rotors is None or self.springs is None:
            return q, dq, ddq
        to_motors = self.springs.to_motors
        dq = to_motors.dot(np.concatenate([rotors.dq, state.dq]))
        ddq = to_motors.dot(np.concatenate([rotors.ddq, state.ddq]))
        return self.springs.at_motors(state.q, rotors.twist), dq, ddq

    def subtract_smooth_effects(
        self, force: FloatArray, t: float, q: FloatArray, dq: FloatArray, memory: FloatArray
    ) -> None:
        """Subtract the torques of smooth effects from motor torques `force` (n,), in place."""
        if self.constant is not None:
            force -= self.constant
        if self.torque is not None:
            force -= self.torque(np.asarray(t), q, dq)
        if self.action.hysteresis is not None:
            force -= self.action.hysteresis.torque(memory)

    def times(self, first: int, count: int) -> FloatArray:
        """Return the times of successive steps of the plant [s], shape (count,)."""
        return np.asarray(self.dt * np.arange(first, first + count), dtype=np.float64)

    def contacts_at(
        self, at_lower: npt.NDArray[np.bool_], at_upper: npt.NDArray[np.bool_]
    ) -> Contacts:
        """
        Return the contacts: dry friction elements, followed by the joint stops that are active.

        A stop holds any torque in one direction: w <= 0, f >= 0, w f = 0 at the upper limit.

        """
        friction, hit = self.contacts, np.flatnonzero(at_lower | at_upper)
        loaded, none = friction.friction, np.zeros(len(hit))
        share = None if loaded is None else loaded.load_share
        return Contacts.of(
            DryFriction(
                np.vstack([friction.directions, np.eye(self.robot.n_joints)[hit]]),
                np.append(friction.lower, np.where(at_lower[hit], -np.inf, 0.0)),
                np.append(friction.upper, np.where(at_upper[hit], np.inf, 0.0)),
                None if share is None else np.append(share, none),
            )
        )


def _damping_weight(robot: Robot, inertia: FloatArray, damping: FloatArray, dt: float) -> float:
    """Return the weight, 0.5 to 1, of the end velocity in the implicit damping of a step."""
    # 1/2 (second order) for weak damping, 1 (no overshoot) for stiff damping. In between, the
    # value for which the fastest decay rate of the arm is exact (Liniger and Willoughby 1970)
    try:
        rates = eigh((damping + damping.T) / 2, inertia, eigvals_only=True)
    except LinAlgError:
        raise inertia_error(robot) from None
    z = dt * float(rates[-1])
    if z < 1e-3:
        return 0.5
    return 1.0 / -math.expm1(-z) - 1.0 / z
