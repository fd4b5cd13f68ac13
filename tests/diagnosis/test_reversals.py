# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Beside a reversal dry friction may be wrong, by so much of itself as of the row is uncertain."""

from dataclasses import replace

from armid_ros.diagnosis.data.trajectory import trajectories, UNSURE
from armid_ros.diagnosis.prepare import prepare
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

USED = Conditioning(200.0, 10.0, 11)


def prepared(bench, noise, arm=None, without=0.0, shaken=0.0, misfit=False):
    """Return recordings as they are looked at, with noise, and with less of their friction."""
    rng = np.random.default_rng(3)
    recordings = [
        replace(
            one,
            tau=one.tau - without * friction(bench, one) + noise * rng.normal(size=one.tau.shape),
            q=one.q + shaken * rng.normal(size=one.q.shape),
        )
        for one in bench.recordings()
    ]
    data = trajectories(recordings, USED)
    arm = arm or bench.arm
    return prepare(arm, USED, data, DiagnosisSettings(), rng, misfit)


def friction(bench, recording):
    return bench.friction[1] * np.sign(np.gradient(recording.q, recording.t, axis=0))


def told(found):
    return np.concatenate([part.informative for part in found.data]).mean(axis=0)


@pytest.fixture(scope='module')
def quiet(bench):
    return prepared(bench, 0.0)


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


def test_rows_tell_more_of_a_motion_where_the_torque_is_noisier(bench, quiet):
    shares = [told(found) for found in (quiet, *(prepared(bench, size) for size in (0.3, 3.0)))]
    assert np.all(np.diff(shares, axis=0) > 0.05)


def test_allowed_is_a_quarter_of_noise_over_friction(bench):
    found = prepared(bench, 0.3)
    noise = np.sqrt(np.mean(np.square(found.sigma), axis=0))
    np.testing.assert_allclose(found.allowed, 0.25 * noise / bench.friction[1], rtol=0.1)
    assert np.all(found.allowed > UNSURE)


def test_an_arm_without_dry_friction_tells_all_of_its_motion(bench):
    found = prepared(bench, 0.3, without=1.0)
    assert np.all(told(found) > 0.95)


def test_friction_that_the_model_has_not_got_counts(bench):
    none = bench.arm.with_theta([*bench.robot.rigid_parameters, *(0.0 * bench.friction.ravel())])
    bare = type(bench.arm)(bench.robot)
    known, named, unknown = (prepared(bench, 0.3, arm).allowed for arm in (bench.arm, none, bare))
    np.testing.assert_allclose(named, known, rtol=0.1)
    np.testing.assert_allclose(unknown, known, rtol=0.1)


def test_no_row_is_refused_for_less_than_the_ends_of_the_filter(bench):
    np.testing.assert_array_less(UNSURE - 1e-12, prepared(bench, 0.0).allowed)


def test_rows_beside_reversals_do_not_count_where_the_unit_is_a_misfit(bench):
    found = prepared(bench, 0.3, misfit=True)
    np.testing.assert_array_equal(found.allowed, UNSURE)
