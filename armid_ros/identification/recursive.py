# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recursive least squares in square-root information form.

The state is the triangle R and the vector z of the QR factorisation of all weighted rows so far,
so without forgetting the estimate is the one of a batch solution, at any number of samples, and
the covariance R^-1 R^-T cannot lose its symmetry or become negative (Bierman 1977, chapter V).

Forgetting is directional (Kulhavy and Karny 1984): old information is given up only where a new
sample brings information, and never more than the sample brings. So the covariance never grows,
and what is not excited is neither forgotten nor moved: an arm may rest for hours. The price is
that what a strong burst of motion taught is forgotten late by the weak motion after it.

"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.motion import FloatArray, read_only
import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg import lapack

#: Standard deviation of every parameter before the first sample, in its SI unit. Robots have
#: parameters of 1e-4 to 1e3; what the data leave unknown shows by this value.
PRIOR_STD = 1e6
#: A smaller forgetting factor forgets within ten samples, which is not identification.
SMALLEST_FORGETTING = 0.9
#: Losses are this many times those of exponential forgetting, as samples that bring less than
#: that lose less. So a step of a Coulomb friction of a 7-joint arm in motion is followed as with
#: exponential forgetting, 63 % in 8 s and 90 % in 28 s with a memory of 10 s.
_LOSS_RATIO = 2.0
#: The most that one sample may take away from the old information in any direction.
_LARGEST_LOSS = 0.5
_BLOCK = 8  # columns of a Householder block; the fastest for 60 to 120 parameters


@dataclass(frozen=True, eq=False)
class Learned:
    """
    What an estimator knew at some time, to return to.

    Attributes
    ----------
    root : ndarray, shape (P, P)
        Upper triangle R; the information is R^T R.
    values : ndarray, shape (P,)
        Estimated parameters.
    squares, freedom : float
        Weighted squares of the residuals, and observations beyond the parameters.
    samples : int
        Samples used.

    """

    root: FloatArray
    values: FloatArray
    squares: float
    freedom: float
    samples: int


