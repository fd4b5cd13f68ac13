# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What every candidate explains of data that its values were not fitted to.

All that is free is fitted together with a candidate to all parts of the data but one, and both
predict the part that was left out. What the candidate adds to that prediction, x, is compared with
what is left without it, r: the squares that go are 2 x'r - x'x, and the slope of r on x is one for
a cause and zero for what follows noise. Both are known block by block, so that their intervals
hold whatever the colour of the residual.

All of it is algebra on products of columns, a small matrix for each block.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.rows import Problem
from armid_ros.diagnosis.search.trial import Candidate, Trial
from armid_ros.identification.fitting.normal_equations import (
    DEPENDENT,
    independent_basis,
    informative_basis,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Squares over noise of columns that are rounding, whatever the units.
_NOTHING = 1e-100


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
    diagonal : ndarray, shape (B, C)
        Squares of the columns of the candidates.
    own : tuple of ndarray, each (B, p, p)
        Of the columns of each candidate with each other.
    power : ndarray, shape (B,)
        Squares of the residual.

    """

    free: FloatArray
    aim: FloatArray
    border: FloatArray
    target: FloatArray
    diagonal: FloatArray
    own: tuple[FloatArray, ...]
    power: FloatArray


def products(problem: Problem, free: Sequence[int], candidates: Sequence[Candidate]) -> Products:
    """Multiply columns; those of the candidates are the first of the problem."""
    chosen = list(free)
    size = max((candidate.columns.stop for candidate in candidates), default=0)
    blocks = int(problem.block.max()) + 1
    parts: list[list[FloatArray]] = [[] for _ in range(6)]
    own: list[list[FloatArray]] = [[] for _ in candidates]
    for block in range(blocks):
        rows = problem.block == block
        y = problem.y[rows].ravel()
        x = problem.x[rows].reshape(len(y), problem.x.shape[2])
        f, c = x[:, chosen], x[:, :size]
        values = f.T @ f, f.T @ y, f.T @ c, c.T @ y, np.einsum('ij,ij->j', c, c), y @ y
        for part, value in zip(parts, values, strict=True):
            part.append(value)
        for products_of, candidate in zip(own, candidates, strict=True):
            span = candidate.columns
            inner = c[:, span]
            one = candidate.size == 1
            products_of.append(values[4][span][:, np.newaxis] if one else inner.T @ inner)
    stacked = [np.array(part) for part in parts]
    return Products(
        stacked[0],
        stacked[1].reshape(blocks, -1),
        stacked[2].reshape(blocks, len(chosen), size),
        stacked[3].reshape(blocks, -1),
        stacked[4].reshape(blocks, -1),
        tuple(np.array(part) for part in own),
        stacked[5],
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
        diagonal=np.diagonal(inner, axis1=1, axis2=2),
        own=(inner,),
    )


@dataclass(frozen=True)
class _Base:
    """What is free, fitted to some blocks."""

    inverse: FloatArray
    theta: FloatArray
    border: FloatArray
    solved: FloatArray

    @classmethod
    def of(
        cls, known: Products, train: npt.NDArray[np.bool_], hold: FloatArray, pull: FloatArray
    ) -> _Base:
        own = known.free[train].sum(axis=0) + hold
        basis = informative_basis(own)
        inverse = basis @ basis.T
        border = known.border[train].sum(axis=0)
        return cls(
            inverse, inverse @ (known.aim[train].sum(axis=0) + pull), border, inverse @ border
        )


@dataclass(frozen=True)
class _Part:
    """
    A part that is held out.

    Attributes
    ----------
    test : ndarray of int, shape (b,)
        Its blocks, and ``train``, of bool, shape (B,), all others.
    base : _Base
        What is free, fitted to the others.
    left : ndarray, shape (b, f)
        Of the free columns with what that leaves.
    target : ndarray, shape (b, C)
        Of the columns of the candidates with what that leaves.
    spared : ndarray, shape (b, f, C)
        Of the free columns with what the others make of those of the candidates.

    """

    test: npt.NDArray[np.intp]
    train: npt.NDArray[np.bool_]
    base: _Base
    left: FloatArray
    target: FloatArray
    spared: FloatArray

    @classmethod
    def of(
        cls, known: Products, train: npt.NDArray[np.bool_], hold: FloatArray, pull: FloatArray
    ) -> _Part:
        base, test = _Base.of(known, train, hold, pull), np.flatnonzero(~train)
        free, border = known.free[test], known.border[test]
        left = known.aim[test] - free @ base.theta
        target = known.target[test] - base.theta @ border
        return cls(test, train, base, left, target, free @ base.solved)


def held_out(
    problem: Problem,
    free: Sequence[int],
    candidates: Sequence[Candidate],
    hold: FloatArray,
    pull: FloatArray,
    whole: bool = True,
) -> tuple[list[Trial], FloatArray]:
    """
    Try every candidate beside what is free.

    Parameters
    ----------
    problem : Problem
        Rows; columns of the candidates come first.
    free : sequence of int
        Columns that are fitted beside.
    candidates : sequence of Candidate
        What is tried.
    hold : ndarray, shape (f, f)
        Precision that free values are held with.
    pull : ndarray, shape (f,)
        What they are held to, times that.
    whole : bool
        Whether what holds the free values counts as data: what a candidate spares them there is a
        gain as well.

    Returns
    -------
    trials : list of Trial
        In the order of the candidates; those of which nothing is visible are left out.
    power : ndarray, shape (B,)
        Held-out squares without any of them.

    """
    return tried_beside(
        products(problem, free, candidates), problem, candidates, hold, pull, whole
    )


def tried_beside(
    known: Products,
    problem: Problem,
    candidates: Sequence[Candidate],
    hold: FloatArray,
    pull: FloatArray,
    whole: bool = True,
) -> tuple[list[Trial], FloatArray]:
    """Try every candidate, of which products are known; see `held_out`."""
    every = np.ones(len(known.power), dtype=bool)
    folding = problem.fold_of_block
    everything = _Base.of(known, every, hold, pull)
    parts = [_Part.of(known, folding != k, hold, pull) for k in range(folding.max() + 1)]
    power = _left(known, [part.base for part in parts], folding)
    counted = (hold, pull) if whole else (np.zeros_like(hold), np.zeros_like(pull))
    trials = [
        _tried(known, candidate, k, everything, parts, folding, counted)
        for k, candidate in enumerate(candidates)
    ]
    return [trial for trial in trials if trial is not None], power


def _left(known: Products, bases: Sequence[_Base], folding: npt.NDArray[np.intp]) -> FloatArray:
    """Return the held-out squares of every block beside what is free alone."""
    theta = np.array([base.theta for base in bases])[folding]  # of what is not held out: unused
    return np.asarray(
        known.power
        - 2.0 * np.einsum('bf,bf->b', theta, known.aim)
        + np.einsum('bf,bfg,bg->b', theta, known.free, theta)
    )


def _tried(
    known: Products,
    candidate: Candidate,
    position: int,
    everything: _Base,
    parts: Sequence[_Part],
    folding: npt.NDArray[np.intp],
    counted: tuple[FloatArray, FloatArray],
) -> Trial | None:
    span, own = candidate.columns, known.own[position]
    hold = np.diag(candidate.precision)
    border, target = known.border[:, :, span], known.target[:, span]
    whole = own.sum(axis=0)
    rest = whole - everything.border[:, span].T @ everything.solved[:, span]
    size = float(np.trace(whole))
    visible = float(np.sqrt(max(np.trace(rest), 0.0) / size)) if size > _NOTHING else 0.0
    if visible**2 < DEPENDENT:
        return None
    aim = target.sum(axis=0) - everything.border[:, span].T @ everything.theta
    squares = np.diag(whole)
    basis = independent_basis(rest + hold, squares)
    inverse = basis @ basis.T
    values = inverse @ aim
    cross, square = np.zeros((2, len(folding)))
    held_values, held_free = [], []
    for part in parts:
        test, base = part.test, part.base
        solved = base.solved[:, span]
        seen = own[part.train].sum(axis=0) - base.border[:, span].T @ solved + hold
        aim = target[part.train].sum(axis=0) - base.border[:, span].T @ base.theta
        basis = independent_basis(seen, squares)
        v = basis @ (basis.T @ aim)
        change = -solved @ v
        made = border[test] @ v
        cross[test] = part.target[:, span] @ v + part.left @ change
        square[test] = (own[test] @ v) @ v + (2.0 * made - part.spared[:, :, span] @ v) @ change
        share = 1.0 / (len(parts) * max(len(test), 1))
        cross[test] += share * change @ (counted[1] - counted[0] @ base.theta)
        square[test] += share * change @ counted[0] @ change
        held_values.append(v)
        held_free.append(base.theta + change)
    return Trial(
        candidate,
        values,
        np.sqrt(np.maximum(np.diag(inverse), 0.0)),
        np.diag(inverse @ rest),
        visible,
        cross,
        square,
        np.array(held_values),
        np.array(held_free),
        np.array([part.base.theta for part in parts]),
        folding,
    )
