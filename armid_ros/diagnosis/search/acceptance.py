# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which candidates may be named: beyond chance, possible, material, not made of noise, and changed.

What a model gets wrong of one motion is another thing than what it gets wrong of the next, and of
hundreds of causes some lie along the difference of two days. Where nothing happened the recordings
of both days are exchangeable: divided into two groups in another way they show as much of a cause.
It has changed between the days if no other division shows more of it, or of many divisions hardly
one: a permutation test, which needs no distribution of the misfit.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice
from math import comb

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

#: Divisions that are tried; those that exchange fewest recordings first.
_DIVISIONS = 200


def acceptable(trial: Trial, here: Round) -> bool:
    """Return whether a cause is there beyond chance, pays for its freedom, and is possible."""
    return beyond_chance(trial, here) and worth(trial, here) > 0.0


def beyond_chance(trial: Trial, here: Round) -> bool:
    """Return whether a cause is there beyond chance, and is possible."""
    surely = trial.p * here.tried <= here.settings.thresholds.error_rate
    return surely and possible(trial, here)


def possible(trial: Trial, here: Round) -> bool:
    """Return whether the values are what could be called by the name."""
    effect, arm, kept = trial.candidate.effect, here.work.arm, list(trial.candidate.kept)
    if not inside(trial, here).all():
        return False
    values, std = np.zeros((2, len(effect.parameters(arm.robot))))
    values[kept], std[kept] = trial.values, trial.deviation
    return effect.plausible(values, std, arm)


def inside(trial: Trial, here: Round) -> npt.NDArray[np.bool_]:
    """Return which values are physically possible, or differ from that by noise, shape (p,)."""
    kept = list(trial.candidate.kept)
    lower, upper = (bound[kept] for bound in room(trial.candidate.effect, here.work.arm))
    slack = here.settings.thresholds.surely * trial.deviation
    return np.asarray((trial.values > lower - slack) & (trial.values < upper + slack))


def material(gains: FloatArray, here: Round, misfit_share: float) -> bool:
    """Return whether a cause that takes these squares of the joints takes as much as matters."""
    return bool(np.any(gains >= here.evidence.least_squares(here.settings, misfit_share)))


def made_of_noise(trial: Trial, here: Round) -> bool:
    """
    Return whether a candidate explains noise of positions with that noise.

    What positions have beyond the motion is in the accelerations that the model takes, and so in
    what is left, and in columns that are derived from them.

    """
    effect, kept, work = trial.candidate.effect, trial.candidate.kept, here.work
    smooth = work.smooth_columns(effect, kept) * here.problem.weight[:, :, np.newaxis]
    least = here.settings.thresholds.smooth_share * _taken(here.own(trial.candidate), here)
    return _taken(smooth, here) < least


def explains_itself(trial: Trial, here: Round) -> bool:
    """
    Return whether a candidate leaves less than the noise of the torque that makes its columns.

    Where most of a torque is what the model lacks, any function of the measured one explains that,
    its noise included.

    """
    own = here.projection.rest(here.own(trial.candidate))
    after = here.problem.chi2_per_row(here.residual - own @ trial.values)
    before = np.minimum(here.problem.chi2_per_row(here.residual), here.evidence.noise_share)
    return bool(np.any(after < here.settings.thresholds.below_noise * before))


