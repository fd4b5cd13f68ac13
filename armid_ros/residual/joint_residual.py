# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The learned map and law of the residual of one joint."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.effects.learned import TorqueMap
from armid_ros.motion import FloatArray
from armid_ros.residual.law import Law
import numpy as np


@dataclass(frozen=True)
class JointResidual:
    """
    The learned map and the suggested law of one joint.

    Attributes
    ----------
    joint : str
        The joint.
    learned : TorqueMap
        The map.
    ranges : ndarray, shape (3, 2)
        Smallest and largest position, velocity and load in the data.
    before, after : float
        Root mean square of the residual without and with the map [N m].
    gain : float
        Share of the squared residual that the map predicts in held-out data: blocks left out in
        turn, and samples of held-out recordings near the training data.
    held_out : float or None
        The same share for held-out recordings alone; None if none is near the training data.
    law : Law or None
        Suggested law; None if no law approximates the residual.

    """

    joint: str
    learned: TorqueMap
    ranges: FloatArray
    before: float
    after: float
    gain: float
    held_out: float | None
    law: Law | None

    def axis(self, number: int, count: int) -> FloatArray:
        """Return evenly spaced values over the range of an input, shape (count,)."""
        return np.linspace(float(self.ranges[number, 0]), float(self.ranges[number, 1]), count)
