# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The limits as smooth constraints on the Fourier coefficients.

Each limit of each joint is one constraint, c <= 0: the soft maximum (Kreisselmeier and Steinhauser
1979) of its excess over all samples, relative to the limit. A soft maximum is never below the
maximum, so that a trajectory that meets the constraints keeps the limits in every sample. It
exceeds the maximum by at most log(samples) / sharpness.

"""

from __future__ import annotations

from collections.abc import Callable

from armid_ros.arm import TorqueSlope
from armid_ros.excitation.fourier import fourier_basis
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.problem import DesignProblem
from armid_ros.motion import FloatArray, Motion
import numpy as np
import numpy.typing as npt

#: Change of the clearance that changes a constraint by one unit [m].
_CLEARANCE_UNIT = 0.1

#: Distance beyond the margin, in these units, above which bodies are ignored. At a sharpness of
#: 60, their weight in the soft maximum is exp(-36).
_CLEARANCE_REACH = 0.6

#: Number of stretches of the period, each with its own clearance constraint, so that a step of the
#: solver avoids several close approaches at once.
_STRETCHES = 20


#: Values of some constraints, and a function that computes their gradients.
Part = tuple[FloatArray, Callable[[], FloatArray]]


class Constraints:
    """
    Position, velocity, acceleration, torque and clearance as functions of the coefficients.

    Parameters
    ----------
    problem : DesignProblem
        Problem with the limits and the prior model.
    clearance : ClearanceModel or None
        Bodies to keep apart.
    margin : float
        Clearance to keep [m].
    reserve : float
        Share of every limit that is kept free for peaks between the samples.
    sharpness : float
        Sharpness of the soft maximum.
    more_times : ndarray
        Additional times at which torque and clearance are evaluated [s].

    """

    def __init__(
        self,
        problem: DesignProblem,
        clearance: ClearanceModel | None,
        *,
        margin: float,
        reserve: float,
        sharpness: float,
        more_times: FloatArray,
    ) -> None:
        self.problem, self.clearance, self.margin = problem, clearance, margin
        self.reserve, self.sharpness = reserve, sharpness
        period, harmonics = problem.settings.period, problem.settings.harmonics
        samples = problem.settings.samples
        # samples for position, velocity and acceleration, and for torque and clearance
        dense: FloatArray = np.linspace(0.0, period, 5 * samples, endpoint=False)
        states: FloatArray = np.linspace(0.0, period, 3 * samples, endpoint=False)
        self.dense = fourier_basis(dense, period, harmonics)
        self.t = np.unique(np.concatenate([states, more_times]))
        self.basis = fourier_basis(self.t, period, harmonics)

    def value(self, x: FloatArray) -> Part:
        """
        Return the constraints, and a function that computes their gradients.

        Parameters
        ----------
        x : ndarray, shape (n, 1 + 2 H)
            Coefficients.

        Returns
        -------
        values : ndarray, shape (m,)
            Zero or negative if the limit is kept.
        gradients : callable () -> ndarray, shape (m, n, 1 + 2 H)
            Derivatives by the coefficients; evaluated only when needed, because a line search
            rarely needs them.

        """
        limits = self.problem.limits
        span = limits.upper - limits.lower
        span = np.where(np.isfinite(span), span, 1.0)
        q, dq, ddq = self.dense
        velocity, acceleration = limits.velocity, limits.acceleration
        parts = [
            self._own_joint(q, x, limits.lower, limits.upper, span),
            self._own_joint(dq, x, -velocity, velocity, velocity),
            self._own_joint(ddq, x, -acceleration, acceleration, acceleration),
        ]
        motion = Motion(limits.joints, self.t, *(basis @ x.T for basis in self.basis))
        if np.isfinite(limits.torque).any():
            parts.append(self._torque(motion))
        if self.clearance is not None and len(self.clearance.pairs):
            parts.append(self._clear(motion))
        return (
            np.concatenate([values for values, _ in parts]),
            lambda: np.concatenate([gradients() for _, gradients in parts]),
        )

    def _own_joint(
        self,
        basis: FloatArray,
        x: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        unit: FloatArray,
    ) -> Part:
        """Return constraints on quantities that depend on the coefficients of one joint only."""
        values = basis @ x.T
        limited, totals, signed = self._between(values, lower, upper, unit)

        def gradients() -> FloatArray:
            result = np.zeros((len(limited), values.shape[1], basis.shape[1]))
            result[np.arange(len(limited)), limited] = signed @ basis
            return result

        return totals, gradients

    def _torque(self, motion: Motion) -> Part:
        arm, limits = self.problem.arm, self.problem.limits
        torque = arm.joint_torque(motion)
        one = np.ones(len(limits.joints))
        most = np.where(np.isfinite(limits.torque), one, np.inf)
        limited, totals, signed = self._between(torque / limits.torque, -most, most, one)
        of_torque = np.zeros((len(limited), *torque.shape))
        of_torque[np.arange(len(limited)), :, limited] = (
            signed / limits.torque[limited, np.newaxis]
        )

        def gradients() -> FloatArray:
            slope = TorqueSlope.of(arm, motion)
            result = np.empty((len(limited), motion.n_joints, self.basis[0].shape[1]))
            for row, weights in enumerate(of_torque):
                result[row] = sum(
                    by.T @ basis
                    for by, basis in zip(slope.pullback(weights), self.basis, strict=True)
                )
            return result

        return totals, gradients

    def _clear(self, motion: Motion) -> Part:
        """Return one clearance constraint for every stretch of the period."""
        assert self.clearance is not None
        near = self.clearance.near(motion.q, self.margin + _CLEARANCE_REACH * _CLEARANCE_UNIT)
        stretch = self.t[near.sample] * (_STRETCHES / self.problem.settings.period)
        totals = np.full(_STRETCHES, -_CLEARANCE_REACH)
        weighted: list[tuple[int, npt.NDArray[np.intp], FloatArray]] = []
        for number in range(_STRETCHES):
            rows = np.flatnonzero(stretch.astype(int) == number)
            if len(rows):
                lack = (self.margin - near.distance[rows]) / _CLEARANCE_UNIT
                totals[number], weights = self._soft_maximum(lack)
                weighted.append((number, rows, -weights[:, np.newaxis] / _CLEARANCE_UNIT))

        def gradients() -> FloatArray:
            result = np.zeros((_STRETCHES, motion.n_joints, self.basis[0].shape[1]))
            for number, rows, weights in weighted:
                result[number] = (weights * near.by_q[rows]).T @ self.basis[0][near.sample[rows]]
            return result

        return totals, gradients

    def _between(
        self, values: FloatArray, lower: FloatArray, upper: FloatArray, unit: FloatArray
    ) -> tuple[npt.NDArray[np.intp], FloatArray, FloatArray]:
        """Return the limited joints, their soft maxima, and the derivatives by the values."""
        limited = np.flatnonzero(np.isfinite(lower) | np.isfinite(upper))
        signed = np.empty((len(limited), len(values)))
        totals = np.empty(len(limited))
        for row, j in enumerate(limited):
            over, under = values[:, j] - upper[j], lower[j] - values[:, j]
            excess = np.concatenate([over, under]) / unit[j] + self.reserve
            totals[row], weights = self._soft_maximum(excess)
            signed[row] = (weights[: len(values)] - weights[len(values) :]) / unit[j]
        return limited, totals, signed

    def _soft_maximum(self, excess: FloatArray) -> tuple[float, FloatArray]:
        largest = excess.max()
        weights = np.exp(self.sharpness * (excess - largest))
        total = weights.sum()
        return float(largest + np.log(total) / self.sharpness), weights / total
