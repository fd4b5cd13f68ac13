# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The plant: an arm model integrated over one fixed step at a time.

The rigid body and the smooth effects are taken at the middle of the step, half a step ahead of the
state, which makes the integration second order in the step with one evaluation of the dynamics;
the torque is constant over a step, as a drive gives it. Damping is linearly implicit. Dry friction
and joint stops are complementarity conditions on the velocity at the end of the step, so that what
sticks has velocity zero, not a small one.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math

from armid_ros.arm import ArmModel
from armid_ros.effects import DryFriction
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import Robot
from armid_ros.simulation.box_complementarity import solve_box_complementarity
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.linalg import eigh
from scipy.linalg.lapack import dposv


@dataclass(frozen=True, slots=True)
class State:
    """
    The state of a plant at the beginning of a step.

    Attributes
    ----------
    steps : int
        Time in steps of the plant.
    t : float
        Time [s], steps times the step.
    q, dq : ndarray, shape (n,)
        Position [rad or m] and velocity.
    ddq : ndarray, shape (n,)
        Mean acceleration of the step that led here.
    modes : ndarray, shape (m,)
        What each dry friction element did: 1.0 slipped forwards, -1.0 backwards, 0.0 stuck.

    """

    steps: int
    t: float
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    modes: FloatArray


@dataclass(frozen=True, eq=False)
class Plant:
    """
    An arm ready to be integrated.

    Attributes
    ----------
    arm : ArmModel
        Rigid body and effects.
    dt : float
        Step [s].
    hard_stops : bool
        Whether the joints stop, without bouncing, at the position limits of the robot.
    robot : Robot
        The rigid body as the effects make it.

    Notes
    -----
    The scratch memory of the rigid-body algorithms is kept here: `step` is a pure function, but
    two threads need two plants.

    """

    arm: ArmModel
    dt: float = 1e-3
    hard_stops: bool = True
    robot: Robot = field(init=False)
    friction: DryFriction = field(init=False)
    _torque: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None = field(
        init=False, repr=False
    )
    _data: pin.Data = field(init=False, repr=False)
    _damping: FloatArray = field(init=False, repr=False)
    _constant: FloatArray = field(init=False, repr=False)
    _added_inertia: FloatArray = field(init=False, repr=False)
    _axes: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Collect what the effects do."""
        if not (math.isfinite(self.dt) and self.dt > 0.0):
            raise ModelError(f'the step has to be a positive time, not {self.dt} s')
        action = self.arm.action()
        robot = action.robot or self.arm.robot
        n = robot.n_joints
        zero = np.zeros((n, n))
        damping = zero if action.damping is None else action.damping
        inertia = zero if action.inertia is None else action.inertia
        friction, constant = _split_constant(action.dry_friction, n)
        data = robot.model.createData()
        pin.crba(robot.model, data, middle_position(robot))
        weight = _damping_weight(np.array(data.M) + inertia, damping, self.dt)
        values = {
            'robot': robot,
            'friction': friction,
            '_data': data,
            '_torque': action.torque,
            '_damping': damping,
            '_constant': constant,
            '_added_inertia': inertia + weight * self.dt * damping,
            '_axes': tuple(_axis(direction) for direction in friction.directions),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def state(
        self,
        q: npt.ArrayLike,
        dq: npt.ArrayLike | None = None,
        ddq: npt.ArrayLike | None = None,
        steps: int = 0,
    ) -> State:
        """
        Make a state, at rest unless told otherwise.

        Raises
        ------
        TrajectoryError
            If a joint is beyond its stop; the message names it.

        """
        n = self.robot.n_joints
        position, velocity, acceleration = (
            read_only(np.broadcast_to(0.0 if x is None else np.asarray(x, dtype=float), (n,)))
            for x in (q, dq, ddq)
        )
        if self.hard_stops:
            for joint, x, lower, upper in zip(
                self.robot.joints, position, self.robot.lower, self.robot.upper, strict=True
            ):
                if not lower <= x <= upper:
                    raise TrajectoryError(
                        f"{self.robot.name}: joint '{joint}' cannot be at {x:.4g}, its stops are "
                        f'at {lower:.4g} and {upper:.4g}'
                    )
        modes = read_only(np.sign(self.friction.directions @ velocity))
        return State(steps, steps * self.dt, position, velocity, acceleration, modes)


def step(plant: Plant, state: State, torque: FloatArray) -> State:
    """
    Integrate one step under a constant actuator torque.

    Parameters
    ----------
    plant : Plant
        The arm.
    state : State
        Where it is.
    torque : ndarray, shape (n,)
        Actuator torque [N m].

    Returns
    -------
    State
        Where it is one step later.

    """
    dt, half = plant.dt, 0.5 * plant.dt
    model, data, friction = plant.robot.model, plant._data, plant.friction
    dq = state.dq
    q_middle = state.q + half * dq
    dq_middle = dq + half * state.ddq
    force = torque - pin.nonLinearEffects(model, data, q_middle, dq_middle)
    force -= plant._constant
    force -= plant._damping.dot(dq)
    if plant._torque is not None:
        force -= plant._torque(np.asarray(state.t + half), q_middle, dq_middle)
    inertia = pin.crba(model, data, q_middle) + plant._added_inertia

    solution = _solve(inertia, force, friction.directions)
    dq_free = dq + dt * solution[:, 0]
    if len(plant._axes):
        dq_next, modes = _rub(plant, friction, solution, dq_free, state.modes, plant._axes)
    else:
        dq_next, modes = dq_free, state.modes
    q_next = q_middle + half * dq_next
    if plant.hard_stops and not _inside(plant.robot, q_next):
        q_next, dq_next, modes = _stop(plant, inertia, force, state, q_middle, q_next)
    steps = state.steps + 1
    return State(steps, steps * dt, q_next, dq_next, (dq_next - dq) / dt, modes)


def middle_position(robot: Robot) -> FloatArray:
    """Return the middle of the range of every joint, 0 where there is none, shape (n,)."""
    limited = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    return np.asarray(np.where(limited, np.where(limited, robot.lower + robot.upper, 0.0) / 2, 0))


def _solve(inertia: FloatArray, force: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the inverse inertia times (force, directions^T), shape (n, 1 + m)."""
    right = np.empty((1 + len(directions), len(force)))
    right[0] = force
    right[1:] = directions
    _, solution, failed = dposv(inertia, right.T)
    if failed:
        raise ModelError(
            f'the inertia matrix is not positive definite at joint {failed}: the rigid-body '
            'parameters are not those of a body'
        )
    return np.asarray(solution)


