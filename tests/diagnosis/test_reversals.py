# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Beside a reversal dry friction may be wrong, by so much of itself as of the row is uncertain."""

from dataclasses import replace

from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.prepare import prepare
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

USED = Conditioning(200.0, 10.0, 11)


def prepared(bench, noise, arm=None, shaken=0.0):
    """Return recordings as they are looked at, with noise of torques and of positions."""
    rng = np.random.default_rng(3)
    recordings = [
        replace(
            one,
            tau=one.tau + noise * rng.normal(size=one.tau.shape),
            q=one.q + shaken * rng.normal(size=one.q.shape),
        )
        for one in bench.recordings()
    ]
    data = trajectories(recordings, USED)
    return prepare(arm or bench.arm, USED, data, DiagnosisSettings(), rng)


@pytest.mark.parametrize('shaken', [0.0, 3e-4, 1e-3])
def test_friction_is_wrong_by_no_more_than_what_is_uncertain_of_a_row(bench, shaken):
    found = prepared(bench, 0.0, shaken=shaken)
    left = np.concatenate([part.residual(bench.arm) for part in found.data])
    unsure = np.concatenate([part.unsure for part in found.data])
    near = (unsure > 0.05) & np.isfinite(unsure)
    noise = np.median([floor.sigma for floor in found.floors], axis=0)
    wrong = np.mean(left**2, axis=0, where=near) - 1.1 * noise**2
    assert np.all(near.sum(axis=0) > 40)
    assert np.all(wrong < np.mean((bench.friction[1] * unsure) ** 2, axis=0, where=near))


def test_friction_that_the_model_has_not_got_counts(bench):
    none = bench.arm.with_theta([*bench.robot.rigid_parameters, *(0.0 * bench.friction.ravel())])
    bare = type(bench.arm)(bench.robot)
    known, named, unknown = (prepared(bench, 0.3, arm).allowed for arm in (bench.arm, none, bare))
    np.testing.assert_allclose(named, known, rtol=0.1)
    np.testing.assert_allclose(unknown, known, rtol=0.1)
