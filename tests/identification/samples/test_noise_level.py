# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The noise of predictions and the resolution of signals are measured as they are."""

from armid_ros.identification.samples.noise_level import NoiseLevel, WINDOW
from armid_ros.identification.samples.straight_line import Missed, robust_scale
import numpy as np
import pytest
from scipy import stats

PERIOD = 0.001


def learned(level, errors, moves):
    for error, move in zip(errors, moves, strict=True):
        level.learn(Missed(error, 1.0, 1.0), move)
        level.settle(PERIOD)
    return level.usual


def test_white_noise_is_measured_as_its_standard_deviation():
    signal = 0.2 * np.random.default_rng(0).normal(size=(50 * WINDOW + 2, 2))
    errors = signal[2:] - 2.0 * signal[1:-1] + signal[:-2]
    usual = learned(NoiseLevel(2), errors, np.diff(signal[1:], axis=0))
    np.testing.assert_allclose(usual.size, 0.2 * np.sqrt(6.0), rtol=0.35)
    assert np.all(usual.noisy > 0.5)


def test_the_loudest_window_of_the_last_minute_counts():
    level, rng = NoiseLevel(1), np.random.default_rng(0)
    loud = learned(level, rng.normal(size=(WINDOW, 1)), np.ones((WINDOW, 1)))
    quiet = learned(level, 0.01 * rng.normal(size=(WINDOW, 1)), np.ones((WINDOW, 1)))
    assert quiet.size == pytest.approx(loud.size)


def test_a_signal_at_rest_is_held_to_its_resolution():
    errors = np.zeros((WINDOW, 1))
    errors[:5] = 0.003
    moves = np.where(errors > 0.0, 0.003, 0.0)
    assert learned(NoiseLevel(1), errors, moves).size == pytest.approx(0.003)


def test_the_robust_scale_is_the_quantile_of_numpy():
    """Of which a normal variable of that standard deviation exceeds as many."""
    errors = np.random.default_rng(1).normal(size=(WINDOW, 4))
    expected = np.quantile(np.abs(errors), 0.95, axis=0) / stats.norm.ppf(0.975)
    np.testing.assert_allclose(robust_scale(errors, 0.95), expected, rtol=1e-12)