def _rub(
    plant: Plant,
    friction: DryFriction,
    solution: FloatArray,
    dq_free: FloatArray,
    modes: FloatArray,
    axes: tuple[int, ...],
) -> tuple[FloatArray, FloatArray]:
    """Let the friction elements act on the velocity at the end of the step."""
    directions = friction.directions
    response = plant.dt * solution[:, 1:]
    torque, modes = solve_box_complementarity(
        directions.dot(response), directions.dot(dq_free), friction.lower, friction.upper, modes
    )
    dq = dq_free - response.dot(torque)
    _clear_stuck(dq, directions, modes.tolist(), axes)
    return dq, modes


def _clear_stuck(
    dq: FloatArray, directions: FloatArray, modes: list[float], axes: tuple[int, ...]
) -> None:
    """Make the velocity of what sticks exactly zero, where the solution has rounding errors."""
    fixed = []
    for axis, mode in zip(axes, modes, strict=True):
        if mode == 0.0 and axis >= 0:
            dq[axis] = 0.0
            fixed.append(axis)
    for direction, axis, mode in zip(directions, axes, modes, strict=True):
        if mode == 0.0 and axis < 0:
            free = np.abs(direction)
            free[fixed] = 0.0
            pivot = int(np.argmax(free))
            if free[pivot] > 0.0:
                dq[pivot] = 0.0
                dq[pivot] = -direction.dot(dq) / direction[pivot]
                fixed.append(pivot)


def _inside(robot: Robot, q: FloatArray) -> bool:
    return bool(np.minimum(q - robot.lower, robot.upper - q).min() >= 0.0)


def _stop(
    plant: Plant,
    inertia: FloatArray,
    force: FloatArray,
    state: State,
    q_middle: FloatArray,
    q_next: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Repeat the step with the stops that it ran into.

    A stop is a friction element that holds any torque one way: its law is w <= 0, f >= 0, w f = 0
    at the upper limit.

    """
    robot, friction = plant.robot, plant.friction
    n, m = robot.n_joints, len(friction.lower)
    at_upper, at_lower = q_next > robot.upper, q_next < robot.lower
    while True:
        hit = np.flatnonzero(at_upper | at_lower)
        stops = DryFriction(
            np.vstack([friction.directions, np.eye(n)[hit]]),
            np.append(friction.lower, np.where(at_lower[hit], -np.inf, 0.0)),
            np.append(friction.upper, np.where(at_upper[hit], np.inf, 0.0)),
        )
        solution = _solve(inertia, force, stops.directions)
        guess = np.append(state.modes, np.zeros(len(hit)))
        dq_free = state.dq + plant.dt * solution[:, 0]
        axes = plant._axes + tuple(hit.tolist())
        dq, modes = _rub(plant, stops, solution, dq_free, guess, axes)
        q = q_middle + 0.5 * plant.dt * dq
        beyond_upper, beyond_lower = q > robot.upper, q < robot.lower
        if not np.any((beyond_upper & ~at_upper) | (beyond_lower & ~at_lower)):
            return np.clip(q, robot.lower, robot.upper), dq, modes[:m]
        at_upper, at_lower = at_upper | beyond_upper, at_lower | beyond_lower


def _split_constant(friction: DryFriction | None, n_joints: int) -> tuple[DryFriction, FloatArray]:
    """Part the elements that cannot stick, whose levels are one constant torque, from the rest."""
    if friction is None:
        return DryFriction(np.empty((0, n_joints)), np.empty(0), np.empty(0)), np.zeros(n_joints)
    if np.any(friction.lower > friction.upper):
        raise ModelError(
            'dry friction that pushes: the torque of an element forwards is less than backwards '
            f'({friction.upper} against {friction.lower}); friction torques have to be positive'
        )
    constant = friction.lower == friction.upper
    sticking = DryFriction(
        np.ascontiguousarray(friction.directions[~constant]),
        friction.lower[~constant],
        friction.upper[~constant],
    )
    return sticking, np.asarray(friction.lower[constant] @ friction.directions[constant])


def _axis(direction: FloatArray) -> int:
    """Return the joint that an element acts on alone, -1 if it acts on several."""
    joints = np.flatnonzero(direction)
    return int(joints[0]) if len(joints) == 1 else -1


def _damping_weight(inertia: FloatArray, damping: FloatArray, dt: float) -> float:
    """
    Return the share of the end of a step in the velocity that damping acts on.

    1/2 (second order) for weak damping, 1 (no overshoot) for stiff damping; between them the
    value that makes the fastest decay rate of the arm exact: 1 / (1 - exp(-z)) - 1 / z.
    Source: Liniger and Willoughby 1970, exponential fitting.

    """
    symmetric = (damping + damping.T) / 2
    z = dt * float(eigh(symmetric, inertia, eigvals_only=True)[-1])
    if z < 1e-3:
        return 0.5
    return 1.0 / -math.expm1(-z) - 1.0 / z
