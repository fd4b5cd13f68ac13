# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What another machine did while an arm was recorded: a person in an exoskeleton, a second arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from armid_ros.model.spring_ties import Tie


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
