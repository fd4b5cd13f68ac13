# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each half of the data predicts the other, as far as it tells what is asked."""

from armid_ros.identification.fitting.held_out import halves_error
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import Motion
import numpy as np
import pytest


def problem(columns, tau):
    informative = np.ones(tau.shape, np.bool_)
    still = np.zeros((len(tau), tau.shape[1]))
    motion = Motion(('a', 'b'), np.arange(len(tau)), still, still, still, tau)
    return [Regression('drawn', motion, informative, columns)]


def test_data_without_noise_that_cannot_tell_two_parameters_apart_predict_themselves():
    """Their residual is that of arithmetic alone, and no unit for anything."""
    rng = np.random.default_rng(0)
    one = rng.normal(size=(200, 2, 1))
    columns = np.concatenate([one, 2.0 * one], axis=2)
    tau = columns @ np.array([1.0, 2.0])
    weights = np.full(tau.shape, 1e12)
    assert halves_error(problem(columns, tau), weights, np.zeros(2)).whole < 1e-6


def test_an_error_is_that_of_the_noise():
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(4000, 2, 3))
    torque = columns @ np.array([1.0, 2.0, -1.0])
    tau = torque + 0.1 * rng.normal(size=torque.shape)
    error = halves_error(problem(columns, tau), np.full(tau.shape, 10.0), np.zeros(3))
    expected = 100.0 * 0.1 / np.sqrt(np.mean(tau**2, axis=0))
    assert error.joints == pytest.approx(expected, rel=0.05)
    assert error.whole == pytest.approx(np.mean(expected), rel=0.05)


def test_the_error_of_a_joint_is_a_share_of_its_own_torque():
    """A slide that takes newtons hides nothing of a wrist that is not predicted at all."""
    rng = np.random.default_rng(0)
    columns = np.zeros((4000, 2, 2))
    columns[:, 0, 0], columns[:, 1, 1] = rng.normal(size=(2, 4000))
    tau = columns @ np.array([100.0, 0.0]) + [0.0, 0.1] * rng.normal(size=(4000, 2))
    error = halves_error(problem(columns, tau), np.full(tau.shape, 10.0), np.zeros(2))
    assert error.whole < 1.0
    assert error.joints == pytest.approx([0.0, 100.0], abs=1.0)
