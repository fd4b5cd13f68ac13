# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of controller, drives and plant, one controller update per step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.motion import FloatArray
from armid_ros.simulation.controller import Controller, Targets
from armid_ros.simulation.integrator import step
from armid_ros.simulation.plant import Plant, State
import numpy as np


@dataclass(frozen=True, eq=False)
class Trace:
    """
    What happened during N steps.

    Attributes
    ----------
    states : list of State
        From the beginning of the first step to the end of the last, N + 1 of them.
    tau : ndarray, shape (N + 1, n)
        The torque that the drives were asked for in each step, and in the one that comes next, as
        far as they have it [N m].

    """

    states: list[State]
    tau: FloatArray

    @property
    def state(self) -> State:
        """The state after the last step."""
        return self.states[-1]

    @property
    def torque(self) -> FloatArray:
        """The torque that the controller asks for there, shape (n,) [N m]."""
        return np.asarray(self.tau[-1])


def command(
    plant: Plant, controller: Controller, state: State, targets: Targets, row: int
) -> FloatArray:
    """Return the torque for one row of the targets, within the limits of the drives, (n,)."""
    q, dq, _ = plant.motors(state)
    asked = controller.torque(q, dq, *targets.row(row))
    lowest, highest = plant.torque_range
    return np.minimum(np.maximum(asked, lowest), highest)


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
    states, asked, drive = [state], [torque], plant.action.drive
    for k in range(len(targets)):
        state = step(plant, state, torque if drive is None else drive(torque))
        torque = command(plant, controller, state, targets, k)
        states.append(state)
        asked.append(torque)
    return Trace(states, np.array(asked))


def motor_rows(plant: Plant, states: Sequence[State]) -> FloatArray:
    """Return positions, velocities and accelerations of the motors, shape (3, N, n)."""
    rows = np.concatenate([part for state in states for part in plant.motors(state)])
    return rows.reshape(len(states), 3, -1).transpose(1, 0, 2)
