# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One step of an arm with elastic joints."""

from __future__ import annotations

from armid_ros.elastic.plant.plant import ElasticPlant, ElasticState
from armid_ros.motion import FloatArray
from armid_ros.simulation.box_complementarity import Modes, solve_box_complementarity
import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dgesv


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
    pull = plant.pull
    if plant.loose:
        pull, offset = _pull(plant, x[:e] + half * plant.to_twists.dot(v_middle))
        force += plant.to_twists.T.dot(offset)
    size = len(x)
    right = np.empty((len(force), size + 1 + len(plant.friction)), order='F')
    right[:, :size], right[:, size], right[:, size + 1 :] = pull, force, plant.friction.T
    solved = dgesv(inertia, right, 0, 1)[2]
    a = np.zeros((size, size))
    a[:e, e:] = plant.to_twists
    a[e:] = solved[:, :size]
    z = dt * a
    even = z.dot(z) / 12.0
    even.flat[:: size + 1] += 1.0
    inputs = np.zeros((size, 1 + len(plant.friction)), order='F')
    inputs[e:] = dt * solved[:, size:]
    inputs[:, 0] += even.dot(x) + 0.5 * z.dot(x)
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
    beyond = q - np.minimum(np.maximum(q, rigid.robot.lower), rigid.robot.upper)
    if beyond.any():
        stiffness, damping = plant.stops
        force[e:] -= stiffness * beyond + np.where(beyond != 0.0, damping, 0.0) * v[e:]
    return force, memory


def _pull(plant: ElasticPlant, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what springs that mesh do, and their torque at zero twist, negative, (e,) [N m]."""
    springs = plant.springs
    meshes = np.abs(twist) > springs.gap
    stiffness = np.where(meshes, springs.stiffness, 0.0)
    damping = np.where(meshes, springs.damping, 0.0)
    return plant.pull_of(stiffness, damping), stiffness * springs.gap * np.sign(twist)


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