class RecursiveLeastSquares:
    """
    Estimate theta of tau = rows @ theta + noise, a few rows at a time.

    Parameters
    ----------
    parameters : tuple of ParameterName
        P names.
    noise : array_like, shape (m,), optional
        Standard deviation of the noise of the m rows of a sample, usually one per joint [N m].
        Without it the rows weigh the same and the covariance is scaled by the residuals.
    forgetting : float
        1 keeps everything. Below 1, a direction that is excited all the time is estimated from
        about the last 1 / (1 - forgetting) samples.
    prior : Estimate, optional
        What is known beforehand. Without it all values are those of `start` within PRIOR_STD,
        which is a ridge too weak to be seen once a parameter is excited.
    start : array_like, shape (P,), optional
        Values to begin with when there is no prior, zero by default.
    scale_covariance : bool, optional
        Whether the covariance is multiplied by ``variance_factor``; by default when the noise is
        not given. Right when the noise is known up to a factor.

    Raises
    ------
    IdentificationError
        If the noise, the forgetting factor or the prior cannot be used.

    Attributes
    ----------
    parameters : tuple of ParameterName
        P names.
    samples : int
        Samples used since the last reset.

    """

    def __init__(
        self,
        parameters: tuple[ParameterName, ...],
        noise: npt.ArrayLike | None = None,
        *,
        forgetting: float = 1.0,
        prior: Estimate | None = None,
        start: npt.ArrayLike | None = None,
        scale_covariance: bool | None = None,
    ) -> None:
        if not SMALLEST_FORGETTING <= forgetting <= 1.0:
            raise IdentificationError(
                f'forgetting factor {forgetting}: has to be from {SMALLEST_FORGETTING} to 1'
            )
        self.parameters = parameters
        self.samples = 0
        self._forgetting = float(forgetting)
        self._noise = None if noise is None else _checked_noise(noise)
        self._scale = noise is None if scale_covariance is None else scale_covariance
        self._prior = _prior_root(parameters, prior, start)
        # without a prior the first P observations fit exactly and say nothing of the noise
        self._initial_freedom = -float(len(parameters)) if prior is None else 0.0
        self.reset()

    def with_more(self, parameters: tuple[ParameterName, ...]) -> RecursiveLeastSquares:
        """Return an estimator in its beginning, of more parameters that nothing is known of."""
        more, (root, right) = len(parameters), self._prior
        wider = copy(self)
        wider.parameters = self.parameters + parameters
        wider._prior = (
            scipy.linalg.block_diag(root, np.eye(more) / PRIOR_STD),
            np.concatenate([right, np.zeros((more, 1))]),
        )
        wider._initial_freedom = self._initial_freedom - float(more)
        wider.reset()
        return wider

    def reset(self) -> None:
        """Return to the prior."""
        self.samples = 0
        self._root, self._right = (np.array(part, order='F') for part in self._prior)
        self._squares = 0.0
        self._freedom = self._initial_freedom
        self._values = self._solve()

    def update(
        self,
        rows: FloatArray,
        tau: FloatArray,
        weights: npt.ArrayLike | None = None,
    ) -> FloatArray:
        """
        Take in one sample.

        Parameters
        ----------
        rows : ndarray, shape (m, P)
            Sensitivity of the torques to the parameters.
        tau : ndarray, shape (m,)
            Measured torque [N m].
        weights : array_like, shape (m,), optional
            Independent observations that each row stands for: 0 for a row not to be used, less
            than 1 for one of many filtered rows that share their noise. Ones by default.

        Returns
        -------
        ndarray, shape (m,)
            Innovation: the torque minus its prediction from the samples before [N m].

        Raises
        ------
        IdentificationError
            If shapes do not agree or a number is not finite; the estimate is unchanged.

        """
        rows, tau, counts = self._checked(rows, tau, weights)
        innovation = tau - rows @ self._values
        used = float(counts.sum())
        if used == 0.0:
            return innovation
        scale = self.scale(counts)
        rows = rows * scale[:, np.newaxis]
        if self._forgetting < 1.0:
            self._replace(rows, innovation * scale)
        else:
            self._absorb(rows, tau * scale)
        after = tau * scale - rows @ self._values
        self._squares += float(innovation * scale @ after)
        self._freedom += used
        self.samples += 1
        return innovation

    def scale(self, weights: FloatArray) -> FloatArray:
        """Return what gives rows of these weights noise of variance 1, shape (m,) [1/(N m)]."""
        root = np.sqrt(weights)
        return root if self._noise is None else root / self._noise

    def learned(self) -> Learned:
        """Return what is known now."""
        return Learned(
            read_only(self._root), self._values, self._squares, self._freedom, self.samples
        )

    def restore(self, learned: Learned) -> None:
        """Return to what was known."""
        self._take(np.array(learned.root, order='F'), learned.values)
        self._squares, self._freedom = learned.squares, learned.freedom
        self.samples = learned.samples

    def reopen(self, directions: FloatArray) -> None:
        """
        Forget the values along some directions, and nothing else.

        The parameters become theta + directions delta, where nothing is known of delta: beside
        R theta = z stands delta = 0 within PRIOR_STD, and delta is eliminated by reflections.

        Parameters
        ----------
        directions : ndarray, shape (P, k)
            Independent combinations of parameters that may have changed.

        """
        size, count = directions.shape
        unit = directions / np.linalg.norm(directions, axis=0)
        stacked = np.zeros((size + count, count + size))
        stacked[:size, :count], stacked[:size, count:] = -self._root @ unit, self._root
        stacked[size:, :count] = np.eye(count) / PRIOR_STD
        root = np.asarray(np.linalg.qr(stacked, mode='r'))[count:, count:]
        self._take(np.asfortranarray(root), self._values)
        self._freedom -= count

    @property
    def values(self) -> FloatArray:
        """Estimated parameters, shape (P,)."""
        return self._values

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the values, shape (P, P)."""
        inverse, _ = lapack.dtrtri(self._root)
        return np.asarray(inverse @ inverse.T * self.covariance_factor)

    @property
    def noise_is_relative(self) -> bool:
        """Whether the noise is known up to a factor only, which the residuals tell."""
        return self._scale

    @property
    def covariance_factor(self) -> float:
        """What the covariance is multiplied by: the variance factor, or 1 for known noise."""
        return self.variance_factor if self._scale else 1.0

    @property
    def variance_factor(self) -> float:
        """
        Variance of the weighted residuals: 1 when the noise is as given.

        Without a prior, 1 as well until there are more observations than parameters.

        """
        return self._squares / self._freedom if self._freedom >= 1.0 else 1.0

    @property
    def condition_number(self) -> float:
        """Condition number of the weighted regressor so far, prior included."""
        singular = np.linalg.svd(self._root, compute_uv=False)
        return float(singular[0] / singular[-1])

    @property
    def estimate(self) -> Estimate:
        """Values and covariance with their names."""
        return Estimate(self.parameters, self._values.copy(), self.covariance)

    def _absorb(self, rows: FloatArray, tau: FloatArray) -> None:
        """Annihilate the new rows against the triangle by Householder reflections."""
        root, reflectors, factors, _ = lapack.dtpqrt(
            0, min(_BLOCK, len(self._values)), self._root, rows, overwrite_a=1
        )
        right, _, _ = lapack.dtpmqrt(
            0, reflectors, factors, self._right, tau[:, np.newaxis], trans='T', overwrite_a=1
        )
        self._root, self._right = root, right
        self._values = self._solve()

    def _replace(self, rows: FloatArray, innovation: FloatArray) -> None:
        """
        Take in new information and give up old information where it arrives.

        In the directions b of U = rows R^-1 = A diag(s) B^T the old information, 1, becomes
        1 - f + s^2 with f = min(s^2, level). It never falls, so the new triangle is the old one
        with rows A^T rows, shortened, annihilated. The level is such that the losses add up to
        what exponential forgetting takes from all P directions, if the sample brings that much.

        """
        whitened, _ = lapack.dtrtrs(self._root, rows.T, trans=1)
        gains, directions = np.linalg.eigh(whitened.T @ whitened)
        budget = _LOSS_RATIO * (1.0 - self._forgetting) * len(self._values)
        level = min(_level(np.maximum(gains, 0.0), budget), _LARGEST_LOSS)
        kept = np.sqrt(np.maximum(1.0 - level / np.maximum(gains, level), 0.0))
        if np.any(kept > 0.0):
            self._root, *_ = lapack.dtpqrt(
                0,
                min(_BLOCK, len(self._values)),
                self._root,
                (directions * kept).T @ rows,
                overwrite_a=1,
            )
        gradient = (rows.T @ innovation)[:, np.newaxis]
        half, _ = lapack.dtrtrs(self._root, gradient, trans=1)
        step, _ = lapack.dtrtrs(self._root, half)
        self._values = self._values + step[:, 0]
        self._squares *= self._forgetting
        self._freedom *= self._forgetting

    def _take(self, root: FloatArray, values: FloatArray) -> None:
        self._root, self._values = root, values
        self._right = np.asfortranarray((root @ values)[:, np.newaxis])

    def _solve(self) -> FloatArray:
        return np.asarray(lapack.dtrtrs(self._root, self._right)[0][:, 0])

    def _checked(
        self, rows: FloatArray, tau: FloatArray, weights: npt.ArrayLike | None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        rows = np.asarray(rows, dtype=np.float64)
        tau = np.asarray(tau, dtype=np.float64)
        count = len(tau) if self._noise is None else len(self._noise)
        expected = (count, len(self.parameters))
        if rows.shape != expected or tau.shape != expected[:1]:
            raise IdentificationError(
                f'update: rows of shape {rows.shape} and torques of shape {tau.shape}, '
                f'where {expected} and {expected[:1]} were expected'
            )
        counts = np.ones(count) if weights is None else np.asarray(weights, dtype=np.float64)
        if counts.shape != (count,) or not np.all(counts >= 0.0):
            raise IdentificationError(f'update: weights {counts} have to be {count} numbers >= 0')
        # one sum instead of isfinite: any NaN or infinity survives in it
        if not np.isfinite(rows.sum() + tau.sum() + counts.sum()):
            raise IdentificationError('update: rows, torques and weights have to be finite')
        return rows, tau, counts


def _level(gains: FloatArray, budget: float) -> float:
    """Return the level for which the gains cut off at it, ascending, add up to the budget."""
    count = len(gains)
    smaller = np.cumsum(gains) - gains
    levels = (budget - smaller) / np.arange(count, 0, -1)
    above = gains >= levels
    return float(levels[np.argmax(above)]) if above.any() else np.inf


def _checked_noise(noise: npt.ArrayLike) -> FloatArray:
    values = np.array(noise, dtype=np.float64)
    if values.ndim != 1 or not np.all(np.isfinite(values)) or not np.all(values > 0.0):
        raise IdentificationError(
            f'noise {values}: has to be one finite standard deviation > 0 for each joint'
        )
    return values


def _prior_root(
    parameters: tuple[ParameterName, ...], prior: Estimate | None, start: npt.ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return the triangle R, shape (P, P), and R theta, shape (P, 1), of the prior."""
    if prior is None:
        count = len(parameters)
        values = np.zeros(count) if start is None else np.asarray(start, dtype=np.float64)
        if values.shape != (count,) or not np.all(np.isfinite(values)):
            raise IdentificationError(f'start {values}: has to be {count} finite values')
        return np.eye(count) / PRIOR_STD, values[:, np.newaxis] / PRIOR_STD
    if prior.parameters != parameters:
        unknown = [p for p in prior.parameters if p not in parameters] or 'the order'
        raise IdentificationError(f'the prior is of other parameters; different: {unknown}')
    try:
        factor = np.linalg.cholesky(prior.covariance)
    except np.linalg.LinAlgError:
        raise IdentificationError(
            'the covariance of the prior is not positive definite: it has to give every '
            'parameter an uncertainty'
        ) from None
    inverse = scipy.linalg.solve_triangular(factor, np.eye(len(parameters)), lower=True)
    root: FloatArray = np.linalg.qr(inverse).R
    return root, root @ prior.values[:, np.newaxis]
