# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which candidates may be named: significant, possible, material, not made of noise, and changed.

The misfit of a model differs from motion to motion, and of hundreds of candidates some resemble
the difference of two days. Where nothing happened the recordings of both days are exchangeable:
divided into two groups in another way they show as much of a candidate. A candidate has changed
between the days if no other division shows more of it, or of many divisions hardly one: a
permutation test, which needs no distribution of the misfit.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice
from math import comb

from armid_ros.diagnosis.data.trajectory import count_recordings
from armid_ros.diagnosis.search.patch import room
from armid_ros.diagnosis.search.round import Round, worth
from armid_ros.diagnosis.search.trial import ROUNDING, Trial
from armid_ros.identification.fitting.normal_equations import (
    independent_inverse,
    informative_basis,
    NormalEquations,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Most divisions that are tried; those that exchange fewest recordings first.
_DIVISIONS = 200


def acceptable(trial: Trial, here: Round) -> bool:
    """Return whether a candidate is significant and possible, and its share exceeds its price."""
    return beyond_chance(trial, here) and worth(trial, here) > 0.0


def beyond_chance(trial: Trial, here: Round) -> bool:
    """Return whether a candidate is possible, and significant over all that were tried."""
    surely = trial.p * here.tried <= here.settings.thresholds.error_rate
    return surely and possible(trial, here)


def possible(trial: Trial, here: Round) -> bool:
    """Return whether the values are physically possible, and plausible for such an effect."""
    effect, arm, kept = trial.candidate.effect, here.work.arm, list(trial.candidate.kept)
    if not inside(trial, here).all():
        return False
    values, std = np.zeros((2, len(effect.parameters(arm.robot))))
    values[kept], std[kept] = trial.values, trial.deviation
    return effect.plausible(values, std, arm)


def inside(trial: Trial, here: Round) -> npt.NDArray[np.bool_]:
    """Return which values are within their bounds, or beyond them by noise at most, shape (p,)."""
    kept = list(trial.candidate.kept)
    lower, upper = (bound[kept] for bound in room(trial.candidate.effect, here.work.arm))
    slack = here.settings.thresholds.surely * trial.deviation
    return np.asarray((trial.values > lower - slack) & (trial.values < upper + slack))


def material(gains: FloatArray, here: Round, misfit_share: float) -> bool:
    """
    Return whether gains (n,) are material in any joint, and such a share of the misfit in all.

    A cause that acts in several joints shows in all of them together: its power over that of the
    misfit is summed over joints.

    """
    alone, beside = (here.evidence.least_squares(here.settings, x) for x in (0.0, misfit_share))
    return bool(np.any(gains >= alone) and np.sum(np.maximum(gains, 0.0) / beside) >= 1.0)


def material_sizes(trial: Trial, here: Round, misfit_share: float) -> FloatArray:
    """Return the size of each value, (p,), from which on what it makes alone is that material."""
    made = np.sum(here.own(trial.candidate) ** 2, axis=0) * trial.visible**2
    alone, beside = (
        made / here.evidence.least_squares(here.settings, x)[:, np.newaxis]
        for x in (0.0, misfit_share)
    )
    of_size_one = np.minimum(alone.max(axis=0), beside.sum(axis=0))
    return np.asarray(1.0 / np.sqrt(np.maximum(of_size_one, 1e-300)))


def without_echo(trial: Trial, here: Round) -> Trial:
    """
    Return a trial without the gain that is due to noise of the torque; itself if that is nothing.

    Columns that are made of the measured torque correlate with its noise, which is in the residual
    as well. The covariance of a function g of a signal and the noise of that signal, of variance
    s^2, is s^2 E[g'] (Stein, Estimation of the mean of a multivariate normal distribution, 1981).

    """
    if not trial.candidate.effect.reads_torque:
        return trial
    echo = here.work.torque_echo(trial.candidate.effect, trial.candidate.kept, here.evidence.noise)
    if not echo.any():
        return trial
    rows = np.einsum('rjp,rj->rp', echo, here.problem.weight**2)
    blocks = np.zeros((len(trial.cross), rows.shape[1]))
    np.add.at(blocks, here.problem.block, rows)
    made = np.sum(blocks * trial.fold_values[trial.fold], axis=1)
    return replace(trial, cross=trial.cross - made)


@dataclass(frozen=True)
class Rows:
    """
    Rows of one recording, weighted by the unit of the gap.

    Attributes
    ----------
    free : ndarray, shape (S, f)
        Nuisance columns.
    own : ndarray, shape (S, p)
        Columns of the candidate.
    residual : ndarray, shape (S,)
        Residual.

    """

    free: FloatArray
    own: FloatArray
    residual: FloatArray


def changed(trial: Trial, here: Round) -> bool:
    """
    Return whether a candidate has changed since the baseline; true where there is none.

    Either no other division of the recordings shows more of it, or the p-value of the permutation
    test is within its level.

    """
    if here.before is None:
        return True
    more, divisions = _showing_more(trial, here)
    return more == 0 or _seldom(more, divisions, here)


def surely_changed(trial: Trial, here: Round) -> bool:
    """Return whether the permutation test is significant: the change may be below the misfit."""
    return can_be_sure(here) and _seldom(*_showing_more(trial, here), here)


def can_be_sure(here: Round) -> bool:
    """Return whether there are so many divisions that the permutation test can be significant."""
    if here.before is None:
        return False
    first = count_recordings(here.before.prior.data)
    second = count_recordings(here.evidence.data)
    second += 0 if here.before.later is None else len(here.before.later.residual)
    return _seldom(0, min(count_divisions(first, second), _DIVISIONS), here)


def _seldom(more: int, divisions: int, here: Round) -> bool:
    """Return whether the p-value of the permutation test is within its level."""
    return more + 1 <= here.settings.thresholds.exchanged * (divisions + 1)


def count_divisions(first: int, second: int) -> int:
    """Return the number of other divisions of recordings into groups of two sizes."""
    return comb(first + second, first) - 1 - (first == second)


def _showing_more(trial: Trial, here: Round) -> tuple[int, int]:
    """Return how many other divisions show more of a candidate than the days, and of how many."""
    assert here.before is not None
    first, second = _before(trial, here), _today(trial, here)
    nuisance, later = here.nuisance, here.before.later
    if later is not None:
        more = later.own(here.work.arm, trial.candidate)
        second += [Rows(*rows) for rows in zip(later.free, more, later.residual, strict=True)]
    free = here.free.reshape(-1, len(nuisance.free))
    known = nuisance.prior + NormalEquations.of_rows(free, here.problem.y.ravel())
    if later is not None:
        for columns, residual in zip(later.free, later.residual, strict=True):
            known = known + NormalEquations.of_rows(columns, residual)
    faint = here.settings.thresholds.tie
    return showing_more(first, second, known, trial.candidate.precision, faint)


def showing_more(
    first: Sequence[Rows],
    second: Sequence[Rows],
    known: NormalEquations,
    precision: FloatArray,
    faint: float,
) -> tuple[int, int]:
    """
    Return how many other divisions show a larger change than two groups do, and of how many.

    Recordings that hardly show the candidate are not divided: to exchange them makes no other
    division. What one of the groups hardly shows has not changed as far as they tell.

    Parameters
    ----------
    first, second : sequence of Rows
        Recordings of the two groups.
    known : NormalEquations
        Of the nuisance parameters: all of these recordings, and their prior.
    precision : ndarray, shape (p,)
        Prior precision of the values of the candidate, about zero.
    faint : float
        Share of the squares of every column up to which a recording hardly shows the candidate.

    """
    rows = [*first, *second]
    basis = informative_basis(known.matrix)
    free = basis @ (basis.T @ known.vector)
    border = np.array([basis.T @ (one.free.T @ one.own) for one in rows])
    own = np.array([one.own.T @ one.own for one in rows])
    aim = np.array([one.own.T @ (one.residual - one.free @ free) for one in rows])
    squares = np.diag(own.sum(axis=0)) + precision  # a planar arm shows some values of a body only

    def explained(members: npt.NDArray[np.bool_]) -> float:
        """Return the squares that values common to all, and a change in some, explain."""
        both = np.concatenate([border.sum(axis=0), border[members].sum(axis=0)], axis=1)
        part = own[members].sum(axis=0)
        products = np.block([[own.sum(axis=0), part], [part, part]]) - both.T @ both
        products += np.diag(np.tile(precision, 2))
        wanted = np.concatenate([aim.sum(axis=0), aim[members].sum(axis=0)])
        return float(wanted @ independent_inverse(products, np.tile(squares, 2)) @ wanted)

    days = np.arange(len(rows)) >= len(first)
    shares = np.diagonal(own, axis1=1, axis2=2) / np.maximum(np.diag(own.sum(axis=0)), 1e-300)
    clear = np.max(shares, axis=1) > faint
    if not (np.any(clear & days) and np.any(clear & ~days)):
        return 1, 1
    least = explained(days & clear) * (1.0 + ROUNDING)
    others = [explained(other) for other in _divisions(days, clear)]
    return sum(other > least for other in others), len(others)


def _divisions(
    days: npt.NDArray[np.bool_], among: npt.NDArray[np.bool_]
) -> Iterator[npt.NDArray[np.bool_]]:
    """
    Yield the second group of other divisions of some recordings, shape (m,).

    Groups are of the same sizes; the exchange of both is no other division.

    """
    before, today = np.flatnonzero(~days & among), np.flatnonzero(days & among)
    pairs = (
        (out, into)
        for count in range(1, min(len(before), len(today)) + 1)
        for out in combinations(today, count)
        for into in combinations(before, count)
        if count < len(today) or count < len(before)
    )
    for out, into in islice(pairs, _DIVISIONS):
        other = days & among
        other[list(out)], other[list(into)] = False, True
        yield other


def _before(trial: Trial, here: Round) -> list[Rows]:
    """Return the recordings of the baseline; columns of what was named since are zero in them."""
    assert here.before is not None
    prior, change = here.before.prior, here.before.change
    candidate = trial.candidate
    own = here.before.baseline.columns(here.work.arm, candidate.effect, candidate.kept)
    result, start = [], 0
    for columns, residual in prior.recordings(change):
        free = np.zeros((len(residual), len(here.nuisance.free)))
        free[:, : columns.shape[1]] = columns
        result.append(Rows(free, own[start : start + len(residual)], residual))
        start += len(residual)
    return result


def _today(trial: Trial, here: Round) -> list[Rows]:
    """Return the recordings in question."""
    data = here.evidence.data
    fold = np.concatenate([np.full(len(part.rows), part.fold) for part in data])
    result = []
    for one in np.unique(fold):
        rows = fold == one
        free, own, y = (
            here.free[rows],
            here.own(trial.candidate)[rows],
            here.problem.y[rows].ravel(),
        )
        result.append(Rows(free.reshape(len(y), -1), own.reshape(len(y), -1), y))
    return result
