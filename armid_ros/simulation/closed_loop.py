# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of controller, drives and plant, one controller update per step."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.controller import Controller
from armid_ros.simulation.plant import Plant, State, step
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Trace:
    """
    What happened during N steps.

    Attributes
    ----------
    first : int
        Time of the first row in steps.
    q, dq : ndarray, shape (N, n)
        State at the beginning of each step.
    ddq, tau : ndarray, shape (N, n)
        Mean acceleration, and the torque, of each step.
    saturated : ndarray of bool, shape (N, n)
        Where the controller asked for more than the drive has.
    state : State
        The state after the last step.

    """

    first: int
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    saturated: npt.NDArray[np.bool_]
    state: State


def run(plant: Plant, controller: Controller, state: State, desired: Motion) -> Trace:
    """
    Let an arm follow a reference.

    Parameters
    ----------
    plant : Plant
        The arm.
    controller : Controller
        What drives it.
    state : State
        Where it starts.
    desired : Motion
        The reference, one row per step, the first one for the start.

    """
    first, (n_steps, n) = state.steps, desired.q.shape
    feedforward = controller.feedforward(desired)
    q, dq, ddq, tau = (np.empty((n_steps, n)) for _ in range(4))
    asked = np.empty((n_steps, n))
    limit = plant.robot.torque_limit
    bounded = bool(np.any(np.isfinite(limit)))
    for k, wanted in enumerate(zip(desired.q, desired.dq, desired.ddq, strict=True)):
        torque = controller.torque(state.q, state.dq, wanted, feedforward[k])
        asked[k] = torque
        if bounded:
            torque = np.minimum(np.maximum(torque, -limit), limit)
        q[k], dq[k], tau[k] = state.q, state.dq, torque
        state = step(plant, state, torque)
        ddq[k] = state.ddq
    return Trace(first, q, dq, ddq, tau, np.abs(asked) > limit, state)
