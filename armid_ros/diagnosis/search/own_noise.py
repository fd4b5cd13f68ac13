# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What stands for noise and not for a cause."""

from __future__ import annotations

from armid_ros.diagnosis.data.rows import Problem, Projection
from armid_ros.diagnosis.search.held_out import Trial
from armid_ros.diagnosis.search.refine import Workspace
from armid_ros.motion import FloatArray
import numpy as np

#: Columns that take less than this share of their gain without the noise of positions beyond the
#: band of the motion are made of that noise.
_NOT_NOISE = 0.1
#: A group made of the measured torque that leaves less than this share of its noise explains noise
#: with itself.
_TAUTOLOGY = 0.8


def made_of_noise(
    trial: Trial, problem: Problem, projection: Projection, work: Workspace, noise: FloatArray
) -> bool:
    """
    Return whether a group explains noise with that noise.

    What positions have beyond the motion is in the accelerations that the model takes, and so in
    what is left, and in columns that are derived from them. And columns that are made of the
    measured torque can leave less than its noise, whose squares over the unit of the gap are given
    for every joint, (n,).

    """
    effect, kept = trial.group.effect, trial.group.kept
    left = projection.rest(problem.y)
    smooth = work.smooth_columns(effect, kept) * problem.weight[:, :, np.newaxis]
    rough = problem.x[:, :, trial.group.columns]
    if _taken(smooth, projection, left) < _NOT_NOISE * _taken(rough, projection, left):
        return True
    after = problem.chi2_per_row(left - projection.rest(rough) @ trial.values)
    before = np.minimum(problem.chi2_per_row(left), noise)
    return bool(np.any(after < _TAUTOLOGY * before)) and work.reads_torque(effect, kept)


def _taken(columns: FloatArray, projection: Projection, left: FloatArray) -> float:
    """Return the squares that weighted columns (R, n, p) take of what is left."""
    flat = columns.reshape(-1, columns.shape[2])
    own, aim = projection.products(flat), flat.T @ left.ravel()
    values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
    return float(2.0 * values @ aim - values @ own @ values)
