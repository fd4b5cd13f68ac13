# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a stream has to be like to identify anything; as a recording, see `checks`."""

from __future__ import annotations

from armid_ros.identification.rows.checks import position_problem, REST_RANGE, SHORTEST, SILENT
from armid_ros.identification.samples.spikes import SpikeGate
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

#: Who is silent for longer has stopped, and nothing is lost [s].
_SILENCE = 10.0
#: A stamp that is further back is of a time that begins anew [s].
_BEHIND = 1.0


class StreamChecks:
    """
    Checks whether a stream is identifiable, by the ranges of its good samples.

    Parameters
    ----------
    robot : Robot
        Gives the limits.
    gate : SpikeGate
        Knows from where to where positions and torques range.

    """

    def __init__(self, robot: Robot, gate: SpikeGate) -> None:
        self._robot, self._gate = robot, gate
        self.reset()

    def reset(self) -> None:
        """Clear the time of the first motion."""
        self._moved: float | None = None
        self._moving = 0.0
        self._judged: tuple[bytes, str] | None = None

    def take(self, t: float) -> None:
        """Add the timestamp of an undamaged sample."""
        if self._moved is None:
            lowest, highest = self._positions
            self._moved = t if np.any(highest - lowest > REST_RANGE) else None
        self._moving = 0.0 if self._moved is None else t - self._moved

    @property
    def _positions(self) -> tuple[FloatArray, FloatArray]:
        n = self._robot.n_joints
        return self._gate.lowest[:n], self._gate.highest[:n]

    @property
    def silent(self) -> bool:
        """Whether all torques have been constant so far."""
        n = self._robot.n_joints
        return bool((self._gate.highest[-n:] <= self._gate.lowest[-n:]).all())

    @property
    def error(self) -> str:
        """Return the fault that prevents identification; empty without fault."""
        if self.silent and abs(self._moving) > SHORTEST:
            return SILENT
        # the range is judged for each row, and seldom grows
        lowest, highest = self._positions
        ranged = lowest.tobytes() + highest.tobytes()
        if self._judged is None or self._judged[0] != ranged:
            self._judged = ranged, position_problem(self._robot, lowest, highest)
        return self._judged[1]


class MissingSamples:
    """
    Counts missing samples by the timestamps.

    Where a sample is late and those after it are early, nothing is missing.

    Attributes
    ----------
    count : int
        Samples that never came; those of a longer silence are not counted.

    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Set the count to zero."""
        self.count = 0
        self._last: float | None = None
        self._doubtful = 0

    def take(self, t: float, period: float | None) -> None:
        """Add a timestamp [s], with the sampling period if known."""
        last = self._last
        if last is not None and last - _BEHIND < t <= last:
            self._came_late()
            return
        self._last = t
        if last is None or period is None or not 0.0 < t - last < _SILENCE:
            self._doubtful = 0
            return
        steps = (t - last) / period
        if steps >= 1.5:
            self._doubtful = round(steps) - 1
            self.count += self._doubtful
        elif steps <= 0.5:
            self._came_late()
        else:
            self._doubtful = 0

    def _came_late(self) -> None:
        """Remove one of the samples counted last."""
        if self._doubtful:
            self._doubtful -= 1
            self.count -= 1
