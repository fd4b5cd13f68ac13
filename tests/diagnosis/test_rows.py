# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rows of recordings: their rate, what is uncertain of them, and the columns of a discrepancy."""

from dataclasses import replace

from armid_ros.diagnosis.data.discrepancy import discrepancy_columns
from armid_ros.diagnosis.data.trajectory import thinnable, trajectories
from armid_ros.diagnosis.prepare import prepare
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import Motion
from armid_ros.recording import Recording
import numpy as np
import pytest

USED = Conditioning(200.0, 10.0, 11)


@pytest.fixture(scope='module')
def swings(bench):
    """Return twenty seconds of swings that were recorded at 1 kHz."""
    t, w = np.arange(20_000) / 1000.0, 2.0 * np.pi * 0.7
    angle = w * t[:, np.newaxis] + np.arange(bench.robot.n_joints)
    q, dq, ddq = 0.4 * np.sin(angle), 0.4 * w * np.cos(angle), -0.4 * w**2 * np.sin(angle)
    noise = np.random.default_rng(0).normal(size=q.shape)
    tau = bench.torque(Motion(bench.robot.joints, t, q, dq, ddq)) + 0.01 * noise
    return Recording(joints=bench.robot.joints, t=t, q=q + 1e-5 * noise, tau=tau, source='swings')


@pytest.mark.parametrize('decimation', range(1, 130, 2))
def test_a_prime_decimation_gives_way_to_one_that_a_motion_can_be_thinned_by(decimation):
    used = thinnable(Conditioning(1000.0, 5.0, decimation)).decimation
    assert 0.88 * decimation <= used <= decimation
    thin = max(d for d in range(1, max(1, used // 8) + 1) if used % d == 0)
    assert used / thin < 24


@pytest.mark.parametrize('cutoff', [10.0, 40.0, 80.0])
def test_squares_of_a_motion_are_below_half_of_the_rate_it_is_thinned_to(swings, cutoff):
    (part,) = trajectories([swings], Conditioning(1000.0, cutoff, 64))
    assert 4.0 * cutoff <= part.used.rate_hz <= 1000.0
    assert part.used.rate_hz / part.used.decimation == 1000.0 / 64


def test_a_decimation_that_was_asked_for_stays(swings):
    (part,) = trajectories([swings], Conditioning(1000.0, 20.0, 53))
    step = np.diff(part.t)
    np.testing.assert_allclose(step, 0.053, atol=1e-9)


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


def test_columns_are_a_unit_at_each_knot_and_of_one_joint(bench):
    """Hats of position and of velocity add up to one each; friction has a size of one."""
    data = trajectories(bench.recordings(), USED)
    found = np.concatenate(discrepancy_columns(data, bench.arm))
    each = found.shape[2] // 2
    assert not found[:, 0, each:].any() and not found[:, 1, :each].any()
    own = found[:, 1, each:]
    np.testing.assert_allclose(own[:, :4].sum(axis=1), 1.0)
    np.testing.assert_allclose(own[:, 4:10].sum(axis=1), 1.0)
    np.testing.assert_allclose(np.sqrt(np.mean(own[:, 10:] ** 2, axis=0)), 1.0)
