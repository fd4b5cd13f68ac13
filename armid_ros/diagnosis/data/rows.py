# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The linear problem of a diagnosis: weighted rows, in parts that are held out, in blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.evidence import Evidence, Trajectory
from armid_ros.identification.fitting.normal_equations import informative_basis
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Parts that data are held out in, two of each recording at the least: what one fast recording
#: shows alone can be learned from half of it.
PARTS = 6
#: Blocks of each part of the data, of a second or two, which is longer than any correlation of
#: noise; a block has this many rows at the least.
BLOCKS, _LEAST_ROWS = 6, 8


@dataclass(frozen=True)
class Problem:
    """
    Weighted rows of all trajectories.

    Attributes
    ----------
    x : ndarray, shape (R, n, P)
        Columns over noise; zero where a row is not informative.
    y : ndarray, shape (R, n)
        Residual of the model over noise.
    weight : ndarray, shape (R, n)
        One over the noise, zero where a row is not informative [1/(N m)].
    block : ndarray of int, shape (R,)
        Stretch of the data that a row belongs to; longer than any correlation.
    fold_of_block : ndarray of int, shape (B,)
        Part of the data that a block belongs to.

    """

    x: FloatArray
    y: FloatArray
    weight: FloatArray
    block: npt.NDArray[np.intp]
    fold_of_block: npt.NDArray[np.intp]

    @property
    def used(self) -> npt.NDArray[np.bool_]:
        """Which entries count, shape (R, n)."""
        return np.asarray(self.weight > 0.0)

    def chi2_per_row(self, residual: FloatArray) -> FloatArray:
        """Return the mean square of a weighted residual of each joint, shape (n,)."""
        return np.asarray(np.sum(residual**2, axis=0) / np.maximum(self.used.sum(axis=0), 1))

    def with_columns(self, columns: FloatArray) -> Problem:
        """Return the problem with more columns (R, n, p), not weighted yet, after the others."""
        more = columns * self.weight[:, :, np.newaxis]
        return replace(self, x=np.concatenate([self.x, more], axis=2))


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


def block_rows(
    data: Sequence[Trajectory],
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the block of every row, and the part of the data of every block."""
    fold = fold_rows(data)
    block = np.empty(len(fold), dtype=np.intp)
    owner: list[int] = []
    for k in np.unique(fold):
        rows = np.flatnonzero(fold == k)
        pieces = min(BLOCKS, max(2, len(rows) // _LEAST_ROWS))
        for piece in np.array_split(rows, pieces):
            block[piece] = len(owner)
            owner.append(int(k))
    return block, np.array(owner, dtype=np.intp)


def row_weights(data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> FloatArray:
    """Return one over the noise of all rows, zero where they tell nothing, (R, n) [1/(N m)]."""
    return np.concatenate([part.informative / s for part, s in zip(data, sigma, strict=True)])


def weighted_rows(
    rows: Sequence[FloatArray], data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> Iterator[FloatArray]:
    """Yield rows (M, n) or (M, n, P) of each trajectory with the weights of `row_weights`."""
    for own, part, s in zip(rows, data, sigma, strict=True):
        weight = row_weights([part], [s])
        yield own * (weight[:, :, np.newaxis] if own.ndim > 2 else weight)


def block_squares(residual: Sequence[FloatArray], evidence: Evidence) -> FloatArray:
    """Return the squares over the unit of what is left (M, n), by block and joint, (B, n)."""
    block, _ = block_rows(evidence.data)
    rows = np.concatenate(list(weighted_rows(residual, evidence.data, evidence.sigma)))
    return np.column_stack([np.bincount(block, column) for column in rows.T**2])


def fold_rows(data: Sequence[Trajectory]) -> npt.NDArray[np.intp]:
    """Return the part of the data of every row, a stretch of a recording."""
    recordings = len({part.fold for part in data})
    pieces = max(2, -(-PARTS // max(recordings, 1)))
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
        Basis of what the free columns make; orthonormal where nothing holds them.

    """

    basis: FloatArray

    def rest(self, values: FloatArray) -> FloatArray:
        """Return what is left of weighted rows (R, n) or (R, n, p)."""
        flat = values.reshape(len(self.basis), -1)
        return np.asarray((flat - self.basis @ (self.basis.T @ flat)).reshape(values.shape))

    def products(self, columns: FloatArray) -> FloatArray:
        """Return products, shape (p, p), of what is left of weighted columns (R n, p)."""
        made = self.basis.T @ columns
        return np.asarray(columns.T @ columns - made.T @ made)


def project(problem: Problem, free: Sequence[int], hold: FloatArray | None = None) -> Projection:
    """Find what the free columns can make, as far as their precision (f, f) lets them."""
    rows = problem.x[:, :, list(free)].reshape(-1, len(free))
    own = rows.T @ rows
    return Projection(rows @ informative_basis(own if hold is None else own + hold))
