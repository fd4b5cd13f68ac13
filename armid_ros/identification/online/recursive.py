# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recursive least squares in square-root information form.

The state is the triangle R and the vector z of the QR factorisation of all weighted rows so far.
Without forgetting, the estimate equals the batch solution at any number of samples. The covariance
R^-1 R^-T cannot lose its symmetry or become negative (Bierman 1977, chapter V): Householder
reflections add rows and keep R^T R exact.

Forgetting is directional (Kulhavy and Karny 1984): old information is removed only in directions
of the new sample, and at most as much as the sample adds. The covariance therefore never grows. A
direction without excitation keeps its value and its information, even if an arm rests for hours.
As a disadvantage, weak motion replaces the information of an earlier, stronger motion slowly.

"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.model.compiled import kernel
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy.linalg import lapack

#: Smallest forgetting factor; with less, the memory is shorter than ten samples.
MIN_FORGETTING = 0.9
#: Standard deviation of every parameter before the first sample, in its SI unit. Robots have
#: parameters of 1e-4 to 1e3; a parameter that the data do not identify keeps this deviation.
PRIOR_STD = 1e6
#: Columns of a Householder block; the fastest for 60 to 120 parameters.
_BLOCK_COLUMNS = 8
#: Number of rows above which LAPACK is faster than the compiled kernel.
_MOST_ROWS_OF_KERNEL = 24


class WeightedSample(NamedTuple):
    """
    Regressor rows, torques and weights of one sample.

    Attributes
    ----------
    rows : ndarray, shape (m, P)
        Sensitivity of the torques to the parameters.
    tau, weights : ndarray, shape (m,)
        Measured torque [N m], and independent observations that each row stands for.

    """

    rows: FloatArray
    tau: FloatArray
    weights: FloatArray


