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
from dataclasses import dataclass

from armid_ros.diagnosis.data.rows import Problem, Products, products
from armid_ros.diagnosis.search.trial import Candidate, Trial
from armid_ros.identification.fitting.normal_equations import (
    independent_inverse,
    informative_basis,
    UNINFORMATIVE,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Squares over noise of columns that are rounding, whatever the units.
_NOTHING = 1e-100


@dataclass(frozen=True)
class _Fits:
    """
    What is free, fitted to all blocks but those of each part, and last to all of them.

    Attributes
    ----------
    train : ndarray, shape (K + 1, B)
        One for the blocks that each fit is of.
    theta : ndarray, shape (K + 1, f)
        Values.
    border : ndarray, shape (K + 1, f, C)
        Of the free columns with those of the candidates, and ``solved`` what is free makes of
        them.
    left : ndarray, shape (B, f)
        Of the free columns with what the fit to the other parts leaves.
    target : ndarray, shape (B, C)
        Of the columns of the candidates with the same.
    made : ndarray, shape (B, f, C)
        Of the free columns with twice those of the candidates, less what the other parts make of
        these.

    """

    train: FloatArray
    theta: FloatArray
    border: FloatArray
    solved: FloatArray
    left: FloatArray
    target: FloatArray
    made: FloatArray

    @classmethod
    def of(
        cls, known: Products, part: npt.NDArray[np.intp], hold: FloatArray, pull: FloatArray
    ) -> _Fits:
        """Fit what is free; ``part`` of each block, shape (B,)."""
        train = np.ones((int(part.max()) + 2, len(part)))
        train[part, np.arange(len(part))] = 0.0
        border = np.tensordot(train, known.border, 1)
        aim = train @ known.aim + pull
        theta, solved = np.empty_like(aim), np.empty_like(border)
        for k, own in enumerate(np.tensordot(train, known.free, 1)):
            basis = informative_basis(own + hold)
            theta[k], solved[k] = basis @ (basis.T @ aim[k]), basis @ (basis.T @ border[k])
        others = theta[part]
        return cls(
            train,
            theta,
            border,
            solved,
            known.aim - _times(known.free, others),
            known.target - _times(known.border.transpose(0, 2, 1), others),
            2.0 * known.border - known.free @ solved[part],
        )


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Multiply each of some matrices (K, m, n) with its vector (K, n)."""
    return np.asarray((matrices @ vectors[:, :, np.newaxis])[:, :, 0])


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
        products(problem, free, [one.columns for one in candidates]),
        problem,
        candidates,
        hold,
        pull,
        whole,
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
    part = problem.fold_of_block
    fits = _Fits.of(known, part, hold, pull)
    theta = fits.theta[part]
    power = known.power - np.sum(theta * (known.aim + fits.left), axis=1)
    counted = (hold, pull) if whole else (np.zeros_like(hold), np.zeros_like(pull))
    trials = [
        _tried(known, candidate, k, fits, part, counted) for k, candidate in enumerate(candidates)
    ]
    return [trial for trial in trials if trial is not None], power


def _tried(
    known: Products,
    candidate: Candidate,
    position: int,
    fits: _Fits,
    part: npt.NDArray[np.intp],
    counted: tuple[FloatArray, FloatArray],
) -> Trial | None:
    span, own = candidate.columns, known.own[position]
    border, solved = fits.border[:, :, span], fits.solved[:, :, span]
    whole = own.sum(axis=0)
    rest = np.tensordot(fits.train, own, 1) - border.transpose(0, 2, 1) @ solved
    size = float(np.trace(whole))
    visible = float(np.sqrt(max(np.trace(rest[-1]), 0.0) / size)) if size > _NOTHING else 0.0
    if visible**2 < UNINFORMATIVE:
        return None
    aim = fits.train @ known.target[:, span] - _times(border.transpose(0, 2, 1), fits.theta)
    inverse = independent_inverse(rest + np.diag(candidate.precision), np.diag(whole))
    values = _times(inverse, aim)
    change = -_times(solved, values)
    v, moved = values[part], change[part]
    cross = np.sum(fits.target[:, span] * v, axis=1) + np.sum(fits.left * moved, axis=1)
    square = np.sum(_times(own, v) * v, axis=1)
    square += np.sum(_times(fits.made[:, :, span], v) * moved, axis=1)
    hold, pull = counted
    held, alone = change[:-1], fits.theta[:-1]
    share = 1.0 / (len(held) * np.maximum(np.bincount(part), 1))
    cross += (share * np.sum(held * (pull - alone @ hold), axis=1))[part]
    square += (share * np.sum(held * (held @ hold), axis=1))[part]
    std = np.sqrt(np.maximum(np.diagonal(inverse, axis1=1, axis2=2), 0.0))
    return Trial(
        candidate,
        values[-1],
        std[-1],
        np.diag(inverse[-1] @ rest[-1]),
        visible,
        cross,
        square,
        values[:-1],
        std[:-1],
        alone + held,
        alone,
        part,
    )
