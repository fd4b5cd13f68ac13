# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The linear problem of a diagnosis: weighted rows, and their products per part of the data.

A screening of all groups works on the products X'X of weighted columns, per fold: it costs a
factorisation of the free columns, whatever the number of rows.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
import scipy.linalg

#: Recordings fewer than this are cut into parts.
LEAST_FOLDS = 3
#: Free columns of which others leave less than this share are dependent.
_DEPENDENT = 1e-7


@dataclass(frozen=True)
class Problem:
    """
    Weighted rows of all trajectories.

    Attributes
    ----------
    x : ndarray, shape (R, n, P)
        Columns over noise; zero where a row tells nothing.
    y : ndarray, shape (R, n)
        Residual of the model over noise.
    weight : ndarray, shape (R, n)
        One over the noise, zero where a row tells nothing [1/(N m)].
    fold : ndarray of int, shape (R,)
        Part of the data that a row belongs to.
    products : ndarray, shape (F, P + 1, P + 1)
        [x y]'[x y] of each fold.

    """

    x: FloatArray
    y: FloatArray
    weight: FloatArray
    fold: npt.NDArray[np.intp]
    products: FloatArray

    @property
    def folds(self) -> int:
        """Number of parts."""
        return len(self.products)

    @property
    def used(self) -> npt.NDArray[np.bool_]:
        """Which entries count, shape (R, n)."""
        return np.asarray(self.weight > 0.0)

    def count(self) -> FloatArray:
        """Return how many entries each fold has of each joint, shape (F, n)."""
        return np.array([self.used[self.fold == k].sum(axis=0) for k in range(self.folds)])

    def losses(self, residual: FloatArray) -> FloatArray:
        """Return the mean square of a weighted residual in each fold and joint, shape (F, n)."""
        parts = [residual[self.fold == k] for k in range(self.folds)]
        total = np.array([np.sum(part**2, axis=0) for part in parts])
        return np.asarray(total / np.maximum(self.count(), 1))

    def with_columns(self, columns: FloatArray) -> Problem:
        """Return the problem with more columns (R, n, p), not weighted yet, after the others."""
        more = columns * self.weight[:, :, np.newaxis]
        x = np.concatenate([self.x, more], axis=2)
        size, added = self.x.shape[2], more.shape[2]
        products = np.empty((self.folds, size + added + 1, size + added + 1))
        old = [*range(size), size + added]
        new = range(size, size + added)
        in_fold = self.fold == np.arange(self.folds)[:, np.newaxis]
        parts = (more * in_fold[:, :, np.newaxis, np.newaxis]).reshape(self.folds, -1, added)
        parts = parts.transpose(0, 2, 1).reshape(self.folds * added, -1)
        flat = x.reshape(-1, size + added)
        borders = np.column_stack([parts @ flat, parts @ self.y.ravel()])
        for k, border in enumerate(np.split(borders, self.folds)):
            products[k][np.ix_(old, old)] = self.products[k]
            products[k][new, :] = border
            products[k][:, new] = border.T
        return replace(self, x=x, products=products)


def make_problem(
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    columns: Sequence[FloatArray],
) -> Problem:
    """Stack and weight rows; arguments are per trajectory: (n,), (M, n), (M, n, P)."""
    weight = row_weights(data, sigma)
    x = np.concatenate(columns)
    x *= weight[:, :, np.newaxis]
    y = np.concatenate(residual) * weight
    fold = fold_rows(data)
    size = x.shape[2] + 1
    products = np.empty((int(fold.max()) + 1, size, size))
    for k, product in enumerate(products):
        rows = fold == k
        stacked = np.concatenate([x[rows], y[rows][:, :, np.newaxis]], axis=2)
        flat = stacked.reshape(-1, size)
        product[:] = flat.T @ flat
    return Problem(x, y, weight, fold, products)


def row_weights(data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> FloatArray:
    """Return one over the noise of all rows, zero where they tell nothing, (R, n) [1/(N m)]."""
    return np.concatenate([part.told / s for part, s in zip(data, sigma, strict=True)])


def weighted_rows(
    rows: Sequence[FloatArray], data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> Iterator[FloatArray]:
    """Yield rows (M, n) or (M, n, P) of each trajectory with the weights of `row_weights`."""
    for own, part, s in zip(rows, data, sigma, strict=True):
        weight = row_weights([part], [s])
        yield own * (weight[:, :, np.newaxis] if own.ndim > 2 else weight)


def fold_rows(data: Sequence[Trajectory]) -> npt.NDArray[np.intp]:
    """Return the part of the data of every row: a recording, or a stretch of one if few."""
    recordings = len({part.fold for part in data})
    pieces = 1 if recordings >= LEAST_FOLDS else -(-(LEAST_FOLDS + 1) // recordings)
    rows = []
    for part in data:
        span = np.linspace(0, pieces, len(part.rows), endpoint=False).astype(np.intp)
        rows.append(part.fold * pieces + span)
    _, index = np.unique(np.concatenate(rows), return_inverse=True)
    return np.asarray(index, dtype=np.intp)


@dataclass(frozen=True)
class Projection:
    """
    What free columns leave of others; they are fitted to all folds together.

    Attributes
    ----------
    basis : ndarray, shape (R n, f)
        Orthonormal basis of the free columns.
    fit : ndarray, shape (f, f')
        basis = free columns @ fit.
    free : tuple of int
        The columns that are free.

    """

    basis: FloatArray
    fit: FloatArray
    free: tuple[int, ...]

    def rest(self, values: FloatArray) -> FloatArray:
        """Return what is left of weighted rows (R, n) or (R, n, p)."""
        flat = values.reshape(len(self.basis), -1)
        return np.asarray((flat - self.basis @ (self.basis.T @ flat)).reshape(values.shape))

    def products(self, columns: FloatArray) -> FloatArray:
        """Return the products (p, p) of what is left of weighted columns (R n, p)."""
        made = self.basis.T @ columns
        return np.asarray(columns.T @ columns - made.T @ made)

    def sweep(self, products: FloatArray) -> FloatArray:
        """Return the products (F, P, P) of what is left of all columns, in each fold."""
        if not self.free:
            return products
        chosen = np.asarray(self.free)
        total = products.sum(axis=0)
        fit = self.fit @ (self.fit.T @ total[chosen])
        result = np.empty_like(products)
        for k, fold in enumerate(products):
            cross = fit.T @ fold[chosen]
            inner = fit.T @ fold[np.ix_(chosen, chosen)] @ fit
            result[k] = fold - cross - cross.T + inner
        return result


def project(problem: Problem, free: Sequence[int]) -> Projection:
    """Find what the free columns can make."""
    if not len(free):
        return Projection(np.empty((problem.y.size, 0)), np.empty((0, 0)), ())
    rows = problem.x[:, :, list(free)].reshape(-1, len(free))
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    own = (rows / scale).T @ (rows / scale)
    values, vectors = scipy.linalg.eigh(own)
    good = values > _DEPENDENT * values[-1]
    fit = vectors[:, good] / np.sqrt(values[good]) / scale[:, np.newaxis]
    return Projection(rows @ fit, fit, tuple(free))
