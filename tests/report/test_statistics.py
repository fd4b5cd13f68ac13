# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a report says of residuals is there when it should be and not when it should not."""

from dataclasses import replace

from armid_ros.identification import Fit
from armid_ros.motion import Motion
from armid_ros.report.judgement import judge
from armid_ros.report.statistics import torque_reach, Trend, Whiteness
import numpy as np
import pytest


def fit_with(residual):
    """Return a fit of one joint whose residual is given, shape (N,)."""
    count = len(residual)
    zero = np.zeros((count, 1))
    motion = Motion(('joint',), 0.01 * np.arange(count), zero, zero, zero, residual[:, np.newaxis])
    return Fit('bag', motion, np.ones((count, 1), dtype=bool), zero)


def test_noise_goes_with_nothing():
    rng = np.random.default_rng(4)
    pairs = rng.standard_normal((50, 2, 2000))
    assert max(Trend.of(*pair).share for pair in pairs) < 0.03
    assert Trend.of(np.arange(100.0), np.ones(100)).share == 0.0


def test_a_residual_that_follows_a_variable_is_found_with_its_share():
    rng = np.random.default_rng(5)
    x = rng.uniform(-1.0, 1.0, 20_000)
    trend = Trend.of(x, np.sign(x) + rng.standard_normal(20_000))
    assert trend.share == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(trend.mean, np.sign(trend.centre), atol=0.15)


def test_white_noise_stays_in_its_band():
    rng = np.random.default_rng(6)
    outside = [Whiteness.of([fit_with(rng.standard_normal(1000))], 0).outside for _ in range(100)]
    assert np.mean(outside) == pytest.approx(0.01, abs=0.006)


def test_autocorrelation_of_a_sine_is_a_cosine():
    t = 0.01 * np.arange(20_000)
    whiteness = Whiteness.of([fit_with(np.sin(2.0 * np.pi * 5.0 * t))], 0)
    expected = np.cos(2.0 * np.pi * 5.0 * whiteness.lag)
    np.testing.assert_allclose(whiteness.correlation, expected, atol=0.01)
    assert whiteness.outside > 0.8


def test_missing_friction_is_seen_in_the_residual(case):
    ((source, fits),) = case.validation.items()
    coulomb = 0.1 * np.sign(fits[0].motion.dq)
    worse = replace(fits[0], predicted=fits[0].predicted - coulomb)
    beware, _ = judge(case.result, {source: (worse,)}, case.recordings)
    count = len(case.result.arm.robot.joints)
    assert any('speed' in line and f'{count} joints' in line for line in beware)


def test_what_reading_met_is_said(case):
    report = replace(case.recordings[0].report, duplicates=17)
    dirty = replace(case.recordings[0], report=report)
    beware, _ = judge(case.result, case.validation, [dirty])
    assert any('17' in line and dirty.source in line for line in beware)


def test_reach_of_the_torque_holds_what_noise_does_to_it(case):
    """Of the error of the predicted torque, the true one being known."""
    (fit,) = case.validation[case.recordings[1].source]
    reach = torque_reach(case.result, [fit])
    columns = case.truth.columns(fit.motion)[:, :, case.result.base.independent]
    error = columns @ (case.result.estimate.values - case.result.base.values(case.truth.theta))
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert np.all(rms < 2.0 * reach)
    assert np.median(rms / reach) > 0.1
