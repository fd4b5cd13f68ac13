# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Integration of one step of the plant.

For rigid joints, the rigid body and the smooth effects are evaluated at the middle of the step,
half a step ahead of the state. The integration is therefore of second order in the step with one
evaluation of the dynamics. The torque is constant over a step, like the torque of a drive. Damping
is linearly implicit. Dry friction and joint stops are complementarity conditions on the velocity
at the end of the step. The velocity of a sticking joint is therefore exactly zero.

Elastic joints are integrated in substeps. Springs, dampers and inertias at the present state
form a linear system, which is integrated with the Pade approximation (2, 2) of its matrix
exponential. The approximation is A-stable, so no spring is too stiff for the step. It is of
fourth order: the error of a frequency is 0.005 % at ten steps per period. Nonlinear torques are
evaluated at the middle of the substep.

"""

from __future__ import annotations

from armid_ros.motion import FloatArray
from armid_ros.simulation.contacts import Contacts, Modes
from armid_ros.simulation.plant import inertia_error, Plant, Rotors, State
from armid_ros.simulation.springs import ElasticJoints
import numpy as np
from scipy.linalg.lapack import dgesv, dposv


def step(plant: Plant, state: State, torque: FloatArray) -> State:
    """
    Integrate the plant over one time step with constant motor torque; return the new state.

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
    half, robot, dq = 0.5 * plant.dt, plant.robot, state.dq
    q_middle = state.q + half * dq
    dq_middle = dq + half * state.ddq
    force = torque - plant.weight(q_middle, dq_middle)
    force -= plant.damping.dot(dq)
    memory, slipping = state.memory, plant.action.hysteresis
    middle = memory if slipping is None else slipping.advance(memory, half * dq)
    plant.subtract_smooth_effects(force, state.t + 0.5 * plant.dt, q_middle, dq_middle, middle)
    contacts, load = plant.contacts, None
    if contacts.friction is not None:
        load = robot.inverse_dynamics(plant.data, q_middle, dq_middle, state.ddq)
        contacts = contacts.with_load(load)
    inertia = robot.inertia(plant.data, q_middle) + plant.added_inertia
    dq_next, ddq, modes = _end_velocity(plant, contacts, inertia, force, dq, state.modes)
    q_next = q_middle + half * dq_next
    if plant.hard_stops and np.any((q_next < robot.lower) | (q_next > robot.upper)):
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
    """Return velocities (n,), accelerations (n,) and contact modes at the end of a time step."""
    dt, directions = plant.dt, contacts.directions
    right = np.empty((1 + len(directions), len(force)))
    right[0], right[1:] = force, directions
    _, solution, failed = dposv(inertia, right.T, 0, 0, 1)
    if failed:
        raise inertia_error(plant.robot)
    solution = dt * solution
    dq_free, response = dq + solution[:, 0], solution[:, 1:]
    taken, modes = contacts.torques(directions.dot(response), directions.dot(dq_free), modes)
    dq_next = dq_free - response.dot(taken)
    if 0 in modes:
        # set the velocity of sticking joints to exactly zero
        fixed = [
            axis
            for axis, mode in zip(contacts.axes, modes, strict=True)
            if mode == 0 and axis >= 0
        ]
        dq_next[fixed] = 0.0
        for direction, axis, mode in zip(contacts.directions, contacts.axes, modes, strict=True):
            if mode == 0 and axis < 0:
                free = np.abs(direction)
                free[fixed] = 0.0
                pivot = int(np.argmax(free))
                if free[pivot] > 0.0:
                    dq_next[pivot] = 0.0
                    dq_next[pivot] = -direction.dot(dq_next) / direction[pivot]
                    fixed.append(pivot)
    return dq_next, (dq_next - dq) / dt, modes


def _stop(
    plant: Plant,
    inertia: FloatArray,
    force: FloatArray,
    state: State,
    q_next: FloatArray,
    load: FloatArray | None,
) -> tuple[FloatArray, FloatArray, FloatArray, Modes]:
    """Repeat a time step with contacts at the stops that joints hit; return the new motion."""
    robot, count = plant.robot, len(state.modes)
    at_upper, at_lower = q_next > robot.upper, q_next < robot.lower
    while True:
        contacts = plant.contacts_at(at_lower, at_upper)
        if load is not None:
            contacts = contacts.with_load(load)
        guess = state.modes + (0,) * (len(contacts.axes) - count)
        dq, ddq, modes = _end_velocity(plant, contacts, inertia, force, state.dq, guess)
        q = state.q + 0.5 * plant.dt * (state.dq + dq)
        beyond_upper, beyond_lower = q > robot.upper, q < robot.lower
        if not np.any((beyond_upper & ~at_upper) | (beyond_lower & ~at_lower)):
            return np.clip(q, robot.lower, robot.upper), dq, ddq, modes[:count]
        at_upper, at_lower = at_upper | beyond_upper, at_lower | beyond_lower


