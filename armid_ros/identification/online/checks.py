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
    Whether anything can be learned from a stream, by how far its good samples have ranged.

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
        """Forget when the arm began to move."""
        self._moved: float | None = None
        self._moving = 0.0
        self._judged: tuple[bytes, str] | None = None

    def take(self, t: float) -> None:
        """Take in the stamp of a sample that is not damaged."""
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
        """Whether no torque has ever changed, so that nothing can be learned from it."""
        n = self._robot.n_joints
        return bool((self._gate.highest[-n:] <= self._gate.lowest[-n:]).all())

    @property
    def error(self) -> str:
        """Return what to mend before anything can be identified; empty when all is well."""
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
    Count the samples that should have come between others, by their stamps.

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
        """Take in a stamp [s], with the sampling period if it is known."""
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
        """Take back one of those that were counted last."""
        if self._doubtful:
            self._doubtful -= 1
            self.count -= 1
