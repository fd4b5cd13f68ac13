# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An arm whose motors drive its links through springs.

Where a transmission gives way, motor and link have velocities of their own. Motors carry rotor
inertia, drive torque and all friction of the arm's effects; links carry the rigid body and what is
attached to it. Rotors are taken to turn fast about their own axes, so that their inertia does not
depend on the pose (Spong 1987).

"""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.arm import ArmModel
from armid_ros.effects import Action, Transmission
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import Robot
from armid_ros.simulation.box_complementarity import Modes
from armid_ros.simulation.plant import limit_slack, middle_position, Plant
import numpy as np
import numpy.typing as npt
import pinocchio as pin


@dataclass(frozen=True, slots=True)
class ElasticState:
    """
    The state of an elastic arm.

    Attributes
    ----------
    steps : int
        Time in steps of the plant.
    t : float
        Time [s].
    q : ndarray, shape (n,)
        Link positions [rad or m].
    x : ndarray, shape (e + e + n,)
        Twists of the e elastic joints, velocities of their motors, velocities of the n links.
    dv : ndarray, shape (e + n,)
        Accelerations of motors and links now.
    modes : tuple of int
        What each dry friction element did: 1 slipped forwards, -1 backwards, 0 stuck.
    memory : ndarray
        States of the friction that has some.

    """

    steps: int
    t: float
    q: FloatArray
    x: FloatArray
    dv: FloatArray
    modes: Modes
    memory: FloatArray


#: Natural frequency of a link against its stop, times the substep: soft enough to be integrated.
_STOP = 0.1


@dataclass(frozen=True, eq=False)
class ElasticPlant:
    """
    An arm with elastic transmissions, ready to be integrated.

    Links that pass the limits of the robot meet a damped spring there, of 32 Hz with the inertia
    in the middle of the ranges at the usual step; they get some milliradians beyond.

    Attributes
    ----------
    arm : ArmModel
        Rigid body and effects, joint_elasticity and rotor_inertia among them.
    dt : float
        Step, over which the torque is constant [s].
    substeps : int
        Parts that a step is integrated in.
    link_damping : ndarray, shape (n,)
        Viscous friction of the links, which no effect of the catalogue has: friction there is at
        the motors [N m s/rad].

    Raises
    ------
    ModelError
        If no joint gives way, or the motor of one that does has no inertia; names the joint.

    """

    arm: ArmModel
    dt: float = 1e-3
    substeps: int = 2
    link_damping: npt.ArrayLike = 0.0
    rigid: Plant = field(init=False, repr=False)
    elastic: npt.NDArray[np.intp] = field(init=False, repr=False)
    springs: Transmission = field(init=False, repr=False)
    to_motors: FloatArray = field(init=False, repr=False)
    to_twists: FloatArray = field(init=False, repr=False)
    rotors: FloatArray = field(init=False, repr=False)
    damping: FloatArray = field(init=False, repr=False)
    friction: FloatArray = field(init=False, repr=False)
    sensing: Action = field(init=False, repr=False)
    pull: FloatArray = field(init=False, repr=False)
    loose: bool = field(init=False, repr=False)
    stops: tuple[FloatArray, FloatArray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Collect what the effects do on either side."""
        rigid = Plant(self.arm, self.dt / self.substeps, hard_stops=False)
        n, action = rigid.robot.n_joints, rigid.action
        springs = action.transmission
        if springs is None or not np.any(np.isfinite(springs.stiffness)):
            raise ModelError(
                f'{rigid.robot.name}: no joint gives way; add joint_elasticity, or simulate it '
                'as a rigid arm'
            )
        elastic = np.flatnonzero(np.isfinite(springs.stiffness))
        rotors = np.zeros((n, n)) if action.inertia is None else action.inertia
        for joint in elastic[np.diag(rotors)[elastic] <= 0.0][:1]:
            raise ModelError(
                f"{rigid.robot.name}: joint '{rigid.robot.joints[joint]}' gives way, but its "
                'motor has no inertia; add rotor_inertia'
            )
        if np.any(springs.gap[np.isinf(springs.stiffness)] > 0.0):
            raise ModelError(
                f'{rigid.robot.name}: free play of a rigid transmission cannot be integrated; add '
                'joint_elasticity to the joints with backlash'
            )
        e = len(elastic)
        to_links = np.hstack([np.zeros((n, e)), np.eye(n)])
        to_motors = to_links.copy()
        to_motors[elastic] = np.eye(e, e + n)
        to_twists = (to_motors - to_links)[elastic]
        link = np.diag(np.broadcast_to(np.asarray(self.link_damping, dtype=float), (n,)))
        values = {
            'link_damping': read_only(np.diag(link)),
            'rigid': rigid,
            'elastic': elastic,
            'springs': Transmission(
                springs.stiffness[elastic], springs.damping[elastic], springs.gap[elastic]
            ),
            'to_motors': to_motors,
            'to_twists': to_twists,
            'rotors': to_motors.T @ rotors @ to_motors,
            'damping': to_motors.T @ rigid.damping @ to_motors + to_links.T @ link @ to_links,
            'sensing': _sensing(self.arm),
            'stops': _stops(rigid),
            'friction': np.ascontiguousarray(rigid.contacts.directions @ to_motors),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, 'loose', bool(np.any(self.springs.gap)))
        pull = self.pull_of(self.springs.stiffness, self.springs.damping)
        object.__setattr__(self, 'pull', read_only(pull))

    @property
    def robot(self) -> Robot:
        """The rigid body as the effects make it."""
        return self.rigid.robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names in column order."""
        return self.rigid.robot.joints

    def pull_of(self, stiffness: FloatArray, damping: FloatArray) -> FloatArray:
        """Return what springs and friction do per state, shape (e + n, e + e + n)."""
        w = self.to_twists
        return np.hstack([-w.T * stiffness, -self.damping - (w.T * damping) @ w])

    def state(self, q: npt.ArrayLike, dq: npt.ArrayLike = 0.0) -> ElasticState:
        """
        Return the state of an arm whose links are somewhere, springs under the links' weight.

        Parameters
        ----------
        q, dq : array_like, shape (n,)
            Positions and velocities of the links; the motors move with them.

        """
        robot, e = self.rigid.robot, len(self.elastic)
        position = np.array(np.broadcast_to(np.asarray(q, dtype=float), (robot.n_joints,)))
        velocity = np.array(np.broadcast_to(np.asarray(dq, dtype=float), (robot.n_joints,)))
        weight = pin.computeGeneralizedGravity(robot.model, self.rigid.data, position)
        load = weight[self.elastic]
        twist = load / self.springs.stiffness + np.sign(load) * self.springs.gap
        x = np.concatenate([twist, velocity[self.elastic], velocity])
        modes = tuple(np.sign(self.friction @ x[e:]).astype(int).tolist())
        slipping = self.rigid.action.hysteresis
        memory = np.empty(0) if slipping is None else slipping.start(velocity)
        return ElasticState(0, 0.0, position, x, np.zeros(e + robot.n_joints), modes, memory)

    def motor(self, state: ElasticState) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities of the motors at the joints, each of shape (n,)."""
        e = len(self.elastic)
        position = state.q.copy()
        position[self.elastic] += state.x[:e]
        return position, self.to_motors.dot(state.x[e:])

    def link(self, state: ElasticState) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions, velocities and accelerations of the links, each of shape (n,)."""
        e = len(self.elastic)
        return state.q, state.x[2 * e :], state.dv[e:]

    def motor_acceleration(self, state: ElasticState) -> FloatArray:
        """Return the accelerations of the motors at the joints, shape (n,)."""
        return np.asarray(self.to_motors.dot(state.dv))

    def given(self, torque: FloatArray) -> FloatArray:
        """Return what the drives give where a torque is asked for, shape (n,) [N m]."""
        drive = self.rigid.action.drive
        return torque if drive is None else drive(torque)

    def require_range(self, state: ElasticState) -> None:
        """Raise TrajectoryError if a link is beyond a limit."""
        robot = self.rigid.robot
        slack = limit_slack(robot)
        beyond = (state.q < robot.lower - slack) | (state.q > robot.upper + slack)
        for joint in np.flatnonzero(beyond)[:1]:
            raise TrajectoryError(
                f"{robot.name}: joint '{robot.joints[joint]}' reaches {state.q[joint]:.4g} at "
                f'{state.t:.3f} s, beyond its limits of {robot.lower[joint]:.4g} and '
                f'{robot.upper[joint]:.4g}'
            )


def _stops(rigid: Plant) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and damping of the stops, each of shape (n,) [N m/rad], [N m s/rad]."""
    robot = rigid.robot
    inertia = np.array(pin.crba(robot.model, rigid.data, middle_position(robot)))
    free = 1.0 / np.diag(np.linalg.inv(inertia))
    rate = _STOP / rigid.dt
    return read_only(free * rate**2), read_only(1.4 * free * rate)


def _sensing(arm: ArmModel) -> Action:
    """Return what effects make of the readings of motors, which their springs do not change."""
    kept = [
        (effect, values)
        for effect, values in zip(arm.effects, arm.values, strict=True)
        if effect.action(values, ArmModel(arm.robot)).transmission is None
    ]
    bare = ArmModel(arm.robot, tuple(e for e, _ in kept), tuple(v for _, v in kept))
    return bare.action()
