# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Weighted and robust least squares of arms, by normal equations.

The size of normal equations does not depend on the number of samples. Normal equations add up over
stretches, recordings and workers. Each joint has its own, because the weights of joints are known
only after all samples.

The standard deviations come from the spectrum of the actual residuals. With filtered,
over-sampled or badly modelled torque, neighbouring residuals are correlated. Standard deviations
for independent samples would be far too small.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args, Literal

from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.rows.regression import by_stretch, Regression
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.optimize

#: Largest number of iterations of reweighting; the weights converge in three to ten.
_MAX_ITERATIONS = 20
#: Share of the largest eigenvalue of normalised products of columns below which a direction is not
#: identifiable: the rounding error of the products.
_MIN_EIGENVALUE = 1e-10

Method = Literal['ols', 'wls', 'irls']
Estimator = Literal['ols', 'wls', 'irls', 'iv']

#: All estimators.
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)
#: Description of each estimator.
IN_WORDS: dict[Estimator, str] = {
    'ols': 'ordinary least squares',
    'wls': 'least squares weighted by the noise of each joint',
    'irls': 'least squares weighted by the noise of each joint, outliers weighted down',
    'iv': 'instrumental variables from the smoothed motion',
}


@dataclass(frozen=True)
class Solution:
    """
    Result of a least-squares fit: parameters with covariance, and weights of the samples.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    covariance : ndarray, shape (r, r)
        Covariance of the parameters, correlation of the residuals included.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of every joint [N m].
    condition_number : float
        Condition number of the weighted regressor.
    outliers : int
        Number of samples whose weight was reduced below one half.
    weights : ndarray, shape (N, n)
        Weight of each sample of each joint, stretches one after the other.

    """

    values: FloatArray
    covariance: FloatArray
    joint_std: FloatArray
    condition_number: float
    outliers: int
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """
    Normal equations of each joint: inner products of its regressor columns and torque.

    Attributes
    ----------
    products : ndarray, shape (n, r + 1, r + 1)
        [W_j, y_j]' [W_j, y_j] of each joint, with columns W_j and target y_j.
    counts : ndarray, shape (n,)
        Number of informative samples of each joint.

    """

    products: FloatArray
    counts: FloatArray

    @classmethod
    def of(
        cls, problem: Sequence[Regression], weights: npt.NDArray[np.floating] | None = None
    ) -> NormalEquations:
        """
        Compute the normal equations of one or more gap-free sections of recordings.

        Parameters
        ----------
        problem : sequence of Regression
            N samples of each of n joints in r columns.
        weights : ndarray, shape (N, n), optional
            Weight of each sample; by default 1, and 0 for a sample that is not informative.

        """
        n_joints, rank = problem[0].columns.shape[1:]
        products, counts = np.zeros((n_joints, rank + 1, rank + 1)), np.zeros(n_joints)
        if weights is None:
            weights = np.concatenate([part.informative for part in problem])
        own = by_stretch(problem, np.asarray(weights, dtype=float))
        for part, weight in zip(problem, own, strict=True):
            target = part.target
            counts += part.informative.sum(axis=0)
            for joint in range(n_joints):
                rows = np.column_stack([part.columns[:, joint], target[:, joint]])
                # torques do not depend on links nearer to the base
                active = np.flatnonzero(rows.any(axis=0))
                rows = rows[:, active] * weight[:, joint, np.newaxis]
                products[joint][np.ix_(active, active)] += rows.T @ rows
        return cls(products, counts)

    def __add__(self, other: NormalEquations) -> NormalEquations:
        """Add the normal equations of two sets of samples."""
        return NormalEquations(self.products + other.products, self.counts + other.counts)

    def restrict(self, columns: Sequence[int] | npt.NDArray[np.intp]) -> NormalEquations:
        """Return the normal equations of only the regressor columns at given indices."""
        kept = np.append(np.asarray(columns, dtype=np.intp), self.rank)
        return NormalEquations(self.products[:, kept[:, np.newaxis], kept], self.counts)

    @property
    def rank(self) -> int:
        """Number r of regressor columns."""
        return int(self.products.shape[2]) - 1

    def summed(self, scale: npt.ArrayLike = 1.0) -> FloatArray:
        """Return inner products summed over joints, over squared scales, (r + 1, r + 1)."""
        weight = np.broadcast_to(np.asarray(scale, dtype=float), self.counts.shape) ** -2.0
        return np.asarray(np.tensordot(weight, self.products, axes=1))

    def squares(self, values: FloatArray) -> FloatArray:
        """Return the sum of squared residuals of each joint, for parameters `values`, (n,)."""
        ends = np.append(values, -1.0)
        # smaller values are rounding errors of the products
        return np.asarray(
            np.maximum(self.products @ ends @ ends, 1e-12 * self.products[:, -1, -1])
        )

    def relative_error_percent(self, values: FloatArray) -> float:
        """Return the relative torque error for given parameters, 100 |residual| / |torque| [%]."""
        whole = self.products[:, -1, -1].sum()
        return float(100.0 * np.sqrt(self.squares(values).sum() / whole))

    def joint_std(self, values: FloatArray) -> FloatArray:
        """Return the standard deviation of each joint's residual for parameters `values`, (n,)."""
        counts = np.maximum(self.counts, 1.0)
        rows = float(counts.sum())
        freedom = rows / max(1.0, rows - len(values))  # correction for degrees of freedom
        return np.asarray(np.sqrt(freedom * self.squares(values) / counts))

    def packed(self) -> FloatArray:
        """Return all numbers in one array: joints, sample counts, upper triangles of products."""
        upper = np.triu_indices(self.rank + 1)
        numbers = self.products[:, upper[0], upper[1]].ravel()
        return np.concatenate([[len(self.counts)], self.counts, numbers])

    @classmethod
    def unpacked(cls, numbers: FloatArray) -> NormalEquations:
        """Restore normal equations from the array that `packed` returns."""
        joints = int(numbers[0])
        triangles = numbers[1 + joints :].reshape(joints, -1)
        size = int(np.sqrt(2 * triangles.shape[1]))
        first, second = np.triu_indices(size)
        products = np.zeros((joints, size, size))
        products[:, first, second] = products[:, second, first] = triangles
        return cls(products, numbers[1 : 1 + joints])


