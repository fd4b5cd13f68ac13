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
    action : Action
        What the effects do to the readings.
    dt : float
        Time between samples [s].
    joints : tuple of str
        Their names.
    delay : int
        Steps by which the torque sensors are late.

    """

    def __init__(self, action: Action, dt: float, joints: tuple[str, ...], delay: int = 0) -> None:
        self._action = action
        self._dt = dt
        self._joints = joints
        self._delay = delay
        self._length = int(np.ceil(action.reading_memory / dt)) + delay + _NEIGHBOURS
        self._rows = np.empty((0, 5, len(joints)))

    @classmethod
    def of(cls, plant: Plant, state: State, torque: FloatArray, delay: int = 0) -> RecentPast:
        """
        Return the past of an arm that stands at its beginning.

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
        past = cls(plant.action, plant.dt, plant.robot.joints, delay)
        zero = np.zeros_like(torque)
        now = np.stack([state.q, state.dq, zero, torque, torque])
        past.append(now[np.newaxis], state.steps)
        return past

    def append(self, rows: FloatArray, steps: int) -> None:
        """
        Take in samples.

        Parameters
        ----------
        rows : ndarray, shape (N, 5, n)
            Position, velocity, acceleration, torque that drives gave and were asked for.
        steps : int
            Step of the last of them.

        """
        self._rows = np.concatenate([self._rows, rows])[-self._length :]
        self._steps = steps

    def extend(self, trace: Trace) -> None:
        """Take in what happened."""
        drive, state = self._action.drive, trace.state
        rows = np.empty((len(trace.q), 5, len(self._joints)))
        rows[:-1, 0], rows[-1, 0] = trace.q[1:], state.q
        rows[:-1, 1], rows[-1, 1] = trace.dq[1:], state.dq
        rows[:, 2] = trace.ddq
        asked = np.empty((len(trace.tau) + 1, len(self._joints)))
        asked[:-1], asked[-1] = trace.tau, trace.torque
        rows[:, 4] = (asked[1:] + asked[:-1]) / 2
        given = asked if drive is None else drive(asked)
        rows[:, 3] = rows[:, 4] if drive is None else (given[1:] + given[:-1]) / 2
        self.append(rows, state.steps)

    def latest(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and torque as read now, each of shape (n,)."""
        count = len(self._rows)
        q, dq, ddq, given, asked = self._rows.transpose(1, 0, 2)
        late = max(-1 - self._delay, -count)
        if count == 1 or (self._action.reading is None and self._action.displacement is None):
            return q[-1], dq[-1], asked[late]
        steps = np.arange(self._steps - count + 1, self._steps + 1)
        t = np.asarray(self._dt * steps, dtype=np.float64)
        truth = Motion(self._joints, t, q, dq, ddq, given)
        q, dq, tau = readings(self._action, truth, asked)
        return q[-1], dq[-1], tau[late]
