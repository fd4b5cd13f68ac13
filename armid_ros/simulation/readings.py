# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the effects of an arm make of its readings: offsets, gains, delays."""

from __future__ import annotations

from armid_ros.effects import Action
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.closed_loop import Trace
from armid_ros.simulation.plant import Plant, State
import numpy as np

#: Samples beside those that a reading depends on, from which rates of change are taken.
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
        What its drives are asked for there.
    delay : int
        Steps by which the torque sensors are late.

    """

    def __init__(self, plant: Plant, state: State, torque: FloatArray, delay: int = 0) -> None:
        self._plant = plant
        self._delay = delay
        steps = plant.action.reading_memory / plant.dt
        self._length = int(np.ceil(steps)) + delay + _NEIGHBOURS
        zero = np.zeros_like(torque)
        self._rows = np.stack([state.q, state.dq, zero, torque, torque])[np.newaxis]
        self._steps = state.steps

    def extend(self, trace: Trace) -> None:
        """Take in what happened."""
        drive = self._plant.action.drive
        asked = np.concatenate([trace.tau, trace.torque[np.newaxis]])
        given = asked if drive is None else drive(asked)
        q = np.concatenate([trace.q[1:], trace.state.q[np.newaxis]])
        dq = np.concatenate([trace.dq[1:], trace.state.dq[np.newaxis]])
        means = [(x[1:] + x[:-1]) / 2 for x in (given, asked)]
        new = np.stack([q, dq, trace.ddq, *means], axis=1)
        self._rows = np.concatenate([self._rows, new])[-self._length :]
        self._steps = trace.state.steps

    def latest(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and torque as read now, each of shape (n,)."""
        count = len(self._rows)
        q, dq, ddq, given, asked = self._rows.transpose(1, 0, 2)
        t = self._plant.times(self._steps - count + 1, count)
        if count == 1:
            return q[0], dq[0], asked[0]
        truth = Motion(self._plant.robot.joints, t, q, dq, ddq, given)
        q, dq, tau = readings(self._plant.action, truth, asked)
        return q[-1], dq[-1], tau[max(-1 - self._delay, -count)]
