# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What stands for noise and not for a cause."""

from __future__ import annotations

from armid_ros.diagnosis.data.rows import Problem, Projection
from armid_ros.diagnosis.search.held_out import Trial
from armid_ros.diagnosis.search.round import Round
from armid_ros.motion import FloatArray
import numpy as np


def made_of_noise(trial: Trial, problem: Problem, projection: Projection, here: Round) -> bool:
    """
    Return whether a group explains noise with that noise.

    What positions have beyond the motion is in the accelerations that the model takes, and so in
    what is left, and in columns that are derived from them. And columns that are made of the
    measured torque can leave less than its noise.

    """
    effect, kept, work = trial.group.effect, trial.group.kept, here.work
    thresholds = here.settings.thresholds
    left = projection.rest(problem.y)
    smooth = work.smooth_columns(effect, kept) * problem.weight[:, :, np.newaxis]
    rough = problem.x[:, :, trial.group.columns]
    if _taken(smooth, projection, left) < thresholds.smooth_share * _taken(
        rough, projection, left
    ):
        return True
    after = problem.chi2_per_row(left - projection.rest(rough) @ trial.values)
    before = np.minimum(problem.chi2_per_row(left), here.evidence.noise_share)
    return bool(np.any(after < thresholds.below_noise * before)) and work.reads_torque(
        effect, kept
    )


def _taken(columns: FloatArray, projection: Projection, left: FloatArray) -> float:
    """Return the squares that weighted columns (R, n, p) take of what is left."""
    flat = columns.reshape(-1, columns.shape[2])
    own, aim = projection.products(flat), flat.T @ left.ravel()
    values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
    return float(2.0 * values @ aim - values @ own @ values)
