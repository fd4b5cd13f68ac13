# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How parameters are estimated online."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.errors import IdentificationError
from armid_ros.identification.online.change_watch import ChangeSettings
from armid_ros.identification.rows.causal import ROW_RATE_RATIO
import numpy as np


@dataclass(frozen=True)
class OnlineSettings:
    """
    How parameters are estimated online.

    Attributes
    ----------
    cutoff : float
        Frequency of the low-pass on torque and regressor rows [Hz]. Well above the motion, as
        the inertial torque is in the motion's fastest part; below what shakes the torque signal.
    row_rate : float or None
        Rows used per second [1/s]; 40 times the cut-off frequency by default. The rows between
        them are nearly the same once filtered, so they would cost time and teach nothing.
    forgetting : float
        Forgetting factor per row used, 0.9 to 1. A memory of T seconds is 1 - 1 / (T row_rate).
    torque_noise : tuple of float or None
        Standard deviation of the noise in single torque samples, per joint [N m]. Without it the
        noise is proportional to the torque limits and its size is taken from the residuals.
    max_gap : int
        Missing samples that are interpolated across; a longer gap restarts the filters.
    measured_velocity : bool
        Differentiate the measured velocity instead of the position.
    changes : ChangeSettings or None
        How readily a change of the arm is believed; None does not look for any.

    """

    cutoff: float = 5.0
    row_rate: float | None = None
    forgetting: float = 1.0
    torque_noise: tuple[float, ...] | None = None
    max_gap: int = 10
    measured_velocity: bool = False
    changes: ChangeSettings | None = field(default_factory=ChangeSettings)

    def rows_per_second(self) -> float:
        """
        Return the rate of the rows [1/s].

        Raises
        ------
        IdentificationError
            If it is too low for the cut-off frequency.

        """
        rate = ROW_RATE_RATIO * self.cutoff if self.row_rate is None else self.row_rate
        if not (np.isfinite(rate) and rate >= 2.0 * self.cutoff):
            raise IdentificationError(
                f'{rate} rows per second: a cut-off frequency of {self.cutoff:g} Hz needs at '
                f'least {2.0 * self.cutoff:g}'
            )
        return rate