class RecursiveLeastSquares:
    """
    Recursive least-squares estimate of theta in tau = rows @ theta + noise.

    Parameters
    ----------
    parameters : tuple of ParameterName
        Names of the P parameters.
    noise : array_like, shape (m,)
        Standard deviation of the noise of the m rows of a sample, usually one per joint [N m].
    forgetting : float
        1: all samples are kept. Below 1, a permanently excited direction is estimated from
        about the last 1 / (1 - forgetting) samples.
    start : array_like, shape (P,), optional
        Prior mean, zero by default. The prior standard deviation PRIOR_STD is so large that the
        prior is negligible once a parameter is excited.
    scale_covariance : bool
        Whether the noise is known up to a factor only, the covariance being multiplied by
        ``variance_factor``.

    Raises
    ------
    IdentificationError
        If the noise or the forgetting factor cannot be used.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Names of the P parameters.
    noise_is_relative : bool
        Whether the noise is known up to a factor only.
    samples : int
        Number of samples used.

    """

    _root: FloatArray
    _right: FloatArray
    _values: FloatArray

    def __init__(
        self,
        parameters: tuple[ParameterName, ...],
        noise: npt.ArrayLike,
        *,
        forgetting: float = 1.0,
        start: npt.ArrayLike | None = None,
        scale_covariance: bool = False,
    ) -> None:
        check_forgetting(forgetting)
        self.parameters = parameters
        self.samples = 0
        self._forgetting = float(forgetting)
        self._noise = np.array(noise, dtype=np.float64)
        if self._noise.ndim != 1 or not np.all((self._noise > 0.0) & (self._noise < np.inf)):
            raise IdentificationError(
                f'noise is {self._noise}, but has to be a finite standard deviation above 0 for '
                'each joint'
            )
        self.noise_is_relative = scale_covariance
        count = len(parameters)
        self._start = np.zeros(count) if start is None else np.asarray(start, dtype=np.float64)
        self._take(np.asfortranarray(np.eye(count) / PRIOR_STD), self._start)
        self._squares = 0.0
        # the first P observations are fitted exactly and contain no information on noise
        self._freedom = -float(count)

    def with_more(self, parameters: tuple[ParameterName, ...]) -> RecursiveLeastSquares:
        """Return a new estimator with additional parameters, which start at 0."""
        return RecursiveLeastSquares(
            self.parameters + parameters,
            self._noise,
            forgetting=self._forgetting,
            start=np.concatenate([self._start, np.zeros(len(parameters))]),
            scale_covariance=self.noise_is_relative,
        )

    def restricted(self, count: int) -> RecursiveLeastSquares:
        """Return the estimator of the first `count` parameters; the others are fixed to zero."""
        fewer = copy(self)
        fewer.parameters, fewer._start = self.parameters[:count], self._start[:count]
        root, right = self._root[:count, :count].copy('F'), self._root @ self._values
        fewer._take(root, lapack.dtrtrs(root, right[:count, np.newaxis])[0][:, 0])
        fewer._squares += float(np.sum(right[count:] ** 2))
        fewer._freedom += len(self.parameters) - count
        return fewer

    def update(
        self,
        rows: FloatArray,
        tau: FloatArray,
        weights: npt.ArrayLike | None = None,
    ) -> None:
        """
        Update the estimate with one sample, or with several samples at once.

        Parameters
        ----------
        rows : ndarray, shape (m, P)
            Sensitivity of the torques to the parameters; several samples are stacked.
        tau : ndarray, shape (m,)
            Measured torque [N m].
        weights : array_like, shape (m,), optional
            Independent observations that each row stands for: 0 for a row not to be used, less
            than 1 for one of many filtered rows that share their noise. Ones by default.

        """
        counts = np.ones(len(tau)) if weights is None else np.asarray(weights)
        by_sample = counts.reshape(-1, len(self._noise))
        used = sum(map(any, by_sample.tolist()))
        if not used:
            return
        scale = self.scale(by_sample).reshape(-1)
        rows, tau = rows * scale[:, np.newaxis], tau * scale
        if self._forgetting < 1.0:
            innovation = tau - rows @ self._values
            self._root = forget_and_add(self._root, rows, self._forgetting)
            half, _ = lapack.dtrtrs(self._root, (rows.T @ innovation)[:, np.newaxis], trans=1)
            self._values = self._values + lapack.dtrtrs(self._root, half)[0][:, 0]
            self._squares *= self._forgetting
            self._freedom *= self._forgetting
            self._squares += float(innovation @ (tau - rows @ self._values))
        else:
            self._squares += self._add(rows, tau)
        self._freedom += float(counts.sum())
        self.samples += used

    def _add(self, rows: FloatArray, tau: FloatArray) -> float:
        """Add rows of unit noise to R theta = z by reflections; return their squared residuals."""
        library, size = kernel(), len(self._root)
        if library is not None and len(rows) <= _MOST_ROWS_OF_KERNEL:
            self._values = np.empty(size)
            arrays = self._root, self._right, np.ascontiguousarray(rows), tau, self._values
            return float(library.add_rows(size, len(rows), *library.addresses(*arrays)))
        self._root, reflectors, factors, _ = lapack.dtpqrt(
            0, min(_BLOCK_COLUMNS, size), self._root, rows, overwrite_a=1
        )
        self._right, rest, _ = lapack.dtpmqrt(
            *(0, reflectors, factors, self._right, tau[:, np.newaxis]), trans='T', overwrite_a=1
        )
        self._values = lapack.dtrtrs(self._root, self._right)[0][:, 0]
        return float(np.sum(rest**2))

    def update_together(self, samples: Sequence[WeightedSample]) -> None:
        """
        Update the estimate with several samples, which is faster than one update per sample.

        Without forgetting, the estimate is the same. With forgetting, each sample has its own
        update, as the forgotten information depends on the order.

        """
        if self._forgetting < 1.0:
            for sample in samples:
                self.update(*sample)
        else:
            self.update(*(np.concatenate(part) for part in zip(*samples, strict=True)))

    def scale(self, weights: FloatArray) -> FloatArray:
        """Return factors (m,) that scale weighted rows to unit noise [1/(N m)]."""
        return np.asarray(np.sqrt(weights) / self._noise)

    def copied(self) -> RecursiveLeastSquares:
        """Return an independent copy of the estimator."""
        other = copy(self)
        other._root, other._right = self._root.copy('F'), self._right.copy('F')
        return other

    def restore(self, other: RecursiveLeastSquares) -> None:
        """Copy the state of another estimator of the same parameters."""
        self._take(other._root.copy('F'), other._values)
        self._squares, self._freedom = other._squares, other._freedom
        self.samples = other.samples

    def forget_directions(self, directions: FloatArray) -> None:
        """
        Forget the information on `directions`, combinations of parameters.

        Parameters
        ----------
        directions : ndarray, shape (P, k)
            Independent combinations of parameters that may have changed.

        """
        # The parameters become theta + directions delta, where nothing is known of delta: R theta
        # = z is stacked with delta = 0 within PRIOR_STD, and reflections eliminate delta.
        size, count = directions.shape
        unit = directions / np.linalg.norm(directions, axis=0)
        stacked = np.zeros((size + count, count + size))
        stacked[:size, :count], stacked[:size, count:] = -self._root @ unit, self._root
        stacked[size:, :count] = np.eye(count) / PRIOR_STD
        triangle = np.asarray(np.linalg.qr(stacked, mode='r'))
        self._take(np.asfortranarray(triangle[count:, count:]), self._values)
        self._freedom -= count

    @property
    def forgetting(self) -> float:
        """Return the forgetting factor, which may be set at any time."""
        return self._forgetting

    @forgetting.setter
    def forgetting(self, factor: float) -> None:
        check_forgetting(factor)
        self._forgetting = factor
        self._take(self._root, self._values)  # R theta is not updated while samples are forgotten

    @property
    def root(self) -> FloatArray:
        """Return the triangular factor R of the information matrix R^T R, without a copy."""
        return self._root

    @property
    def values(self) -> FloatArray:
        """Return the estimated parameters, shape (P,)."""
        return self._values

    @property
    def covariance(self) -> FloatArray:
        """Return the covariance of the estimated parameters, shape (P, P)."""
        factor = self.variance_factor if self.noise_is_relative else 1.0
        inverse, _ = lapack.dtrtri(self._root)
        return np.asarray(inverse @ inverse.T * factor)

    @property
    def variance_factor(self) -> float:
        """
        Return the variance of the weighted residuals, which is 1 if the assumed noise is right.

        It is also 1 while there are no more observations than parameters.

        """
        return self._squares / self._freedom if self._freedom >= 1.0 else 1.0

    @property
    def condition_number(self) -> float:
        """Return the condition number of the weighted regressor of all samples."""
        singular = np.linalg.svd(self._root, compute_uv=False)
        return float(singular[0] / singular[-1])

    @property
    def estimate(self) -> Estimate:
        """Return the estimated parameters with names and covariance."""
        return Estimate(self.parameters, self._values.copy(), self.covariance)

    def _take(self, root: FloatArray, values: FloatArray) -> None:
        """Set the triangular factor R and the estimate theta, and compute R theta."""
        self._root, self._values = root, values
        self._right = np.asfortranarray((root @ values)[:, np.newaxis])


