# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What stands for noise and not for a cause."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.diagnosis.search.held_out import Trial
from armid_ros.diagnosis.search.round import Round
from armid_ros.motion import FloatArray
import numpy as np


def made_of_noise(trial: Trial, here: Round) -> bool:
    """
    Return whether a group explains noise of positions with that noise.

    What positions have beyond the motion is in the accelerations that the model takes, and so in
    what is left, and in columns that are derived from them.

    """
    effect, kept, work = trial.group.effect, trial.group.kept, here.work
    smooth = work.smooth_columns(effect, kept) * here.problem.weight[:, :, np.newaxis]
    least = here.settings.thresholds.smooth_share * _taken(here.own(trial.group), here)
    return _taken(smooth, here) < least


def explains_itself(trial: Trial, here: Round) -> bool:
    """
    Return whether a group leaves less than the noise of the torque that its columns are made of.

    Where most of a torque is what the model lacks, any function of the measured one explains that,
    its noise included.

    """
    own = here.projection.rest(here.own(trial.group))
    after = here.problem.chi2_per_row(here.left - own @ trial.values)
    before = np.minimum(here.problem.chi2_per_row(here.left), here.evidence.noise_share)
    return bool(np.any(after < here.settings.thresholds.below_noise * before))


def without_echo(trial: Trial, here: Round) -> Trial:
    """
    Return a trial without what noise of the torque makes of it; itself if that is nothing.

    Columns that are made of the measured torque follow its noise, which is in what is left as
    well. A function g of a signal goes with the noise of that signal, of variance s^2, as s^2 g'
    (Stein, Estimation of the mean of a multivariate normal distribution, 1981).

    """
    if not trial.group.effect.reads_torque:
        return trial
    echo = here.work.torque_echo(trial.group.effect, trial.group.kept, here.evidence.noise)
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
    own, aim = here.projection.products(flat), flat.T @ here.left.ravel()
    values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
    return float(2.0 * values @ aim - values @ own @ values)
