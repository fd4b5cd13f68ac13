# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an online identifier makes of one sample."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class OnlineSample:
    """
    One sample that the estimator saw.

    Attributes
    ----------
    t : float
        When it was [s]: the stamp of the newest joint state minus the delay of the filters.
    measured : ndarray, shape (n,)
        Filtered measured torque [N m].
    predicted : ndarray, shape (n,)
        What the estimate before this sample predicts, filtered alike [N m].
    used : ndarray of bool, shape (n,)
        False for a joint at rest, which friction may hold with any torque.

    """

    t: float
    measured: FloatArray
    predicted: FloatArray
    used: npt.NDArray[np.bool_]

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted torque, shape (n,) [N m]."""
        return self.measured - self.predicted