def spring_substep(
    plant: Plant, springs: ElasticJoints, rotors: Rotors, state: State, torque: FloatArray
) -> State:
    """Integrate elastic joints over one substep with constant motor torque; return the state."""
    dt, e = springs.dt, len(springs.joints)
    half = 0.5 * dt
    x = np.concatenate([rotors.twist, rotors.dq, state.dq])
    q = state.q + half * (state.dq + 0.5 * half * state.ddq)
    v = x[e:] + half * np.concatenate([rotors.ddq, state.ddq])
    twist = rotors.twist + half * springs.to_twists.dot(v)
    force, memory = _force(plant, springs, state, torque, q, v, twist)
    inertia = springs.rotors.copy()
    inertia[e:, e:] += plant.robot.inertia(plant.data, q)
    pull = springs.pull
    if springs.loose:
        pull, offset = springs.meshing(twist)
        force = force + springs.to_twists.T.dot(offset)
    # accelerations: per twist and velocity, by the other torques, and per dry friction torque
    right = np.concatenate([pull.T, force[np.newaxis], springs.friction]).T
    rates = np.asarray(dgesv(inertia, right, 0, 1)[2])
    after = _propagated(springs, rates, x)
    x_next, modes, rub = after[:, 0], state.modes, np.zeros(len(springs.friction))
    if modes:
        response, contacts = after[:, 1:], plant.contacts
        if contacts.friction is not None:
            load = plant.robot.inverse_dynamics(plant.data, q, v[e:], state.ddq)
            contacts = contacts.with_load(load)
        w, g = springs.friction @ x_next[e:], springs.friction @ response[e:]
        rub, modes = contacts.torques(g, w, modes)
        x_next = x_next - response @ rub
    size = len(x)
    constant = rates[:, size] - rates[:, size + 1 :] @ rub
    first, dv = (rates[:, :size] @ end + constant for end in (x, x_next))
    moved = half * (state.dq + x_next[2 * e :]) + dt**2 / 12.0 * (first - dv)[e:]
    if 0 in modes:
        _hold(plant, springs, rotors, x_next, modes, moved)
    turned = Rotors(x_next[:e], x_next[e : 2 * e], dv[:e])
    q, dq, t = state.q + moved, x_next[2 * e :], state.t + dt
    return State(state.steps, t, q, dq, dv[e:], modes, memory, turned)


def _propagated(springs: ElasticJoints, rates: FloatArray, x: FloatArray) -> FloatArray:
    """Return twists and velocities after a substep, and their derivatives by friction torques."""
    e, size = len(springs.joints), len(x)
    z = np.zeros((size, size))
    z[:e, e:] = springs.to_twists
    z[e:] = rates[:, :size]
    z *= springs.dt
    even = z.dot(z) / 12.0
    even.flat[:: size + 1] += 1.0
    inputs = np.zeros((size, rates.shape[1] - size), order='F')
    inputs[e:] = springs.dt * rates[:, size:]
    inputs[:, 0] += even.dot(x) + 0.5 * z.dot(x)
    return np.asarray(dgesv(even - 0.5 * z, inputs)[2])


def _force(
    plant: Plant,
    springs: ElasticJoints,
    state: State,
    torque: FloatArray,
    q: FloatArray,
    v: FloatArray,
    twist: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return torques on motors and links at mid-substep, (e + n,), and new hysteresis states."""
    robot, action, e = plant.robot, plant.action, len(springs.joints)
    t = state.t + 0.5 * springs.dt
    motor_speed = springs.to_motors.dot(v)
    memory, middle_memory = state.memory, state.memory
    if action.hysteresis is not None:
        middle_memory = action.hysteresis.advance(memory, 0.5 * springs.dt * motor_speed)
        memory = action.hysteresis.advance(memory, springs.dt * motor_speed)
    drive = torque.copy()
    q_motors = springs.at_motors(q, twist)
    plant.subtract_smooth_effects(drive, t, q_motors, motor_speed, middle_memory)
    force = springs.to_motors.T.dot(drive)
    force[e:] -= plant.weight(q, v[e:])
    if action.link_torque is not None:
        force[e:] -= action.link_torque(np.asarray(t), q, v[e:])
    if plant.hard_stops:
        beyond = q - np.minimum(np.maximum(q, robot.lower), robot.upper)
        if beyond.any():
            stiffness, damping = springs.stops
            force[e:] -= stiffness * beyond + np.where(beyond != 0.0, damping, 0.0) * v[e:]  # noqa: RUF069 - values within the range are not changed by clipping
    return force, memory


def _hold(
    plant: Plant,
    springs: ElasticJoints,
    before: Rotors,
    x: FloatArray,
    modes: Modes,
    moved: FloatArray,
) -> None:
    """Set the velocities and the travel of sticking motors to exactly zero, in place."""
    e = len(springs.joints)
    for axis, mode in zip(plant.contacts.axes, modes, strict=True):
        if mode != 0 or axis < 0:
            continue
        places = np.flatnonzero(springs.joints == axis)
        if not len(places):
            x[2 * e + axis] = 0.0
        for place in places:
            if before.dq[place] == 0.0:  # noqa: RUF069 - set below
                x[place] = before.twist[place] - moved[axis]
            x[e + place] = 0.0
