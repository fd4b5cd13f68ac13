# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of a stream of joint states; `rows.checks` has the checks of a recording."""

from __future__ import annotations

from armid_ros.identification.rows.checks import MIN_DURATION, position_problem, REST_RANGE, SILENT
from armid_ros.identification.samples.spikes import SpikeGate
from armid_ros.robots import Robot
import numpy as np


class StreamChecks:
    """
    Checks of a stream of joint states for faults, such as constant torques or wrong units.

    Parameters
    ----------
    robot : Robot
        The robot, with its joint limits.
    gate : SpikeGate
        Gate with the ranges of positions and torques so far.

    """

    def __init__(self, robot: Robot, gate: SpikeGate) -> None:
        self._robot, self._gate = robot, gate
        self._moved: float | None = None
        self._moving = 0.0
        self._judged: tuple[bytes, str] | None = None
        #: Whether all measured torques had been constant when `error` was last read.
        self.silent = True

    def take(self, t: float) -> None:
        """Update the duration since the first motion, by the time stamp of a valid sample [s]."""
        if self._moved is None:
            positions = slice(self._robot.n_joints)
            ranges = self._gate.highest[positions] - self._gate.lowest[positions]
            self._moved = t if np.any(ranges > REST_RANGE) else None
        self._moving = 0.0 if self._moved is None else t - self._moved

    @property
    def error(self) -> str:
        """Return the fault that prevents identification; empty if there is none."""
        lowest, highest, n = self._gate.lowest, self._gate.highest, self._robot.n_joints
        self.silent = self.silent and bool((highest[-n:] <= lowest[-n:]).all())
        if self.silent and abs(self._moving) > MIN_DURATION:
            return SILENT
        # the ranges are checked at each row, but seldom increase
        ranged = lowest[:n].tobytes() + highest[:n].tobytes()
        if self._judged is None or self._judged[0] != ranged:
            self._judged = ranged, position_problem(self._robot, lowest[:n], highest[:n])
        return self._judged[1]


class MissingSamples:
    """
    Count of missing samples in a stream, computed from time stamps.

    A delayed sample that is followed by early samples is not missing.

    Attributes
    ----------
    count : int
        Number of missing samples, those of a stopped stream excluded.

    """

    def __init__(self) -> None:
        self.count = 0
        self._last: float | None = None
        self._doubtful = 0

    def take(self, t: float, period: float | None) -> None:
        """Update the count with a time stamp [s] and, once known, the sampling period [s]."""
        last = self._last
        # a timestamp more than 1 s before the last one belongs to a restarted clock
        if last is not None and last - 1.0 < t <= last:
            self._subtract_late()
            return
        self._last = t
        # after 10 s without samples, the stream was stopped and no sample is missing
        if last is None or period is None or not 0.0 < t - last < 10.0:
            self._doubtful = 0
            return
        steps = (t - last) / period
        if steps >= 1.5:
            self._doubtful = round(steps) - 1
            self.count += self._doubtful
        elif steps <= 0.5:
            self._subtract_late()
        else:
            self._doubtful = 0

    def _subtract_late(self) -> None:
        """Reduce the count by 1 for a sample that arrives late."""
        if self._doubtful:
            self._doubtful -= 1
            self.count -= 1
