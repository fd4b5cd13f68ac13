# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of controller, drives and plant, one controller update per step."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.controller import Controller
from armid_ros.simulation.integrator import step
from armid_ros.simulation.plant import Plant, State
import numpy as np


@dataclass(frozen=True, eq=False)
class Targets:
    """
    What a controller is to do at N successive steps.

    Attributes
    ----------
    q, dq, ddq : ndarray, shape (N, n)
        The reference [rad or m, s].
    feedforward : ndarray, shape (N, n)
        What the controller derives from the reference alone [N m].

    """

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    feedforward: FloatArray

    @classmethod
    def of(cls, desired: Motion, controller: Controller) -> Targets:
        """Return the targets of a reference that has one row per step."""
        return cls(desired.q, desired.dq, desired.ddq, controller.feedforward(desired))

    def __getitem__(self, rows: slice) -> Targets:
        """Return some of the steps."""
        return Targets(self.q[rows], self.dq[rows], self.ddq[rows], self.feedforward[rows])

    def __len__(self) -> int:
        """Return the number of steps N."""
        return len(self.q)


@dataclass(frozen=True, eq=False)
class Trace:
    """
    What happened during N steps.

    Attributes
    ----------
    q, dq : ndarray, shape (N, n)
        State at the beginning of each step.
    ddq, tau : ndarray, shape (N, n)
        Mean acceleration, and the torque that the drives were asked for, of each step.
    state : State
        The state after the last step.
    torque : ndarray, shape (n,)
        The torque that the controller asks for there, as far as the drives have it.

    """

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    state: State
    torque: FloatArray


def command(
    plant: Plant, controller: Controller, state: State, targets: Targets, row: int
) -> FloatArray:
    """Return the torque for one row of the targets, within the limits of the drives, (n,)."""
    desired = targets.q[row], targets.dq[row], targets.ddq[row]
    asked = controller.torque(state.q, state.dq, desired, targets.feedforward[row])
    limit = plant.torque_limit
    return np.minimum(np.maximum(asked, -limit), limit)


def run(
    plant: Plant, controller: Controller, state: State, torque: FloatArray, targets: Targets
) -> Trace:
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
    torque : ndarray, shape (n,)
        Torque of the first step, from `command`.
    targets : Targets
        What to do at the end of each step.

    """
    q, dq, ddq, tau = np.empty((4, len(targets), len(torque)))
    drive = plant.action.drive
    for k in range(len(targets)):
        q[k], dq[k], tau[k] = state.q, state.dq, torque
        state = step(plant, state, torque if drive is None else drive(torque))
        ddq[k] = state.ddq
        torque = command(plant, controller, state, targets, k)
    return Trace(q, dq, ddq, tau, state, torque)