def forget_and_add(root: FloatArray, rows: FloatArray, forgetting: float) -> FloatArray:
    """
    Add rows to the triangular factor R, forget old information in their directions; return R.

    In the directions b of U = rows R^-1 = A diag(s) B^T the old information, 1, becomes
    1 - f + s^2 with f = min(s^2, level). It never falls, so the new triangle is the old one
    with rows A^T rows, shortened, annihilated. The level is such that the losses add up to
    the loss of exponential forgetting in all P directions, if the sample brings that much.

    Parameters
    ----------
    root : ndarray, shape (P, P)
        R in Fortran order; it is overwritten.
    rows : ndarray, shape (m, P)
        Rows to add, with noise of variance 1.
    forgetting : float
        Forgetting factor, below 1.

    """
    # largest share of the old information that one sample may remove in any direction [-]
    largest_loss = 0.5
    whitened, _ = lapack.dtrtrs(root, rows.T, trans=1)
    gains, directions = np.linalg.eigh(whitened.T @ whitened)
    # Twice the loss of exponential forgetting, as samples with little information lose less. With
    # this factor, the estimate follows steps of Coulomb friction of a moving 7-joint arm as with
    # exponential forgetting: 63 % in 8 s and 90 % in 28 s with a memory of 10 s.
    budget = 2.0 * (1.0 - forgetting) * len(root)
    # the level for which the gains, limited to this level, add up to the budget
    some = np.maximum(gains, 0.0)
    levels = (budget - np.append(0.0, np.cumsum(some[:-1]))) / np.arange(len(some), 0, -1)
    above = some >= levels
    level = min(float(levels[np.argmax(above)]), largest_loss) if above.any() else largest_loss
    kept = np.sqrt(np.maximum(1.0 - level / np.maximum(gains, level), 0.0))
    if np.any(kept > 0.0):
        root, *_ = lapack.dtpqrt(
            0, min(_BLOCK_COLUMNS, len(root)), root, (directions * kept).T @ rows, overwrite_a=1
        )
    return root


def check_forgetting(factor: float) -> None:
    """Raise an IdentificationError for a forgetting factor outside its range."""
    if not MIN_FORGETTING <= factor <= 1.0:
        raise IdentificationError(
            f'the forgetting factor is {factor}, but has to be from {MIN_FORGETTING} to 1'
        )
