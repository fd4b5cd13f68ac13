# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An arm whose motors drive its links through springs: the plant, and one step of it.

Where a transmission gives way, motor and link have velocities of their own. Motors carry rotor
inertia, drive torque and all friction of the arm's effects; links carry the rigid body and what is
attached to it. Rotors are taken to turn fast about their own axes, so that their inertia does not
depend on the pose (Spong 1987).

"""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.arm import ArmModel
from armid_ros.effects import Transmission
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.motion import FloatArray, read_only
from armid_ros.simulation.box_complementarity import Modes, solve_box_complementarity
from armid_ros.simulation.plant import limit_slack, Plant
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.linalg.lapack import dgesv


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


@dataclass(frozen=True, eq=False)
class ElasticPlant:
    """
    An arm with elastic transmissions, ready to be integrated.

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
            'friction': np.ascontiguousarray(rigid.contacts.directions @ to_motors),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names in column order."""
        return self.rigid.robot.joints

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

    def require_range(self, state: ElasticState) -> None:
        """Raise TrajectoryError if a link is beyond a limit; there are no stops to hold it."""
        robot = self.rigid.robot
        slack = limit_slack(robot)
        beyond = (state.q < robot.lower - slack) | (state.q > robot.upper + slack)
        for joint in np.flatnonzero(beyond)[:1]:
            raise TrajectoryError(
                f"{robot.name}: joint '{robot.joints[joint]}' reaches {state.q[joint]:.4g} at "
                f'{state.t:.3f} s, beyond its limits of {robot.lower[joint]:.4g} and '
                f'{robot.upper[joint]:.4g}'
            )


def elastic_step(plant: ElasticPlant, state: ElasticState, torque: FloatArray) -> ElasticState:
    """
    Integrate one step under a constant actuator torque, shape (n,) [N m].

    The springs, dampers and inertias of the moment are a linear system. It is integrated by the
    Pade approximation (2, 2) of its exponential, which is A-stable, so that no spring is too
    stiff for the step, and of fourth order, so that its frequencies stay where they are: 0.005 %
    off at ten steps a period. What is not linear is taken at the middle of the substep. Dry
    friction is complementary to the velocity at the end, as in the rigid plant.

    """
    for _ in range(plant.substeps):
        state = _substep(plant, state, torque)
    steps = state.steps + 1
    return ElasticState(
        steps, steps * plant.dt, state.q, state.x, state.dv, state.modes, state.memory
    )


def _substep(plant: ElasticPlant, state: ElasticState, torque: FloatArray) -> ElasticState:
    rigid, e = plant.rigid, len(plant.elastic)
    dt, x = rigid.dt, state.x
    speed = x[e:]
    half = 0.5 * dt
    q_middle = state.q + half * (x[2 * e :] + 0.5 * half * state.dv[e:])
    v_middle = speed + half * state.dv
    force, memory = _force(plant, state, torque, q_middle, v_middle)
    inertia = plant.rotors.copy()
    inertia[e:, e:] += pin.crba(rigid.robot.model, rigid.data, q_middle)
    stiffness, offset, ratio = _springs(plant, x[:e] + half * (plant.to_twists @ v_middle))
    force += plant.to_twists.T.dot(offset)
    resist = plant.damping + (plant.to_twists.T * ratio) @ plant.to_twists
    right = np.column_stack([-plant.to_twists.T * stiffness, -resist, force, plant.friction.T])
    solved = dgesv(inertia, right)[2]
    size = len(x)
    a = np.zeros((size, size))
    a[:e, e:] = plant.to_twists
    a[e:] = solved[:, :size]
    z = dt * a
    even = np.eye(size) + (z @ z) / 12.0
    inputs = np.zeros((size, 1 + len(plant.friction)))
    inputs[e:] = dt * solved[:, size:]
    inputs[:, 0] += even @ x + 0.5 * (z @ x)
    after = dgesv(even - 0.5 * z, inputs)[2]
    x_next, modes, rub = after[:, 0], state.modes, np.zeros(len(plant.friction))
    if modes:
        response = after[:, 1:]
        law = rigid.contacts
        if law.friction is not None:
            model, data = rigid.robot.model, rigid.data
            law = law.under(pin.rnea(model, data, q_middle, v_middle[e:], state.dv[e:]))
        rub, modes = solve_box_complementarity(
            law.law, plant.friction @ response[e:], plant.friction @ x_next[e:], modes
        )
        x_next = x_next - response @ rub
    constant = solved[:, size] - solved[:, size + 1 :] @ rub
    dv = a[e:] @ x_next + constant
    first = a[e:] @ x + constant
    moved = half * (x[2 * e :] + x_next[2 * e :]) + dt**2 / 12.0 * (first - dv)[e:]
    if 0 in modes:
        _hold(plant, state, x_next, modes, moved)
    return ElasticState(state.steps, state.t + dt, state.q + moved, x_next, dv, modes, memory)


def _force(
    plant: ElasticPlant,
    state: ElasticState,
    torque: FloatArray,
    q: FloatArray,
    v: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return what acts on motors and links at the middle of a substep, and the new memory."""
    rigid, action, e = plant.rigid, plant.rigid.action, len(plant.elastic)
    t = np.asarray(state.t + 0.5 * rigid.dt)
    motor_speed = plant.to_motors.dot(v)
    motor_position = q.copy()
    motor_position[plant.elastic] += state.x[:e] + 0.5 * rigid.dt * (plant.to_twists @ v)
    drive = torque - rigid.constant
    if action.torque is not None:
        drive = drive - action.torque(t, motor_position, motor_speed)
    memory = state.memory
    if action.hysteresis is not None:
        half = action.hysteresis.advance(memory, 0.5 * rigid.dt * motor_speed)
        drive = drive - action.hysteresis.torque(half)
        memory = action.hysteresis.advance(memory, rigid.dt * motor_speed)
    force = plant.to_motors.T.dot(drive)
    force[e:] -= pin.nonLinearEffects(rigid.robot.model, rigid.data, q, v[e:])
    if action.link_torque is not None:
        force[e:] -= action.link_torque(t, q, v[e:])
    return force, memory


def _springs(plant: ElasticPlant, twist: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stiffness, torque at zero twist (negative) and damping, nothing within a gap."""
    springs = plant.springs
    if not np.any(springs.gap):
        return springs.stiffness, np.zeros_like(twist), springs.damping
    meshes = np.abs(twist) > springs.gap
    stiffness = np.where(meshes, springs.stiffness, 0.0)
    offset = stiffness * springs.gap * np.sign(twist)
    return stiffness, offset, np.where(meshes, springs.damping, 0.0)


def _hold(
    plant: ElasticPlant, state: ElasticState, x: FloatArray, modes: Modes, moved: FloatArray
) -> None:
    """Keep motors that were and are stuck where they are, without rounding."""
    e = len(plant.elastic)
    for axis, mode in zip(plant.rigid.contacts.axes, modes, strict=True):
        if mode != 0 or axis < 0:
            continue
        places = np.flatnonzero(plant.elastic == axis)
        if not len(places):
            x[2 * e + axis] = 0.0
        for place in places:
            if state.x[e + place] == 0.0:
                x[place] = state.x[place] - moved[axis]
            x[e + place] = 0.0
