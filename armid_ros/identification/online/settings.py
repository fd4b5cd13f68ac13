# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings of online identification, and its torque prediction for one sample."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Mean time between two alarms of an arm that does not change [s].
FALSE_ALARM_TIME = 100.0 * 3600.0


@dataclass(frozen=True)
class OnlineSettings:
    """
    Settings of the online identification.

    Attributes
    ----------
    cutoff : float
        Frequency of the low-pass on torque and regressor rows [Hz]. Well above the motion, whose
        fastest part carries the inertial torque, and below disturbances of the torque signal.
    forgetting : float
        Forgetting factor per used sample, 0.9 to 1. A memory of T seconds is 1 - 1 / (T row_rate).
    torque_noise : tuple of float or None
        Standard deviation of the noise in single torque samples, per joint [N m]. Without it the
        noise is proportional to the torque limits and its size is taken from the residuals.
    max_gap : int
        Missing samples that are interpolated across; a longer gap restarts the filters.
    measured_velocity : bool
        Differentiate the measured velocity instead of the position.
    false_alarm_time : float or None
        Mean time between two alarms of an arm that does not change [s]; None: no change detection.

    """

    cutoff: float = 5.0
    forgetting: float = 1.0
    torque_noise: tuple[float, ...] | None = None
    max_gap: int = 10
    measured_velocity: bool = False
    false_alarm_time: float | None = FALSE_ALARM_TIME

    def __post_init__(self) -> None:
        """Raise an error unless the time between false alarms is positive."""
        if self.false_alarm_time is not None and not self.false_alarm_time > 0.0:
            raise IdentificationError(
                f'false_alarm_time is {self.false_alarm_time} s, but has to be above 0; None '
                'switches the detection of changes off'
            )

    @property
    def row_rate(self) -> float:
        """Samples that the estimator uses per second [1/s]."""
        # 40 rows resolve the steps of sign(dq), and aliases of the motion filter are outside the
        # band of the row filter
        return 40.0 * self.cutoff


@dataclass(frozen=True)
class OnlineSample:
    """
    Measured and predicted torques of a sample, and a mask of the used joints.

    Attributes
    ----------
    t : float
        Time of the sample [s]: the stamp of the newest joint state minus the delay of the filters.
    measured : ndarray, shape (n,)
        Filtered measured torque [N m].
    predicted : ndarray, shape (n,)
        Torque that the estimate before this sample predicts, filtered alike [N m].
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
