# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The linear problem of a diagnosis: weighted rows, in parts that are held out, in blocks.

What is known of base parameters before these rows, from the description and from other
recordings, is a problem of the same kind.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.effects.load import described_spread
from armid_ros.identification.fitting.normal_equations import (
    informative_basis,
    informative_solution,
)
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters, group_columns
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Parts that data are held out in, two of each recording at the least: what one fast recording
#: shows alone can be learned from half of it.
PARTS = 6
#: Blocks of each part of the data, of a second or two, which is longer than any correlation of
#: noise; a block has this many rows at the least.
BLOCKS, _LEAST_ROWS = 6, 8
#: Free columns of which the others leave less than this share of their length are grouped.
EXCITED = 1e-4


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
    rows = problem.x[:, :, list(free)].reshape(problem.y.size, len(free))
    own = rows.T @ rows
    return Projection(rows @ informative_basis(own if hold is None else own + hold))


@dataclass(frozen=True)
class Products:
    """
    Products of the columns of a problem, block by block.

    Attributes
    ----------
    free : ndarray, shape (B, f, f)
        Of the free columns with each other.
    aim : ndarray, shape (B, f)
        Of the free columns with the residual.
    border : ndarray, shape (B, f, C)
        Of the free columns with those of the candidates.
    target : ndarray, shape (B, C)
        Of the columns of the candidates with the residual.
    own : tuple of ndarray, each (B, p, p)
        Of the columns of each candidate with each other.
    power : ndarray, shape (B,)
        Squares of the residual.

    """

    free: FloatArray
    aim: FloatArray
    border: FloatArray
    target: FloatArray
    own: tuple[FloatArray, ...]
    power: FloatArray


def products(problem: Problem, free: Sequence[int], spans: Sequence[slice]) -> Products:
    """Multiply columns; those of the candidates, a span each, are the first of the problem."""
    chosen = list(free)
    size = max((span.stop for span in spans), default=0)
    blocks = int(problem.block.max()) + 1
    parts: list[list[FloatArray]] = [[] for _ in range(5)]
    own: list[list[FloatArray]] = [[] for _ in spans]
    for block in range(blocks):
        rows = problem.block == block
        y = problem.y[rows].ravel()
        x = problem.x[rows].reshape(len(y), problem.x.shape[2])
        f, c = x[:, chosen], x[:, :size]
        for part, value in zip(parts, (f.T @ f, f.T @ y, f.T @ c, c.T @ y, y @ y), strict=True):
            part.append(value)
        for products_of, span in zip(own, spans, strict=True):
            products_of.append(c[:, span].T @ c[:, span])
    stacked = [np.array(part) for part in parts]
    return Products(
        stacked[0],
        stacked[1].reshape(blocks, -1),
        stacked[2].reshape(blocks, len(chosen), size),
        stacked[3].reshape(blocks, -1),
        tuple(np.array(part) for part in own),
        stacked[4],
    )


def with_candidate(
    known: Products, problem: Problem, free: FloatArray, own: FloatArray
) -> Products:
    """
    Return the products of one candidate beside what is free.

    Parameters
    ----------
    known : Products
        Of what is free.
    problem : Problem
        The rows.
    free : ndarray, shape (R, n, f)
        Columns that are free.
    own : ndarray, shape (R, n, p)
        Columns of the candidate.

    """
    blocks, size = len(known.power), own.shape[2]
    border = np.empty((blocks, free.shape[2], size))
    target, inner = np.empty((blocks, size)), np.empty((blocks, size, size))
    for block in range(blocks):
        rows = problem.block == block
        x = own[rows].reshape(-1, size)
        border[block] = free[rows].reshape(len(x), -1).T @ x
        target[block] = x.T @ problem.y[rows].ravel()
        inner[block] = x.T @ x
    return replace(
        known,
        border=border,
        target=target,
        own=(inner,),
    )


