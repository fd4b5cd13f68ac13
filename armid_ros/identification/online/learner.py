# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Online estimate, updated with each row in two steps.

The prediction of a row by the estimate before it is needed at once. The update with the row may
wait for the next sample, which usually brings no row, so no sample has to do both. Reading the
estimate runs a pending update first.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.online.background import Background
from armid_ros.identification.online.change import Change, change_candidates
from armid_ros.identification.online.change_watch import ChangeSettings, ChangeWatch
from armid_ros.identification.online.nuisance_rows import NuisanceRows, Row
from armid_ros.identification.online.recursive import RecursiveLeastSquares
from armid_ros.identification.online.robust_covariance import RobustCovariance
from armid_ros.identification.rows.causal import ROW_RATE_RATIO, sensor_noise
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np

#: Length of the windows for the spectrum of the errors [s], beyond their correlation time.
_WINDOW = 4.0
#: Lower bound of a divisor.
_SMALLEST = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class OnlineSettings:
    """
    Settings of online estimation.

    Attributes
    ----------
    cutoff : float
        Frequency of the low-pass on torque and regressor rows [Hz]. Well above the motion, whose
        fastest part carries the inertial torque, and below disturbances of the torque signal.
    row_rate : float or None
        Rows used per second [1/s]; 40 times the cut-off frequency by default. After the filter,
        the rows between them are nearly the same, so they would add only computing time.
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
        Settings of change detection; None disables it.

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


class Learner:
    """
    Estimator of base parameters with their covariance, and of changes.

    Parameters
    ----------
    arm : ArmModel
        Robot and effects.
    base : BaseParameters
        The estimated base parameters.
    settings : OnlineSettings
        Weights and forgetting.
    work : Background
        Queue for long computations.

    """

    def __init__(
        self, arm: ArmModel, base: BaseParameters, settings: OnlineSettings, work: Background
    ) -> None:
        self._estimator = RecursiveLeastSquares(
            base.parameters,
            sensor_noise(arm.robot, settings.torque_noise),
            forgetting=settings.forgetting,
            start=base.values(arm.theta),
            scale_covariance=settings.torque_noise is None,
        )
        window = max(1, round(_WINDOW * settings.rows_per_second()))
        self._scores = RobustCovariance(window, settings.forgetting, work)
        self._watch = None
        if settings.changes is not None:
            self._watch = ChangeWatch(
                self._estimator,
                NuisanceRows(arm, settings.cutoff),
                change_candidates(arm, base),
                settings.changes,
                work,
            )
        self._joints = arm.robot.n_joints
        self.reset()

    def reset(self) -> None:
        """Clear everything; no background job may be pending."""
        self._waiting: tuple[Row, FloatArray] | None = None
        self._reopened = 0
        # of residuals: weighted squares, their weights, and the standard deviation
        self._squares, self._counts, self._deviation = np.zeros((3, self._joints))
        self._estimator.reset()
        self._scores.reset()
        if self._watch is not None:
            self._watch.reset()

    def use(self, settings: OnlineSettings) -> None:
        """Change the forgetting factor and the change detection."""
        self.settle()
        self._estimator.forgetting = self._scores.forgetting = settings.forgetting
        if self._watch is not None:
            self._watch.use(settings.changes, settings.forgetting)

    def interrupt(self) -> None:
        """Begin a new stretch of rows after an interruption."""
        self.settle()
        self._scores.interrupt()
        if self._watch is not None:
            self._watch.interrupt()

    def predict(self, row: Row) -> FloatArray:
        """Add a row; return its innovation, the prediction error of the estimate before it."""
        self.settle()
        innovation = row.sample.tau - row.sample.rows @ self._estimator.values
        self._waiting = row, innovation
        return innovation

    def settle(self) -> bool:
        """Update the estimate with the pending row; return whether there was one."""
        if self._waiting is None:
            return False
        (row, innovation), self._waiting = self._waiting, None
        sample, estimator = row.sample, self._estimator
        if self._watch is None:
            estimator.update(*sample)
        else:
            self._watch.update(row)
            for change in self._watch.changes[self._reopened :]:
                self._scores.reopen(change.reopened, estimator.values)
                self._reopened += 1
        left = sample.tau - sample.rows @ estimator.values
        self._squares = estimator.forgetting * self._squares + sample.weights * innovation * left
        self._counts = estimator.forgetting * self._counts + sample.weights
        known = np.maximum(self._counts, _SMALLEST)
        self._deviation = np.sqrt(np.maximum(self._squares, 0.0) / known)
        scale = estimator.scale(sample.weights)
        self._scores.add(sample.rows * scale[:, None], sample.tau * scale, estimator.values)
        return True

    @property
    def watches(self) -> bool:
        """Whether changes are detected."""
        return self._watch is not None

    @property
    def residual_deviation(self) -> FloatArray:
        """Return the residual standard deviation, as noise of single samples, (n,) [N m]."""
        self.settle()
        return self._deviation

    @property
    def values(self) -> FloatArray:
        """Estimated parameters, shape (P,)."""
        self.settle()
        return self._estimator.values

    @property
    def estimate(self) -> Estimate:
        """Values and covariance, with autocorrelated errors included."""
        self.settle()
        estimate = self._estimator.estimate
        covariance = self._scores.covariance(self._estimator.learned().root)
        return estimate if covariance is None else replace(estimate, covariance=covariance)

    @property
    def changes(self) -> Sequence[Change]:
        """Return the detected changes, oldest first; detection runs in the background."""
        return () if self._watch is None else self._watch.changes

    @property
    def condition_number(self) -> float:
        """Condition number of the weighted regressor so far; takes a millisecond."""
        self.settle()
        return self._estimator.condition_number

    @property
    def samples(self) -> int:
        """Return the number of samples in the estimate."""
        self.settle()
        return self._estimator.samples
