# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which candidates may be named: significant, possible, material, not made of noise, changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.diagnosis.search.patch import room
from armid_ros.diagnosis.search.search_state import SearchState, worth
from armid_ros.diagnosis.search.trial import Trial
from armid_ros.diagnosis.search.variance import Changed, Recordings, UsualSpread
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


def acceptable(trial: Trial, state: SearchState) -> bool:
    """Return whether a candidate is significant and possible, and its share exceeds its price."""
    return beyond_chance(trial, state) and worth(trial, state) > 0.0


def beyond_chance(trial: Trial, state: SearchState) -> bool:
    """Return whether a candidate is possible, and significant over all that were tried."""
    surely = trial.p * state.tried <= state.settings.thresholds.error_rate
    return surely and possible(trial, state)


def possible(trial: Trial, state: SearchState) -> bool:
    """Return whether the values are physically possible, and plausible for such an effect."""
    effect, arm, kept = trial.candidate.effect, state.work.arm, list(trial.candidate.kept)
    if not inside(trial, state).all():
        return False
    values, std = np.zeros((2, len(effect.parameters(arm.robot))))
    values[kept], std[kept] = trial.values, trial.deviation
    return effect.plausible(values, std, arm)


def inside(trial: Trial, state: SearchState) -> npt.NDArray[np.bool_]:
    """
    Return which values are within their bounds, shape (p,).

    One is beyond its bound by noise, or by what the law of the effect gets wrong: at the bound it
    explains nearly as much.

    """
    kept, thresholds = list(trial.candidate.kept), state.settings.thresholds
    lower, upper = (bound[kept] for bound in room(trial.candidate.effect, state.work.arm))
    inexact = np.sqrt(thresholds.tie) * np.abs(trial.values)
    slack = np.maximum(thresholds.surely * trial.deviation, inexact)
    return np.asarray((trial.values > lower - slack) & (trial.values < upper + slack))


def material(gains: FloatArray, state: SearchState, misfit_share: float) -> bool:
    """
    Return whether gains (n,) are material in any joint, and such a share of the misfit in all.

    A cause that acts in several joints shows in all of them together: its power over that of the
    misfit is summed over joints.

    """
    alone, beside = (state.evidence.least_squares(state.settings, x) for x in (0.0, misfit_share))
    return bool(np.any(gains >= alone) and np.sum(np.maximum(gains, 0.0) / beside) >= 1.0)


def material_sizes(trial: Trial, state: SearchState, misfit_share: float) -> FloatArray:
    """Return the size of each value, (p,), from which on what it makes alone is that material."""
    made = np.sum(state.own(trial.candidate) ** 2, axis=0) * trial.visible**2
    alone, beside = (
        made / state.evidence.least_squares(state.settings, x)[:, np.newaxis]
        for x in (0.0, misfit_share)
    )
    of_size_one = np.minimum(alone.max(axis=0), beside.sum(axis=0))
    return np.asarray(1.0 / np.sqrt(np.maximum(of_size_one, 1e-300)))


def without_echo(trial: Trial, state: SearchState) -> Trial:
    """
    Return a trial without the gain that is due to noise of the torque; itself if that is nothing.

    Columns that are made of the measured torque correlate with its noise, which is in the residual
    as well. The covariance of a function g of a signal and the noise of that signal, of variance
    s^2, is s^2 E[g'] (Stein, Estimation of the mean of a multivariate normal distribution, 1981).

    """
    if not trial.candidate.effect.reads_torque:
        return trial
    echo = state.work.torque_echo(
        trial.candidate.effect, trial.candidate.kept, state.evidence.noise
    )
    if not echo.any():
        return trial
    rows = np.einsum('rjp,rj->rp', echo, state.problem.weight**2)
    blocks = np.zeros((len(trial.cross), rows.shape[1]))
    np.add.at(blocks, state.problem.block, rows)
    made = np.sum(blocks * trial.fold_values[trial.fold], axis=1)
    return replace(trial, cross=trial.cross - made)


def changed(trial: Trial, state: SearchState) -> bool:
    """Return whether a candidate has changed since the baseline; true where nothing tells."""
    return state.tested is None or trial.candidate.key in state.tested.changed


def may_have_changed(trial: Trial, state: SearchState) -> bool:
    """Return whether more recordings may tell that a candidate has changed, where these do not."""
    return state.tested is not None and trial.candidate.key in state.tested.suspected


def tested(trials: Sequence[Trial], state: SearchState) -> Changed | None:
    """
    Test whether candidates have changed between the days; None where nothing tells.

    Nothing does without a baseline, or of one recording a day. Probabilities are corrected for the
    candidates that are tested.

    """
    if state.before is None:
        return None
    thresholds, today = state.settings.thresholds, _today(state)
    both = _recordings(state, today)
    found = {
        trial.candidate.key: both.variance(
            _own(trial, state, both, today),
            trial.candidate.precision,
            trial.freedom,
            thresholds.tie,
        )
        for trial in trials
    }
    seen = {key: one for key, one in found.items() if one is not None}
    usual = UsualSpread.of(seen.values(), thresholds.usual)
    if usual is None:
        return None
    chances = {key: usual.chance(one) for key, one in seen.items()}
    level = thresholds.unlikely / len(seen)
    most = usual.largest(level, max(sum(one.freedom) for one in seen.values()))
    return Changed(
        frozenset(key for key, chance in chances.items() if chance <= level),
        frozenset(key for key, chance in chances.items() if chance <= thresholds.unlikely),
        float(np.sqrt(usual.variance * most / both.before)),
    )


def _recordings(state: SearchState, parts: Sequence[npt.NDArray[np.bool_]]) -> Recordings:
    """Return the recordings of the baseline, those in question, and those nothing is fitted to."""
    assert state.before is not None
    later, rank = state.before.later, len(state.nuisance.free)
    before = list(state.before.prior.recordings(state.before.change))
    days = [(state.free[rows], state.problem.y[rows]) for rows in parts]
    today = [(free.reshape(-1, rank), y.ravel()) for free, y in days]
    if later is not None:
        today += zip(later.free, later.residual, strict=True)
    known = sum((NormalEquations.of_rows(*rows) for rows in today), start=state.nuisance.prior)
    free, residual = zip(*before, *today, strict=True)
    return Recordings.of(free, residual, [False] * len(before) + [True] * len(today), known)


def _own(
    trial: Trial, state: SearchState, both: Recordings, parts: Sequence[npt.NDArray[np.bool_]]
) -> list[FloatArray]:
    """Return the columns of a candidate in these recordings, each (S, p)."""
    assert state.before is not None
    baseline, arm, candidate = state.before.baseline, state.work.arm, trial.candidate
    before = baseline.columns(arm, candidate.effect, candidate.kept)
    sizes = [len(rest) for rest, late in zip(both.rest, both.today, strict=True) if not late]
    own = state.own(candidate)
    result = np.split(before, np.cumsum(sizes)[:-1])
    result += [own[rows].reshape(-1, candidate.size) for rows in parts]
    if state.before.later is not None:
        result += state.before.later.own(arm, candidate)
    return result


def _today(state: SearchState) -> list[npt.NDArray[np.bool_]]:
    """Return the rows of each recording in question, each (R,)."""
    data = state.evidence.data
    fold = np.concatenate([np.full(len(part.rows), part.fold) for part in data])
    return [fold == one for one in np.unique(fold)]
