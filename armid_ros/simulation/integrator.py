# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Integration of one step of the plant.

`spring_integrator` integrates elastic joints. For rigid joints, the rigid body and the smooth
effects are evaluated at the middle of the step, half a step ahead of the state. The integration is
therefore of second order in the step with one evaluation of the dynamics. The torque is constant
over a step, like the torque of a drive. Damping is linearly implicit. Dry friction and joint stops
are complementarity conditions on the velocity at the end of the step. A joint that sticks
therefore has exactly zero velocity.

"""

from __future__ import annotations

from armid_ros.motion import FloatArray
from armid_ros.simulation.bodies import no_body, NoBodyError
from armid_ros.simulation.box_complementarity import Modes, solve_box_complementarity
from armid_ros.simulation.contacts import Contacts
from armid_ros.simulation.plant import Plant, State
from armid_ros.simulation.spring_integrator import spring_substep
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
        Its state.
    torque : ndarray, shape (n,)
        Actuator torque [N m].

    Returns
    -------
    State
        The state one step later.

    """
    if plant.springs is not None and state.rotors is not None:
        steps = state.steps + 1
        for _ in range(plant.springs.substeps):
            assert state.rotors is not None
            state = spring_substep(plant, plant.springs, state.rotors, state, torque)
        return State(steps, steps * plant.dt, *state[2:])
    half = plant.spans[1]
    model, data, dq = plant.robot.model, plant.data, state.dq
    q_middle = state.q + half * dq
    dq_middle = dq + half * state.ddq
    weight = pin.nonLinearEffects(model, data, q_middle, dq_middle)
    force = torque - weight
    force -= plant.damping.dot(dq)
    memory, slipping = state.memory, plant.action.hysteresis
    middle = memory if slipping is None else slipping.advance(memory, half * dq)
    plant.resist(force, state.t + 0.5 * plant.dt, q_middle, dq_middle, middle)
    contacts, load = plant.contacts, None
    if contacts.friction is not None:
        load = pin.rnea(model, data, q_middle, dq_middle, state.ddq)
        contacts = contacts.under(load)
    inertia = pin.crba(plant.model, data, q_middle)
    if plant.coupling is not None:
        inertia = inertia + plant.coupling

    dq_next, ddq, modes = _end_velocity(plant, contacts, inertia, force, dq, state.modes)
    q_next = q_middle + half * dq_next
    if plant.hard_stops and not _inside(plant.stops, q_next):
        q_next, dq_next, ddq, modes = _stop(plant, inertia, force, state, q_next, load)
    if slipping is not None:
        memory = slipping.advance(memory, q_next - state.q)
    steps = state.steps + 1
    return State(steps, steps * plant.dt, q_next, dq_next, ddq, modes, memory)


def _end_velocity(
    plant: Plant,
    contacts: Contacts,
    inertia: FloatArray,
    force: FloatArray,
    dq: FloatArray,
    modes: Modes,
) -> tuple[FloatArray, FloatArray, Modes]:
    """Return end velocity, acceleration, and torques and modes of friction elements and stops."""
    dt = plant.spans[0]
    directions = contacts.directions
    right = np.empty((1 + len(directions), len(force)))
    right[0], right[1:] = force, directions
    _, solution, failed = dposv(inertia, right.T, 0, 0, 1)
    if failed:
        raise NoBodyError(no_body(plant.robot))
    solution = dt * solution
    dq_free, response = dq + solution[:, 0], solution[:, 1:]
    taken, modes = solve_box_complementarity(
        contacts.law, directions.dot(response), directions.dot(dq_free), modes
    )
    dq_next = dq_free - response.dot(taken)
    if 0 in modes:
        _clear_stuck(dq_next, contacts, modes)
    return dq_next, (dq_next - dq) / dt, modes


def _clear_stuck(dq: FloatArray, contacts: Contacts, modes: Modes) -> None:
    """Set the velocity of joints that stick to exactly zero, without rounding errors."""
    fixed = [
        axis for axis, mode in zip(contacts.axes, modes, strict=True) if mode == 0 and axis >= 0
    ]
    dq[fixed] = 0.0
    for direction, axis, mode in zip(contacts.directions, contacts.axes, modes, strict=True):
        if mode == 0 and axis < 0:
            free = np.abs(direction)
            free[fixed] = 0.0
            pivot = int(np.argmax(free))
            if free[pivot] > 0.0:
                dq[pivot] = 0.0
                dq[pivot] = -direction.dot(dq) / direction[pivot]
                fixed.append(pivot)


def _inside(stops: list[tuple[float, float]], q: FloatArray) -> bool:
    for position, (lower, upper) in zip(q.tolist(), stops, strict=True):
        if not lower <= position <= upper:
            return False
    return True


def _stop(
    plant: Plant,
    inertia: FloatArray,
    force: FloatArray,
    state: State,
    q_next: FloatArray,
    load: FloatArray | None,
) -> tuple[FloatArray, FloatArray, FloatArray, Modes]:
    """Repeat the step with the joint stops that were reached."""
    robot, count = plant.robot, len(state.modes)
    at_upper, at_lower = q_next > robot.upper, q_next < robot.lower
    while True:
        contacts = plant.contacts_at(at_lower, at_upper)
        if load is not None:
            contacts = contacts.under(load)
        guess = state.modes + (0,) * (len(contacts.axes) - count)
        dq, ddq, modes = _end_velocity(plant, contacts, inertia, force, state.dq, guess)
        q = state.q + 0.5 * plant.dt * (state.dq + dq)
        beyond_upper, beyond_lower = q > robot.upper, q < robot.lower
        if not np.any((beyond_upper & ~at_upper) | (beyond_lower & ~at_lower)):
            return np.clip(q, robot.lower, robot.upper), dq, ddq, modes[:count]
        at_upper, at_lower = at_upper | beyond_upper, at_lower | beyond_lower
