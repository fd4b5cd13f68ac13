# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What another machine did while an arm was recorded: a person in an exoskeleton, a second arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

if TYPE_CHECKING:
    from armid_ros.model.spring_ties import Tie
    from armid_ros.recording.recording import Recording

#: A step of this many nominal periods of the other machine is a hole that nothing bridges.
_HOLE = 5.0
#: Samples in common that are any use.
_LEAST = 4


@dataclass(frozen=True, eq=False)
class PartnerMotion:
    """
    Positions of another machine at the samples of a recording.

    Attributes
    ----------
    robot : Robot
        Its description; its base frame is that of the arm.
    ties : tuple of Tie
        Where the two may be tied.
    q : ndarray, shape (N, m)
        Its joint positions [rad or m].

    """

    robot: Robot
    ties: tuple[Tie, ...]
    q: FloatArray

    def __post_init__(self) -> None:
        """Freeze the positions."""
        object.__setattr__(self, 'q', read_only(self.q))

    def select(
        self, samples: slice | npt.NDArray[np.intp] | npt.NDArray[np.bool_]
    ) -> PartnerMotion:
        """Return it at some of the samples."""
        return replace(self, q=self.q[samples])


def recorded_together(
    recording: Recording, other: Recording, robot: Robot, ties: Sequence[Tie] = ()
) -> Recording:
    """
    Add the motion of another machine to a recording, at its stamps.

    Parameters
    ----------
    recording : Recording
        Of the arm.
    other : Recording
        Of the other machine, on the same clock.
    robot : Robot
        Its description.
    ties : sequence of Tie
        Where the two may be tied.

    Returns
    -------
    Recording
        Of the arm, where both were recorded.

    Raises
    ------
    RecordingError
        If the two have no time in common.

    """
    t = recording.t + 1e-9 * (recording.start_ns - other.start_ns)
    inside = (t >= other.t[0]) & (t <= other.t[-1])
    steps = np.diff(other.t)
    after = np.clip(np.searchsorted(other.t, t), 1, len(steps))
    inside &= steps[after - 1] <= _HOLE * other.period
    if np.count_nonzero(inside) < _LEAST:
        raise RecordingError(
            f'{recording.source}: {recording.topic} and {other.topic} have no time in common; '
            'record them together'
        )
    q = CubicSpline(other.t, other.q)(t[inside])
    return replace(recording.select(inside), partner=PartnerMotion(robot, tuple(ties), q))
