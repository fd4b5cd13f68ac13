# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One step of the plant.

Where joints give way, `spring_integrator` has it. Where they are rigid, the rigid body and the
smooth effects are taken at the middle of the step, half a step ahead of the state, which makes the
integration second order in the step with one evaluation of the dynamics; the torque is constant
over a step, as a drive gives it. Damping is linearly implicit. Dry friction and joint stops are
complementarity conditions on the velocity at the end of the step, so that what sticks has velocity
zero, not a small one.

"""

from __future__ import annotations

from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.simulation.bodies import no_body
from armid_ros.simulation.box_complementarity import Modes, solve_box_complementarity
from armid_ros.simulation.contacts import Contacts
from armid_ros.simulation.plant import Plant, State
from armid_ros.simulation.spring_integrator import spring_substep
from armid_ros.simulation.springs import ElasticJoints
import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv


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
    if plant.springs is not None and state.rotors is not None:
        return _on_springs(plant, plant.springs, state, torque)
    dt, half = plant.spans
    model, data, dq = plant.robot.model, plant.data, state.dq
    q_middle = state.q + half * dq
    dq_middle = dq + half * state.ddq
    weight = pin.nonLinearEffects(model, data, q_middle, dq_middle)
    memory, slipping = state.memory, plant.action.hysteresis
    middle = memory if slipping is None else slipping.advance(memory, half * dq)
    force = plant.drive_force(torque, np.asarray(state.t + half), q_middle, dq_middle, middle)
    force -= weight
    force -= plant.damping.dot(dq)
    mass = pin.crba(model, data, q_middle)
    contacts, load = plant.contacts, None
    if contacts.friction is not None:
        load = weight + mass.dot(state.ddq)
        contacts = contacts.under(load)
    inertia = mass + plant.inertia

    solution = _solve(plant, inertia, force, contacts.directions)
    dq_next, modes = dq + dt * solution[:, 0], state.modes
    if modes:
        dq_next, modes = _rub(contacts, dt * solution[:, 1:], dq_next, modes)
    q_next = q_middle + half * dq_next
    if plant.hard_stops and not _inside(plant.stops, q_next):
        q_next, dq_next, modes = _stop(plant, inertia, force, state, q_middle, q_next, load)
    if slipping is not None:
        memory = slipping.advance(memory, q_next - state.q)
    steps = state.steps + 1
    return State(steps, steps * plant.dt, q_next, dq_next, (dq_next - dq) / dt, modes, memory)


def _on_springs(plant: Plant, springs: ElasticJoints, state: State, torque: FloatArray) -> State:
    """Integrate one step, in parts, where joints give way."""
    steps = state.steps + 1
    for _ in range(springs.substeps):
        assert state.rotors is not None
        state = spring_substep(plant, springs, state.rotors, state, torque)
    return state._replace(steps=steps, t=steps * plant.dt)


def _solve(
    plant: Plant, inertia: FloatArray, force: FloatArray, directions: FloatArray
) -> FloatArray:
    """Return the inverse inertia times (force, directions^T), shape (n, 1 + m)."""
    right = np.empty((1 + len(directions), len(force)))
    right[0] = force
    right[1:] = directions
    _, solution, failed = dposv(inertia, right.T, 0, 0, 1)
    if failed:
        raise ModelError(no_body(plant.robot))
    return np.asarray(solution)


def _rub(
    contacts: Contacts, response: FloatArray, dq_free: FloatArray, modes: Modes
) -> tuple[FloatArray, Modes]:
    """Let friction elements and stops act on the velocity at the end of the step."""
    directions = contacts.directions
    torque, modes = solve_box_complementarity(
        contacts.law, directions.dot(response), directions.dot(dq_free), modes
    )
    dq = dq_free - response.dot(torque)
    if 0 in modes:
        _clear_stuck(dq, contacts, modes)
    return dq, modes


def _clear_stuck(dq: FloatArray, contacts: Contacts, modes: Modes) -> None:
    """Make the velocity of what sticks exactly zero, where the solution has rounding errors."""
    fixed = []
    for axis, mode in zip(contacts.axes, modes, strict=True):
        if mode == 0 and axis >= 0:
            dq[axis] = 0.0
            fixed.append(axis)
    for element, (axis, mode) in enumerate(zip(contacts.axes, modes, strict=True)):
        if mode == 0 and axis < 0:
            direction = contacts.directions[element]
            free = np.abs(direction)
            free[fixed] = 0.0
            pivot = int(np.argmax(free))
            if free[pivot] > 0.0:
                dq[pivot] = 0.0
                dq[pivot] = -direction.dot(dq) / direction[pivot]
                fixed.append(pivot)


def _inside(stops: list[tuple[float, float]], q: FloatArray) -> bool:
    return all(lower <= x <= upper for x, (lower, upper) in zip(q.tolist(), stops, strict=True))


def _stop(
    plant: Plant,
    inertia: FloatArray,
    force: FloatArray,
    state: State,
    q_middle: FloatArray,
    q_next: FloatArray,
    load: FloatArray | None,
) -> tuple[FloatArray, FloatArray, Modes]:
    """Repeat the step with the stops that it ran into."""
    robot, count = plant.robot, len(state.modes)
    at_upper, at_lower = q_next > robot.upper, q_next < robot.lower
    while True:
        contacts = plant.contacts_at(at_lower, at_upper)
        if load is not None:
            contacts = contacts.under(load)
        solution = _solve(plant, inertia, force, contacts.directions)
        dq_free = state.dq + plant.dt * solution[:, 0]
        guess = state.modes + (0,) * (len(contacts.axes) - count)
        dq, modes = _rub(contacts, plant.dt * solution[:, 1:], dq_free, guess)
        q = q_middle + 0.5 * plant.dt * dq
        beyond_upper, beyond_lower = q > robot.upper, q < robot.lower
        if not np.any((beyond_upper & ~at_upper) | (beyond_lower & ~at_lower)):
            return np.clip(q, robot.lower, robot.upper), dq, modes[:count]
        at_upper, at_lower = at_upper | beyond_upper, at_lower | beyond_lower
