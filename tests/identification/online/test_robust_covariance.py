# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Intervals of online estimates hold the truth as often as they say, whatever the noise."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.identification.online.recursive import WeightedSample
from armid_ros.identification.online.robust_covariance import RobustCovariance
from armid_ros.robots import load_robot
import numpy as np
import pytest
from scipy import signal

from tests.identification.conftest import Foreground, FRICTION, multisine


def coloured(shape, keep, rng):
    """Return noise of first order and unit variance."""
    white = rng.normal(size=(shape[0] + 500, *shape[1:]))
    return signal.lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0)[500:]


@pytest.mark.parametrize('keep', [0.0, 0.9])
def test_the_deviation_of_a_mean_is_that_of_theory(keep):
    """Of first-order noise: sqrt((1 + keep) / (1 - keep)) times that of white noise."""
    count = 40_000
    noise = coloured((count, 1), keep, np.random.default_rng(1))
    mean = noise.mean(axis=0)
    scores = RobustCovariance(400, 1.0, Foreground())
    for value in noise:
        scores.add(WeightedSample(np.ones((1, 1)), value, None), np.ones(1), mean)
    covariance = scores.covariance(np.array([[np.sqrt(count)]]))
    expected = np.sqrt((1.0 + keep) / (1.0 - keep) / count)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(expected, rel=0.15)


def test_residuals_are_those_of_the_latest_estimate():
    """A first guess that is far off leaves no trace, as it would in residuals that are kept."""
    rng = np.random.default_rng(2)
    rows, noise = rng.normal(size=(4000, 2, 3)), rng.normal(size=(4000, 2))
    truth = np.array([3.0, -2.0, 1.0])
    root = np.linalg.qr(rows.reshape(-1, 3), mode='r')
    covariances = []
    for first in (np.zeros(3), truth):
        scores = RobustCovariance(400, 1.0, Foreground())
        for k, (row, error) in enumerate(zip(rows, noise, strict=True)):
            sample = WeightedSample(row, row @ truth + error, None)
            scores.add(sample, np.ones(2), truth if k > 3000 else first)
        covariances.append(scores.covariance(root))
    np.testing.assert_allclose(covariances[0], covariances[1], rtol=1e-9)
    np.testing.assert_allclose(covariances[0], np.linalg.inv(root.T @ root), rtol=0.3, atol=3e-5)


@pytest.mark.parametrize('seed', range(70, 73))
def test_changes_of_what_is_hardly_excited_leave_a_covariance(seed):
    """Information that is lost to rounding when directions are forgotten is restored."""
    rng = np.random.default_rng(seed)
    size, rank = 12, rng.integers(2, 8)
    scores = RobustCovariance(16, 0.99, Foreground())
    basis, scale = rng.normal(size=(rank, size)), 10.0 ** rng.uniform(-3, 3, size)
    for k in range(400):
        rows, tau = rng.normal(size=(2, rank)) @ basis * scale, rng.normal(size=2)
        sample = WeightedSample(rows, tau, None)
        scores.add(sample, np.ones(2), rng.normal(size=size))
        if k % 50 == 40:
            chosen = rng.choice(size, rng.integers(1, 6), replace=False)
            scores.allow_change(np.eye(size)[:, chosen], rng.normal(size=size))
    covariance = scores.covariance(np.diag(scale))
    assert np.all(np.isfinite(covariance)) and np.all(np.diag(covariance) >= 0.0)


def test_after_a_change_the_noise_is_still_known():
    """The torques before do not fit the parameters now; that is no noise."""
    rng = np.random.default_rng(3)
    rows, noise = rng.normal(size=(4000, 1, 3)), rng.normal(size=(4000, 1))
    before, after = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, -4.0])
    scores, direction = RobustCovariance(400, 1.0, Foreground()), np.array([[0.0], [0.0], [1.0]])
    for row, error in zip(rows[:3900], noise[:3900], strict=True):
        scores.add(WeightedSample(row, row @ before + error, None), np.ones(1), before)
    scores.allow_change(direction, after)
    w = rows[:, 0]
    information = w.T @ w - np.outer(w.T @ w[:, 2], w.T @ w[:, 2]) / (w[:, 2] @ w[:, 2])
    information[2, 2] += 100.0
    covariance = scores.covariance(np.linalg.cholesky(information).T)
    expected = np.linalg.inv(information)
    np.testing.assert_allclose(np.diag(covariance), np.diag(expected), rtol=0.3)


@pytest.mark.long
def test_online_intervals_hold_in_coloured_noise():
    """
    Two joints with friction, encoder noise, torque noise that lasts, 20 times over.

    The share of 14 intervals that hold varies by 0.08 from one noise to the next; what is wanted,
    0.95 on average, falls below the bound once in 20 000 times. With the deviations of white
    noise it is 0.75.

    """
    robot = load_robot('humanoid_arm', joints=('shoulder_pitch', 'elbow_pitch'))
    arm = ArmModel(robot)
    for name, value in FRICTION.items():
        if name != 'torque_offset':
            arm = arm.with_effect(make_effect(name, robot), np.full(2, value))
    motion = multisine(robot.joints, 20.0, 100.0, seed=0)
    exact, rng = arm.torque(motion), np.random.default_rng(4)
    inside = []
    for _ in range(20):
        online = OnlineIdentifier(
            ArmModel(robot, arm.effects),
            OnlineSettings(false_alarm_time=None),
            rng=np.random.default_rng(0),
        )
        tau = exact + 0.05 * coloured(exact.shape, 0.97, rng)
        q = motion.q + 1e-4 * rng.normal(size=exact.shape)
        for sample in zip(motion.t, q, tau, strict=True):
            online.update(sample[0], sample[1], None, sample[2])
        ends, truth = online.estimate().interval(), online.base.values(arm.theta)
        inside.append(np.mean((ends[:, 0] < truth) & (truth < ends[:, 1])))
    assert 0.95 - 4.0 * 0.08 / np.sqrt(20) < np.mean(inside) < 1.0
