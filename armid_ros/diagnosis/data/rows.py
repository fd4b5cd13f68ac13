# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The linear problem of a diagnosis: weighted rows, divided into folds and blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armid_ros.diagnosis.data.trajectory import block_rows, row_weights, Trajectory
from armid_ros.identification.fitting.normal_equations import informative_basis, NormalEquations
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Problem:
    """
    Weighted rows of all trajectories.

    Attributes
    ----------
    x : ndarray, shape (R, n, P)
        Weighted columns; zero where a row is not informative.
    y : ndarray, shape (R, n)
        Weighted residual of the model.
    weight : ndarray, shape (R, n)
        One over the unit of the gap, zero where a row is not informative [1/(N m)].
    block : ndarray of int, shape (R,)
        Block of each row, a stretch of the data longer than any correlation.
    fold_of_block : ndarray of int, shape (B,)
        Fold of each block.

    """

    x: FloatArray
    y: FloatArray
    weight: FloatArray
    block: npt.NDArray[np.intp]
    fold_of_block: npt.NDArray[np.intp]

    def blocks(self, *values: FloatArray) -> Iterator[tuple[FloatArray, ...]]:
        """Yield what each block has of rows (R, n) or (R, n, p), as (S,) or (S, p) each."""
        for one in range(int(self.block.max()) + 1):
            found = np.flatnonzero(self.block == one)
            whole = len(found) > 0 and found[-1] - found[0] < len(found)
            rows = slice(found[0], found[-1] + 1) if whole else found  # a slice copies nothing
            size = len(found) * self.y.shape[1]
            yield tuple(own[rows].reshape(size, *own.shape[2:]) for own in values)


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
    return Problem(x, y, weight, *block_rows(data))


@dataclass(frozen=True)
class Projection:
    """
    Regression on the nuisance columns, fitted to all folds together.

    Attributes
    ----------
    basis : ndarray, shape (R n, f)
        Basis B of the nuisance columns, B B' y being the fit to y; orthonormal without a prior.

    """

    basis: FloatArray

    def rest(self, values: FloatArray) -> FloatArray:
        """Return the residual of weighted rows (R, n) or (R, n, p)."""
        flat = values.reshape(len(self.basis), -1)
        return np.asarray((flat - self.basis @ (self.basis.T @ flat)).reshape(values.shape))


def project(
    problem: Problem, free: Sequence[int], prior: NormalEquations | None = None
) -> Projection:
    """Return the regression on the nuisance columns `free`, with a prior of their values."""
    rows = problem.x[:, :, list(free)].reshape(problem.y.size, len(free))
    own = rows.T @ rows
    return Projection(rows @ informative_basis(own if prior is None else own + prior.matrix))
