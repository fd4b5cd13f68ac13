# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What a least-squares fit needs of its rows, in a size that does not grow with them.

The rows [W_j, y_j] of a joint are compressed by an orthogonal transformation to a triangle with
the same products. Triangles of several recordings stacked below each other are rows as well, and
compressed again they are the triangle of all (tall-skinny QR; Demmel, Grigori, Hoemmen and Langou
2012): any tree of such merges gives the fit of all rows at once. Joints are kept apart, for their
weights are known only when all rows are.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from armid_ros.identification.fitting.sandwich import sandwich
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import FloatArray, read_only
import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.optimize

#: Rounds of reweighting; the weights settle in three to ten.
ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Triangle:
    """
    Rows of all joints, compressed joint by joint.

    Attributes
    ----------
    factors : ndarray, shape (n, r + 1, r + 1)
        T_j with T_j' T_j = [W_j, y_j]' [W_j, y_j]; not triangular where columns are zero.
    counts : ndarray, shape (n,)
        Rows of each joint that say something.

    """

    factors: FloatArray
    counts: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, 'factors', read_only(self.factors))
        object.__setattr__(self, 'counts', read_only(self.counts))

    @classmethod
    def of(
        cls, problem: Sequence[Regression], weights: npt.NDArray[np.floating] | None = None
    ) -> Triangle:
        """
        Compress the rows of one or more stretches.

        Parameters
        ----------
        problem : sequence of Regression
            N rows of each of n joints in r columns.
        weights : ndarray, shape (N, n), optional
            What the rows are multiplied by; by default those that say nothing are left out.

        """
        informative = np.concatenate([part.informative for part in problem])
        if weights is None:
            weights = informative.astype(float)
        n_joints, rank = problem[0].columns.shape[1:]
        factors = np.zeros((n_joints, rank + 1, rank + 1))
        for joint in range(n_joints):
            rows = np.concatenate(
                [
                    np.column_stack([part.columns[:, joint], part.target[:, joint]])
                    for part in problem
                ]
            )
            _compress(rows * weights[:, joint, np.newaxis], factors[joint])
        return cls(factors, informative.sum(axis=0).astype(float))

    @classmethod
    def merged(cls, triangles: Sequence[Triangle]) -> Triangle:
        """Return the triangle of the rows of several; one is returned as it is."""
        if len(triangles) == 1:
            return triangles[0]
        factors = np.zeros_like(triangles[0].factors)
        for joint in range(len(factors)):
            _compress(np.concatenate([t.factors[joint] for t in triangles]), factors[joint])
        return cls(factors, np.sum([t.counts for t in triangles], axis=0))

    def restrict(self, columns: Sequence[int] | npt.NDArray[np.intp]) -> Triangle:
        """Return the triangle of the same rows in some of their columns."""
        kept = np.append(np.asarray(columns, dtype=np.intp), self.rank)
        if len(kept) == self.factors.shape[2]:
            return self
        factors = np.zeros((len(self.factors), len(kept), len(kept)))
        for joint, factor in enumerate(self.factors):
            _compress(factor[:, kept], factors[joint])
        return Triangle(factors, self.counts)

    @property
    def rank(self) -> int:
        """Return the number of columns r."""
        return int(self.factors.shape[2]) - 1

    @property
    def stacked(self) -> FloatArray:
        """Return the columns of all joints as rows of the same products, shape (n (r + 1), r)."""
        return self.factors[:, :, :-1].reshape(-1, self.rank)

    @cached_property
    def torque_squares(self) -> FloatArray:
        """Sum of the squared torques of each joint, shape (n,) [(N m)^2]."""
        return np.asarray(np.sum(self.factors[:, :, -1] ** 2, axis=1))

    def squares(self, values: FloatArray) -> FloatArray:
        """Return the sum of the squared residuals of each joint, shape (n,) [(N m)^2]."""
        rest: FloatArray = self.factors @ np.append(values, -1.0)
        return np.asarray(np.sum(rest**2, axis=1))

    def packed(self) -> FloatArray:
        """
        Return all numbers that are not zero by structure, in one row.

        A joint feels no link before its own and no friction but its own: with seven joints a
        third of the numbers of full triangles is left.

        """
        pieces = [np.array([len(self.factors), self.rank], dtype=float), self.counts]
        for factor in self.factors:
            active = np.flatnonzero(factor.any(axis=0))
            compact = factor[: len(active), active]
            pieces += [
                np.array([len(active), *active], dtype=float),
                compact[np.triu_indices(len(active))],
            ]
        return np.concatenate(pieces)

    @classmethod
    def unpacked(cls, numbers: FloatArray) -> Triangle:
        """Return the triangle that was packed."""
        joints, rank = int(numbers[0]), int(numbers[1])
        counts, at = np.array(numbers[2 : 2 + joints]), 2 + joints
        factors = np.zeros((joints, rank + 1, rank + 1))
        for factor in factors:
            size = int(numbers[at])
            active = numbers[at + 1 : at + 1 + size].astype(np.intp)
            at += 1 + size
            compact = np.zeros((size, size))
            compact[np.triu_indices(size)] = numbers[at : at + size * (size + 1) // 2]
            at += size * (size + 1) // 2
            factor[:size, active] = compact
        return cls(factors, counts)

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes packed."""
        return Triangle.unpacked, (self.packed(),)


@dataclass(frozen=True, eq=False)
class TriangleFit:
    """
    Least squares of a triangle.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    scale : ndarray, shape (n,)
        What the rows of each joint were divided by.
    factor : ndarray, shape (r, r)
        Triangular factor of the weighted columns.

    """

    values: FloatArray
    scale: FloatArray
    factor: FloatArray

    @property
    def condition_number(self) -> float:
        """Of the weighted columns."""
        return float(np.linalg.cond(self.factor))

    @property
    def inverse(self) -> FloatArray:
        """Inverse of the factor, shape (r, r)."""
        return np.asarray(scipy.linalg.solve_triangular(self.factor, np.eye(len(self.factor))))

    def covariance(self, products: FloatArray) -> FloatArray:
        """Return that of the values, given that of the products of columns and noise, (r, r)."""
        bread = self.inverse @ self.inverse.T
        return sandwich(bread, products)


def joint_std(triangle: Triangle, values: FloatArray) -> FloatArray:
    """Return the standard deviation of the residual of each joint, shape (n,) [N m]."""
    counts = np.maximum(triangle.counts, 1.0)
    rows = float(counts.sum())
    freedom = rows / max(1.0, rows - triangle.rank)  # by which squares of residuals are too small
    return np.asarray(np.sqrt(freedom * triangle.squares(values) / counts))


def fit_triangle(
    triangle: Triangle,
    *,
    weighted: bool = True,
    bounds: tuple[FloatArray, FloatArray] | None = None,
) -> TriangleFit:
    """
    Fit parameters to compressed rows.

    Parameters
    ----------
    triangle : Triangle
        The rows.
    weighted : bool
        Whether every joint is weighted by its own residual.
    bounds : tuple of two ndarray, each of shape (r,), optional
        What is physically possible, lower and upper.

    """
    fit = fit_scaled(triangle, np.ones(len(triangle.counts)))
    for _ in range(ROUNDS if weighted else 0):
        before = fit.scale
        fit = fit_scaled(triangle, positive(joint_std(triangle, fit.values)))
        if np.allclose(fit.scale, before, rtol=1e-6):
            break
    if bounds is not None:
        return TriangleFit(within(fit.values, fit.factor, bounds), fit.scale, fit.factor)
    return fit


def fit_scaled(triangle: Triangle, scale: FloatArray) -> TriangleFit:
    """Solve by QR with scaled columns, the rows of every joint divided by a number (n,)."""
    stacked = triangle.factors / scale[:, np.newaxis, np.newaxis]
    stacked = stacked.reshape(-1, stacked.shape[2])
    size = np.linalg.norm(stacked, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    (factor,) = scipy.linalg.qr(stacked / size, mode='r', check_finite=False)
    rank = triangle.rank
    upper = factor[:rank, :rank]
    values = scipy.linalg.solve_triangular(upper, factor[:rank, rank]) * size[rank]
    return TriangleFit(values / size[:rank], scale, upper * size[:rank])


def within(
    values: FloatArray, triangle: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """
    Return the best fit within bounds: the one whose predictions differ least from the free.

    Parameters
    ----------
    values : ndarray, shape (r,)
        The free fit.
    triangle : ndarray, shape (r, r)
        Triangular factor of the weighted columns.
    bounds : tuple of two ndarray, each of shape (r,)
        Lower and upper.

    """
    if np.all((values >= bounds[0]) & (values <= bounds[1])):
        return values
    scale = np.linalg.norm(triangle, axis=0)
    solution = scipy.optimize.lsq_linear(
        triangle / scale, triangle @ values, (bounds[0] * scale, bounds[1] * scale), method='bvls'
    )
    return np.asarray(np.clip(solution.x / scale, *bounds))


def positive(scale: FloatArray) -> FloatArray:
    """Keep a joint that is fitted exactly from taking all the weight."""
    floor = max(1e-9 * float(np.max(scale)), 1e-100)
    return np.maximum(scale, floor)


def _compress(rows: FloatArray, into: FloatArray) -> None:
    """Write the triangle of rows (N, r + 1) into zeros of shape (r + 1, r + 1)."""
    active = np.flatnonzero(rows.any(axis=0))
    (factor,) = scipy.linalg.qr(rows[:, active], mode='r', check_finite=False)
    factor = factor[: len(active)]
    into[: len(factor), active] = factor
