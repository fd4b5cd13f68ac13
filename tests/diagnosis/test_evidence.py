# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Columns are computed at a few times the rate of the rows, however fast a recording is."""

from armid_ros.diagnosis.data.trajectory import thinnable, trajectories
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import Motion
from armid_ros.recording import Recording
import numpy as np
import pytest


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
