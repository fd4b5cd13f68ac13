# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of controller, drives and plant, one controller update per step."""

from __future__ import annotations

from typing import NamedTuple

from armid_ros.motion import FloatArray, read_only
from armid_ros.simulation.compiled import CompiledLoop, CompiledRun
from armid_ros.simulation.controller import Controller, Target, Targets
from armid_ros.simulation.integrator import step
from armid_ros.simulation.plant import Plant, State
import numpy as np


class Trace(NamedTuple):
    """
    States and torques during N steps.

    Attributes
    ----------
    motors, links : ndarray, shape (3, N + 1, n)
        Positions, velocities and accelerations from the beginning of the first step to the end of
        the last; the same array if all joints are rigid.
    tau : ndarray, shape (N + 1, n)
        Commanded torque of each step, and of the step after the last, within the limits of the
        drives [N m].
    state : State
        The state after the last step.

    """

    motors: FloatArray
    links: FloatArray
    tau: FloatArray
    state: State


def command(plant: Plant, controller: Controller, state: State, target: Target) -> FloatArray:
    """Return the torque for a target, within the limits of the drives, shape (n,) [N m]."""
    q, dq = (state.q, state.dq) if state.rotors is None else plant.motors(state)[:2]
    lowest, highest = plant.torque_range
    return np.minimum(np.maximum(controller.torque(q, dq, *target), lowest), highest)


def run(
    plant: Plant,
    controller: Controller,
    state: State,
    torque: FloatArray,
    targets: Targets,
    compiled: CompiledLoop | None = None,
) -> Trace:
    """
    Let an arm follow a reference.

    Parameters
    ----------
    plant : Plant
        The arm.
    controller : Controller
        The controller.
    state : State
        The initial state.
    torque : ndarray, shape (n,)
        Torque of the first step, from `command`.
    targets : Targets
        The targets at the end of each step.
    compiled : CompiledLoop, optional
        The same plant and controller in compiled form, used for the steps that it supports.

    """
    drive, last = plant.action.drive, len(targets)
    tau = np.empty((last + 1, len(torque)))
    links = np.empty((3, *tau.shape))
    motors = links if plant.springs is None else np.empty_like(links)
    q, dq, ddq = links
    fast = None if compiled is None else CompiledRun(compiled, targets, links, tau)
    k = 0
    while k < last:
        q[k], dq[k], ddq[k], tau[k] = state.q, state.dq, state.ddq, torque
        if motors is not links:
            motors[:, k] = plant.motors(state)
        reached = k if fast is None else fast.advance(state, k)
        if reached > k:
            steps = state.steps + reached - k
            at, speed, pull = map(read_only, links[:, reached])
            modes, memory = state.modes, state.memory
            state = State(steps, steps * plant.dt, at, speed, pull, modes, memory)
            k, torque = reached, tau[reached]
            continue
        state = step(plant, state, torque if drive is None else drive(torque))
        torque = command(plant, controller, state, targets.at(k))
        k += 1
    q[last], dq[last], ddq[last], tau[last] = state.q, state.dq, state.ddq, torque
    if motors is not links:
        motors[:, last] = plant.motors(state)
    return Trace(motors, links, tau, state)
