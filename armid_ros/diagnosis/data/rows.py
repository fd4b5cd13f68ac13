# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The linear problem of a diagnosis: weighted rows, divided into folds and blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

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

    @property
    def used(self) -> npt.NDArray[np.bool_]:
        """Which entries are informative, shape (R, n)."""
        return np.asarray(self.weight > 0.0)

    def chi2_per_row(self, residual: FloatArray) -> FloatArray:
        """Return the mean square of a weighted residual of each joint, shape (n,)."""
        return np.asarray(np.sum(residual**2, axis=0) / np.maximum(self.used.sum(axis=0), 1))

    def with_columns(self, columns: FloatArray) -> Problem:
        """Return the problem with more columns (R, n, p), not yet weighted, after its own."""
        more = columns * self.weight[:, :, np.newaxis]
        return replace(self, x=np.concatenate([self.x, more], axis=2))


def each_times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply each of some matrices (K, m, n) with its vector (K, n)."""
    return np.asarray((matrices @ vectors[:, :, np.newaxis])[:, :, 0])


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

    def products(self, columns: FloatArray) -> FloatArray:
        """Return the products of weighted columns (R n, p) with their residuals, shape (p, p)."""
        made = self.basis.T @ columns
        return np.asarray(columns.T @ columns - made.T @ made)


def project(
    problem: Problem, free: Sequence[int], prior: NormalEquations | None = None
) -> Projection:
    """Return the regression on the nuisance columns `free`, with a prior of their values."""
    rows = problem.x[:, :, list(free)].reshape(problem.y.size, len(free))
    own = rows.T @ rows
    return Projection(rows @ informative_basis(own if prior is None else own + prior.matrix))


@dataclass(frozen=True)
class Products:
    """
    Products of the columns of a problem, block by block.

    Attributes
    ----------
    free : ndarray, shape (B, f, f)
        Of the nuisance columns with each other.
    aim : ndarray, shape (B, f)
        Of the nuisance columns with the residual.
    border : ndarray, shape (B, f, C)
        Of the nuisance columns with those of the candidates.
    target : ndarray, shape (B, C)
        Of the columns of the candidates with the residual.
    own : tuple of ndarray, each (B, p, p)
        Of the columns of each candidate with each other.
    power : ndarray, shape (B,)
        Sum of squares of the residual.

    """

    free: FloatArray
    aim: FloatArray
    border: FloatArray
    target: FloatArray
    own: tuple[FloatArray, ...]
    power: FloatArray


def products(problem: Problem, free: Sequence[int], spans: Sequence[slice]) -> Products:
    """Return the products of a problem whose first columns are the candidates', a span each."""
    chosen = list(free)
    size = max((span.stop for span in spans), default=0)
    parts: list[list[FloatArray]] = [[] for _ in range(5)]
    own: list[list[FloatArray]] = [[] for _ in spans]
    for x, y in problem.blocks(problem.x, problem.y):
        f, c = x[:, chosen], x[:, :size]
        for part, value in zip(parts, (f.T @ f, f.T @ y, f.T @ c, c.T @ y, y @ y), strict=True):
            part.append(value)
        for products_of, span in zip(own, spans, strict=True):
            products_of.append(c[:, span].T @ c[:, span])
    stacked = [np.array(part) for part in parts]
    blocks = len(stacked[4])
    return Products(
        stacked[0],
        stacked[1].reshape(blocks, -1),
        stacked[2].reshape(blocks, len(chosen), size),
        stacked[3].reshape(blocks, -1),
        tuple(np.array(part) for part in own),
        stacked[4],
    )


def set_to_zero(
    known: Products, prior: NormalEquations, gone: Sequence[int], values: FloatArray
) -> tuple[Products, NormalEquations]:
    """
    Return products and prior as if some nuisance parameters were zero, and no candidates.

    Parameters
    ----------
    known : Products
        Of all nuisance columns.
    prior : NormalEquations
        Their prior.
    gone : sequence of int
        Positions of the parameters among them.
    values : ndarray, shape (g,)
        Their present values, whose torque is added to the residual.

    """
    there = list(gone)
    kept = np.setdiff1d(np.arange(len(prior.vector)), there)
    made = known.free[:, :, there] @ values
    power = known.power + (2.0 * known.aim + made)[:, there] @ values
    blocks = len(power)
    return (
        Products(
            known.free[:, kept][:, :, kept],
            (known.aim + made)[:, kept],
            np.empty((blocks, len(kept), 0)),
            np.empty((blocks, 0)),
            (),
            power,
        ),
        NormalEquations(
            prior.matrix[np.ix_(kept, kept)],
            (prior.vector + prior.matrix[:, there] @ values)[kept],
        ),
    )


def with_candidate(
    known: Products, problem: Problem, free: FloatArray, own: FloatArray
) -> Products:
    """
    Return the products of one candidate and the nuisance columns.

    Parameters
    ----------
    known : Products
        Of the nuisance columns.
    problem : Problem
        The rows.
    free : ndarray, shape (R, n, f)
        Weighted nuisance columns.
    own : ndarray, shape (R, n, p)
        Weighted columns of the candidate.

    """
    blocks = list(problem.blocks(free, own, problem.y))
    return replace(
        known,
        border=np.array([f.T @ x for f, x, _ in blocks]),
        target=np.array([x.T @ y for _, x, y in blocks]),
        own=(np.array([x.T @ x for _, x, _ in blocks]),),
    )


def beside_themselves(known: Products) -> Products:
    """Return the products of nuisance columns that consist of one candidate's and all others."""
    (own,), border = known.own, known.border
    return replace(
        known,
        free=np.block([[own, border.transpose(0, 2, 1)], [border, known.free]]),
        aim=np.concatenate([known.target, known.aim], axis=1),
    )


def of_nuisance(known: Products, span: slice) -> Products:
    """Return the products of a candidate whose columns are among the nuisance columns as well."""
    free = known.free[:, :, span]
    return replace(known, border=free, target=known.aim[:, span], own=(free[:, span],))