def solve(
    problem: Sequence[Regression],
    method: Method = 'wls',
    bounds: tuple[FloatArray, FloatArray] | None = None,
) -> Solution:
    """
    Fit parameters to the torques of gap-free sections of recordings by least squares.

    Parameters
    ----------
    problem : sequence of Regression
        Columns and torques of stretches, with the same parameters.
    method : {'ols', 'wls', 'irls'}
        Equal weights; weights by the residual of each joint; the latter with outliers weighted
        down (Huber's function).
    bounds : tuple of two ndarray, each of shape (r,), optional
        Lower and upper bounds of physical values. The covariance is that without bounds.

    Returns
    -------
    Solution
        Parameters with covariance.

    """
    normal = NormalEquations.of(problem)
    used = np.concatenate([part.informative for part in problem])
    fit = weighted_fit(normal, weighted=method == 'wls')
    relative: FloatArray = used.astype(float)
    if method == 'irls':
        fit, relative = _robust(problem, used, fit)
    values = fit.values if bounds is None else within_bounds(fit.values, fit.factor, bounds)
    weights = np.asarray(relative / fit.scale)
    residual = np.concatenate([part.residual(values) for part in problem])
    products = noise_products(problem, residual * weights, weights, fit.inverse)
    return Solution(
        values=values,
        covariance=sandwich(fit.inverse @ fit.inverse.T, products),
        joint_std=normal.joint_std(values),
        condition_number=float(np.linalg.cond(fit.factor)),
        outliers=int(np.sum(used & (relative**2 < 0.5))),
        weights=weights,
    )


def _robust(
    problem: Sequence[Regression], used: npt.NDArray[np.bool_], fit: WeightedFit
) -> tuple[WeightedFit, FloatArray]:
    """Reduce weights of outliers; return the fit and the weights before joint scaling, (N, n)."""
    relative: FloatArray = used.astype(float)
    for _ in range(_MAX_ITERATIONS):
        before = (fit.scale, relative)
        residual = np.concatenate([part.residual(fit.values) for part in problem])
        # standard deviation of each joint's residual, from its median absolute deviation
        masked = np.where(used, residual, np.nan)
        spread = np.nanmedian(np.abs(masked - np.nanmedian(masked, axis=0)), axis=0)
        scale = _positive(1.4826 * np.nan_to_num(spread))
        size = np.maximum(np.abs(residual) / scale, 1e-12)
        # residuals beyond this many robust standard deviations lose weight (Huber 1981: 95 %
        # efficiency)
        relative = np.asarray(used * np.sqrt(np.minimum(1.0, 1.345 / size)))
        fit = scaled_fit(NormalEquations.of(problem, relative), scale)
        if np.allclose(scale, before[0], rtol=1e-6) and np.allclose(relative, before[1]):
            break
    return fit, relative


@dataclass(frozen=True, eq=False)
class WeightedFit:
    """
    Solution of weighted normal equations: parameters, scales and factors.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    scale : ndarray, shape (n,)
        Divisor of columns and torque of each joint.
    factor, inverse : ndarray, shape (r, r)
        Factor F of the products F' F of the weighted columns, and its inverse.

    """

    values: FloatArray
    scale: FloatArray
    factor: FloatArray
    inverse: FloatArray