@dataclass(frozen=True)
class Prior:
    """
    What other data tell of base parameters.

    Attributes
    ----------
    data : tuple of Trajectory
        Those data.
    rows : tuple of ndarray, each (M, n, r)
        Their columns over the unit of the gap.
    rest : tuple of ndarray, each (M, n)
        What the arm leaves of them, over the unit.

    """

    data: tuple[Trajectory, ...]
    rows: tuple[FloatArray, ...]
    rest: tuple[FloatArray, ...]

    @cached_property
    def columns(self) -> FloatArray:
        """Return a row for every joint and sample, shape (S, r)."""
        return np.concatenate([rows.reshape(-1, rows.shape[2]) for rows in self.rows])

    @cached_property
    def residual(self) -> FloatArray:
        """Return what is left in these rows, shape (S,)."""
        return np.concatenate([rest.ravel() for rest in self.rest])

    @cached_property
    def precision(self) -> FloatArray:
        """Products of the columns, shape (r, r)."""
        return np.asarray(self.columns.T @ self.columns)

    @cached_property
    def aim(self) -> FloatArray:
        """Products of the columns with what is left, shape (r,)."""
        return np.asarray(self.columns.T @ self.residual)

    def nearest(self, columns: FloatArray) -> FloatArray:
        """Return the changes of what is free that come nearest to columns (S, p), shape (r, p)."""
        return informative_solution(self.precision, self.columns.T @ columns)

    def recordings(self, change: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield the columns of each recording, (S, r), and what a change leaves of it, (S,)."""
        for fold in sorted({part.fold for part in self.data}):
            own = [k for k, part in enumerate(self.data) if part.fold == fold]
            rows = np.concatenate([self.rows[k].reshape(-1, len(change)) for k in own])
            yield rows, np.concatenate([self.rest[k].ravel() for k in own]) - rows @ change

    def regressions(self, change: FloatArray, named: int) -> list[Regression]:
        """Return the data as a problem in which so many more columns do not act."""
        return [
            Regression(
                part.at_rows.with_torque(rest - rows @ change),
                np.concatenate([rows, np.zeros((*rest.shape, named))], axis=2),
                part.informative,
                part.source,
            )
            for part, rows, rest in zip(self.data, self.rows, self.rest, strict=True)
        ]


def excited(
    arm: ArmModel, theory: BaseParameters, data: Sequence[Trajectory]
) -> tuple[BaseParameters, list[FloatArray]]:
    """Return what the motion can tell of rigid body and known effects, and its columns."""
    columns = [part.reduce(arm.columns(part.motion)[:, :, theory.independent]) for part in data]
    stacked = np.concatenate([block.reshape(-1, theory.rank) for block in columns])
    names = tuple(theory.standard[column] for column in theory.independent)
    kept = group_columns(stacked, names, tolerance=EXCITED)
    if kept.rank == theory.rank:
        return theory, columns
    base = replace(
        theory,
        parameters=tuple(theory.parameters[k] for k in kept.independent),
        independent=theory.independent[kept.independent],
        grouping=kept.grouping @ theory.grouping,
    )
    return base, [block[:, :, kept.independent] for block in columns]


def described_precision(base: BaseParameters, arm: ArmModel) -> FloatArray:
    """
    Return how strongly the description holds the base parameters, as a precision (r, r).

    It is believed to a factor or so: data decide whatever they tell, and what they tell hardly
    stays where it predicts other motions well. A value of zero of an effect is no description.

    """
    size = len(arm.robot.rigid_parameters)
    spread = np.full(len(base.standard), np.inf)
    spread[:size] = described_spread(arm.robot).ravel()
    known = np.abs(arm.theta[size:])
    spread[size:] = np.where(known > 0.0, known, np.inf)
    described = ~np.any((base.grouping != 0.0) & np.isinf(spread), axis=1)
    finite = np.where(np.isfinite(spread), spread, 0.0)
    grouped = base.grouping[described] * finite
    covariance = grouped @ grouped.T
    precision = np.zeros((base.rank, base.rank))
    precision[np.ix_(described, described)] = np.linalg.pinv(covariance, hermitian=True)
    return precision
