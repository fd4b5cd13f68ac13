# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which candidates may be named: beyond chance, possible, material, and not made of noise."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.diagnosis.search.patch import room
from armid_ros.diagnosis.search.round import Round, worth
from armid_ros.diagnosis.search.trial import Trial
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


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
    slack = here.settings.thresholds.beyond_bounds * trial.deviation
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
    made = np.sum(blocks * trial.held_values[trial.piece], axis=1)
    return replace(trial, cross=trial.cross - made)


def _taken(columns: FloatArray, here: Round) -> float:
    """Return the squares that weighted columns (R, n, p) take of what is left."""
    flat = columns.reshape(-1, columns.shape[2])
    own, aim = here.projection.products(flat), flat.T @ here.residual.ravel()
    values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
    return float(2.0 * values @ aim - values @ own @ values)
