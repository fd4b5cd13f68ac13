# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the effects of an arm make of its readings: offsets, gains, delays."""

from __future__ import annotations

from armid_ros.effects import Action
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.closed_loop import Trace
from armid_ros.simulation.plant import Plant, State
import numpy as np

#: Extra samples around those that a reading depends on, for its rates of change.
_NEIGHBOURS = 8


def readings(
    action: Action, truth: Motion, asked: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what sensors without noise read.

    Parameters
    ----------
    action : Action
        What the effects do.
    truth : Motion
        True motion and torque, at every step of the plant.
    asked : ndarray, shape (N, n)
        What the drives were asked for, which is what they report [N m].

    Returns
    -------
    q, dq, tau : ndarray, shape (N, n)
        Position, velocity and torque as read.

    """
    q, dq, tau = truth.q, truth.dq, asked
    if action.reading is not None:
        assert truth.tau is not None
        tau = action.reading(truth.with_torque(asked), truth.tau)
    if action.displacement is not None:
        beyond = action.displacement(truth)
        q, dq = q - beyond.q, dq - beyond.dq
    return q, dq, tau


class RecentPast:
    """
    The last samples of an arm, as many as its readings depend on.

    Parameters
    ----------
    plant : Plant
        The arm.
    state : State
        Where it starts.
    torque : ndarray, shape (n,)
        What its drives are asked for there [N m].
    delay : int
        Steps by which the torque sensors are late.

    """

    def __init__(self, plant: Plant, state: State, torque: FloatArray, delay: int = 0) -> None:
        self._plant = plant
        self._delay = delay
        memory = int(np.ceil(plant.sensing.reading_memory / plant.dt))
        self._length = memory + delay + _NEIGHBOURS
        given = torque if plant.action.drive is None else plant.action.drive(torque)
        q, dq, _ = plant.motors(state)
        self._rows = np.stack([q, dq, np.zeros_like(q), given, torque])[:, np.newaxis]
        self._steps = state.steps

    def extend(self, trace: Trace) -> None:
        """
        Take in what happened.

        Torque is constant over a step. Where joints are rigid, what is read between two steps is
        the mean of both, as the acceleration jumps with it; where motors have rotors of their
        own, it is what is given from now on.

        """
        rows = np.empty((5, len(trace.tau) - 1, trace.tau.shape[1]))
        rows[:3], rows[3:] = trace.motors[:, 1:], self._read(trace.tau)
        drive = self._plant.action.drive
        if drive is not None:
            rows[3] = self._read(drive(trace.tau))
        self._rows = np.concatenate([self._rows, rows], axis=1)[:, -self._length :]
        self._steps = trace.state.steps

    def _read(self, tau: FloatArray) -> FloatArray:
        """Return torques at the ends of steps from those of the steps."""
        return (tau[1:] + tau[:-1]) / 2 if self._plant.springs is None else tau[1:]

    def latest(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and torque as read now, each of shape (n,)."""
        count, sensing = self._rows.shape[1], self._plant.sensing
        q, dq, ddq, given, asked = self._rows
        late = max(-1 - self._delay, -count)
        if count == 1 or (sensing.reading is None and sensing.displacement is None):
            return q[-1], dq[-1], asked[late]
        t = self._plant.times(self._steps - count + 1, count)
        truth = Motion(self._plant.robot.joints, t, q, dq, ddq, given)
        q, dq, tau = readings(sensing, truth, asked)
        return q[-1], dq[-1], tau[late]