def weighted_fit(normal: NormalEquations, *, weighted: bool = True) -> WeightedFit:
    """
    Solve normal equations, by default with joints weighted by inverse residual variances.

    Parameters
    ----------
    normal : NormalEquations
        Products of columns and torques.
    weighted : bool
        Whether every joint is weighted by its own residual; otherwise all weights are equal.

    """
    fit = scaled_fit(normal, np.ones(len(normal.counts)))
    for _ in range(_MAX_ITERATIONS if weighted else 0):
        before = fit.scale
        fit = scaled_fit(normal, _positive(normal.joint_std(fit.values)))
        if np.allclose(fit.scale, before, rtol=1e-6):
            break
    return fit


def scaled_fit(normal: NormalEquations, scale: FloatArray) -> WeightedFit:
    """Solve normal equations, with columns and torque of each joint divided by `scale`, (n,)."""
    products = normal.summed(scale)
    factor, inverse = factored(products[:-1, :-1])
    return WeightedFit(inverse @ (inverse.T @ products[:-1, -1]), scale, factor, inverse)


def _positive(scale: FloatArray) -> FloatArray:
    """Return residual scales, (n,), limited to values above zero for exactly fitted joints."""
    return np.maximum(scale, max(1e-9 * float(np.max(scale)), 1e-100))


def factored(products: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return a factor F (p, p) of a Gram matrix, F' F = `products`, and the inverse of F.

    Eigenvalues below the rounding error are raised to the rounding error.

    """
    length = np.sqrt(np.diag(products))
    size = np.where(length > 0.0, length, 1.0)
    lengths, axes = np.linalg.eigh(products / np.outer(size, size))
    least = len(size) * np.finfo(float).eps * lengths.max(initial=0.0)
    lengths = np.sqrt(np.maximum(lengths, max(least, 1e-300)))
    return lengths[:, np.newaxis] * axes.T * length, axes / lengths / size[:, np.newaxis]


def within_bounds(
    values: FloatArray, factor: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """
    Return parameters within bounds whose torques are nearest to the torques of `values`.

    Parameters
    ----------
    values : ndarray, shape (r,)
        Values of the unbounded fit.
    factor : ndarray, shape (r, r)
        Factor F of the products F' F of the weighted columns.
    bounds : tuple of two ndarray, each of shape (r,)
        Lower and upper bounds.

    """
    if np.all((values >= bounds[0]) & (values <= bounds[1])):
        return values
    scale = np.linalg.norm(factor, axis=0)
    solution = scipy.optimize.lsq_linear(
        factor / scale, factor @ values, (bounds[0] * scale, bounds[1] * scale), method='bvls'
    )
    return np.asarray(np.clip(solution.x / scale, *bounds))


def informative_basis(products: FloatArray) -> FloatArray:
    """
    Return a basis B of the identifiable directions in parameter space, scaled to unit variance.

    Parameters
    ----------
    products : ndarray, shape (p, p)
        Products of columns with each other; positive semi-definite.

    Returns
    -------
    ndarray, shape (p, k)
        Basis, where B B' is the pseudo-inverse of the products.

    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(products), 1e-300))
    scaled = products * np.outer(scale, scale)
    lower, failed = scipy.linalg.lapack.dpotrf(scaled, lower=True)
    if not failed and len(scaled):
        inverse, _ = scipy.linalg.lapack.dtrtri(lower, lower=True)
        # every direction is identifiable, as the smallest eigenvalue is at least
        # 1 / trace(inverse), and the largest is at most trace(products)
        if np.sum(inverse**2) * np.trace(scaled) * _MIN_EIGENVALUE <= 1.0:
            return np.asarray(scale[:, np.newaxis] * inverse.T)
    values, vectors = np.linalg.eigh(scaled)
    good = values > _MIN_EIGENVALUE * max(float(values.max(initial=0.0)), 1e-300)
    return np.asarray(scale[:, np.newaxis] * vectors[:, good] / np.sqrt(values[good]))


def informative_solution(products: FloatArray, aim: FloatArray) -> FloatArray:
    """
    Return the solution of normal equations, zero in unidentifiable directions, (p,) or (p, k).

    Parameters
    ----------
    products : ndarray, shape (p, p)
        Products of columns with each other; positive semi-definite.
    aim : ndarray, shape (p,) or (p, k)
        Products of the columns with the targets.

    Returns
    -------
    ndarray, shape (p,) or (p, k)

    """
    basis = informative_basis(products)
    return np.asarray(basis @ (basis.T @ aim))


def scaled_inverse(matrix: FloatArray) -> FloatArray:
    """
    Return the inverse of a covariance or precision matrix, (p, p), of different units.

    Eigenvalues below the rounding error are raised to the rounding error.

    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    both = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(matrix * both + _MIN_EIGENVALUE * np.eye(len(matrix))) * both)