def without_echo(trial: Trial, here: Round) -> Trial:
    """
    Return a trial without what noise of the torque makes of it; itself if that is nothing.

    Columns that are made of the measured torque follow its noise, which is in what is left as
    well. A function g of a signal goes with the noise of that signal, of variance s^2, as s^2 g'
    (Stein, Estimation of the mean of a multivariate normal distribution, 1981).

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


def _taken(columns: FloatArray, here: Round) -> float:
    """Return the squares that weighted columns (R, n, p) take of what is left."""
    flat = columns.reshape(-1, columns.shape[2])
    own, aim = here.projection.products(flat), flat.T @ here.residual.ravel()
    values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
    return float(2.0 * values @ aim - values @ own @ values)


@dataclass(frozen=True)
class Rows:
    """
    Rows of one recording, over the unit of the gap.

    Attributes
    ----------
    free : ndarray, shape (S, f)
        Columns of what is fitted beside a cause.
    own : ndarray, shape (S, p)
        Columns of the cause.
    residual : ndarray, shape (S,)
        What is left of the torque.

    """

    free: FloatArray
    own: FloatArray
    residual: FloatArray


def changed(trial: Trial, here: Round) -> bool:
    """Return whether hardly a division of the recordings shows more of a cause than the days."""
    if here.before is None:
        return True
    more, divisions = _showing_more(trial, here)
    return more == 0 or _seldom(more, divisions, here)


def surely_changed(trial: Trial, here: Round) -> bool:
    """Return whether so many divisions show less of a cause that a misfit hides no change."""
    if here.before is None or not _seldom(0, _count_divisions(here), here):
        return False
    return _seldom(*_showing_more(trial, here), here)


def _seldom(more: int, divisions: int, here: Round) -> bool:
    """Return whether chance makes the days stand out as they do in few cases of a hundred."""
    return more + 1 <= here.settings.thresholds.exchanged * (divisions + 1)


def _count_divisions(here: Round) -> int:
    """Return how many other divisions of the recordings are tried."""
    assert here.before is not None
    later = here.before.later
    first = len({part.fold for part in here.before.prior.data})
    second = len({part.fold for part in here.evidence.data})
    second += 0 if later is None else len(later.residual)
    exchanges = comb(first + second, first) - 1 - (first == second)
    return min(exchanges, _DIVISIONS)


def _showing_more(trial: Trial, here: Round) -> tuple[int, int]:
    """Return how many divisions show more of a cause than the days do, and of how many."""
    assert here.before is not None
    first, second = _before(trial, here), _today(trial, here)
    nuisance, later = here.nuisance, here.before.later
    if later is not None:
        more = later.own(here.work.arm, trial.candidate)
        second += [Rows(*rows) for rows in zip(later.free, more, later.residual, strict=True)]
    free = here.free.reshape(-1, len(nuisance.free))
    known = nuisance.prior + NormalEquations.of_rows(free, here.problem.y.ravel())
    if later is not None:
        for columns, left in zip(later.free, later.residual, strict=True):
            known = known + NormalEquations.of_rows(columns, left)
    return showing_more(first, second, known, trial.candidate.precision)


def showing_more(
    first: Sequence[Rows],
    second: Sequence[Rows],
    known: NormalEquations,
    precision: FloatArray,
) -> tuple[int, int]:
    """
    Return how many other divisions of recordings differ by more than two groups, and of how many.

    Parameters
    ----------
    first, second : sequence of Rows
        Recordings of the two groups.
    known : NormalEquations
        What all of them, and whatever is known besides, tell of the free values.
    precision : ndarray, shape (p,)
        How strongly the values of the cause are held to zero.

    """
    rows = [*first, *second]
    basis = informative_basis(known.matrix)
    free = basis @ (basis.T @ known.vector)
    border = np.array([basis.T @ (one.free.T @ one.own) for one in rows])
    own = np.array([one.own.T @ one.own for one in rows])
    aim = np.array([one.own.T @ (one.residual - one.free @ free) for one in rows])
    squares = np.diag(own.sum(axis=0)) + precision  # a planar arm shows some values of a body only

    def explained(members: npt.NDArray[np.bool_]) -> float:
        """Return the squares that go if a cause has one value in all and one more in some."""
        both = np.concatenate([border.sum(axis=0), border[members].sum(axis=0)], axis=1)
        part = own[members].sum(axis=0)
        products = np.block([[own.sum(axis=0), part], [part, part]]) - both.T @ both
        products += np.diag(np.tile(precision, 2))
        wanted = np.concatenate([aim.sum(axis=0), aim[members].sum(axis=0)])
        return float(wanted @ independent_inverse(products, np.tile(squares, 2)) @ wanted)

    days = np.arange(len(rows)) >= len(first)
    least = explained(days) * (1.0 + ROUNDING)
    others = [explained(other) for other in _divisions(days)]
    return sum(other > least for other in others), len(others)


def _divisions(days: npt.NDArray[np.bool_]) -> Iterator[npt.NDArray[np.bool_]]:
    """Yield other divisions into groups of the same sizes, but for the exchange of all."""
    before, today = np.flatnonzero(~days), np.flatnonzero(days)
    pairs = (
        (out, into)
        for count in range(1, min(len(before), len(today)) + 1)
        for out in combinations(today, count)
        for into in combinations(before, count)
        if count < len(today) or count < len(before)
    )
    for out, into in islice(pairs, _DIVISIONS):
        other = days.copy()
        other[list(out)], other[list(into)] = False, True
        yield other


def _before(trial: Trial, here: Round) -> list[Rows]:
    """Return the recordings from before, in which what was named since does nothing."""
    assert here.before is not None
    prior, change = here.before.prior, here.before.change
    candidate = trial.candidate
    own = here.before.baseline.columns(here.work.arm, candidate.effect, candidate.kept)
    result, start = [], 0
    for columns, left in prior.recordings(change):
        free = np.zeros((len(left), len(here.nuisance.free)))
        free[:, : columns.shape[1]] = columns
        result.append(Rows(free, own[start : start + len(left)], left))
        start += len(left)
    return result


def _today(trial: Trial, here: Round) -> list[Rows]:
    """Return the recordings in which a cause is looked for."""
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
