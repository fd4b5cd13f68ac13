# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from armid_ros.estimate import ParameterName
from armid_ros.identification.online import recursive
from armid_ros.identification.online.recursive import (
    PRIOR_STD,
    RecursiveLeastSquares,
    WeightedSample,
)
import numpy as np
import pytest

NOISE = np.array([0.1, 1.0, 3.0])


def names(count):
    return tuple(ParameterName(f'p{number}', '', 'kg') for number in range(count))


def linear_data(rng, samples=300, count=8):
    """Return rows of columns from 1e-3 to 10 in size, torques with noise, and the truth."""
    theta = rng.normal(size=count)
    rows = rng.normal(size=(samples, len(NOISE), count)) * np.logspace(-3, 1, count)
    tau = rows @ theta + NOISE * rng.normal(size=(samples, len(NOISE)))
    return rows, tau, theta


def weighted(rows, tau, weights=1.0):
    """Return the stacked problem that a batch solver takes."""
    scale = np.sqrt(weights) / NOISE * np.ones(tau.shape)
    return (rows * scale[:, :, None]).reshape(-1, rows.shape[2]), (tau * scale).ravel()


def feed(estimator, rows, tau):
    for row, torque in zip(rows, tau, strict=True):
        estimator.update(row, torque)
    return estimator


@pytest.mark.parametrize('forgetting', [1.0, 0.99])
def test_samples_taken_together_teach_what_they_teach_one_by_one(forgetting, monkeypatch):
    rng = np.random.default_rng(11)
    rows, tau, _ = linear_data(rng, samples=60)
    weights = np.where(rng.random((60, 1)) < 0.2, 0.0, rng.random(tau.shape))
    samples = [WeightedSample(*some) for some in zip(rows, tau, weights, strict=True)]
    single, several, by_lapack = (
        RecursiveLeastSquares(names(8), NOISE, forgetting=forgetting) for _ in range(3)
    )
    for sample in samples:
        single.update(*sample)
    for first in range(0, 60, 7):
        several.update_together(samples[first : first + 7])
    monkeypatch.setattr(recursive, 'kernel', lambda: None)
    for sample in samples:
        by_lapack.update(*sample)
    np.testing.assert_allclose(by_lapack.values, single.values, rtol=1e-12)
    np.testing.assert_allclose(by_lapack.covariance, single.covariance, rtol=1e-12, atol=1e-14)
    assert by_lapack.variance_factor == pytest.approx(single.variance_factor, rel=1e-12)
    np.testing.assert_allclose(several.values, single.values, rtol=1e-8)
    np.testing.assert_allclose(several.covariance, single.covariance, rtol=1e-6)
    assert several.variance_factor == pytest.approx(single.variance_factor)
    assert several.samples == single.samples < 60


def test_equals_batch_least_squares_in_which_weights_count_as_repeated_observations():
    rng = np.random.default_rng(2)
    rows, tau, _ = linear_data(rng)
    weights = rng.choice([0.0, 0.3, 2.0], size=tau.shape)
    estimator = RecursiveLeastSquares(names(8), NOISE)
    for row, torque, weight in zip(rows, tau, weights, strict=True):
        estimator.update(row, torque, weight)
    w, y = weighted(rows, tau, weights)
    np.testing.assert_allclose(estimator.values, np.linalg.lstsq(w, y)[0], rtol=1e-6)
    np.testing.assert_allclose(estimator.covariance, np.linalg.inv(w.T @ w), rtol=1e-5, atol=1e-9)
    assert estimator.condition_number == pytest.approx(np.linalg.cond(w))
    assert estimator.samples == np.sum(weights.any(axis=1))


def test_unknown_noise_is_taken_from_the_residuals():
    rng = np.random.default_rng(4)
    rows = rng.normal(size=(2000, 3, 5))
    tau = rows @ np.arange(5.0) + 0.02 * rng.normal(size=(2000, 3))
    unknown = RecursiveLeastSquares(names(5), np.ones(3), scale_covariance=True)
    estimator = feed(unknown, rows, tau)
    assert np.sqrt(estimator.variance_factor) == pytest.approx(0.02, rel=0.05)
    w = rows.reshape(-1, 5)
    np.testing.assert_allclose(
        np.diag(estimator.covariance), 0.02**2 * np.diag(np.linalg.inv(w.T @ w)), rtol=0.1
    )


def test_what_is_never_excited_stays_at_the_start_and_looks_unknown():
    rows, tau, theta = linear_data(np.random.default_rng(5))
    rows[:, :, 3] = 0.0
    tau = rows @ theta
    start = np.full(8, 7.0)
    estimate = feed(RecursiveLeastSquares(names(8), NOISE, start=start), rows, tau).estimate
    assert estimate.values[3] == pytest.approx(7.0)
    assert estimate.std[3] == pytest.approx(PRIOR_STD)
    excited = np.arange(8) != 3
    np.testing.assert_allclose(estimate.values[excited], theta[excited], rtol=1e-4)


def test_forgetting_follows_a_slow_change():
    rng = np.random.default_rng(7)
    keeping = RecursiveLeastSquares(names(4), NOISE)
    forgetting = RecursiveLeastSquares(names(4), NOISE, forgetting=0.98)
    errors = {keeping: [], forgetting: []}
    for k in range(3000):
        theta = np.array([1.0 + np.sin(2 * np.pi * k / 3000), 2.0, 3.0, 4.0])
        rows = rng.normal(size=(3, 4))
        tau = rows @ theta + NOISE * rng.normal(size=3)
        for estimator, log in errors.items():
            estimator.update(rows, tau)
            log.append(estimator.values - theta)
    late = {e: np.sqrt(np.mean(np.square(log[500:]), axis=0)) for e, log in errors.items()}
    change = np.sqrt(0.5)
    assert late[forgetting][0] < 0.2 * change
    assert late[keeping][0] > 0.8 * change
    assert np.all(late[forgetting][1:] < 0.05)


def test_information_never_falls():
    rng = np.random.default_rng(9)
    estimator = RecursiveLeastSquares(names(5), NOISE, forgetting=0.95)
    for known in np.split(1e-2 * np.eye(6, 5), 2):
        estimator.update(known, known @ np.ones(5))
    before = estimator.covariance
    for _ in range(500):
        rows = rng.normal(size=(3, 5)) * 10.0 ** rng.uniform(-4, 2)
        estimator.update(rows, rows @ np.ones(5))
        after = estimator.covariance
        assert np.linalg.eigvalsh(before - after).min() > -1e-9 * np.linalg.eigvalsh(before).max()
        before = after


def test_what_is_learned_of_what_nothing_was_known_of_is_finite_where_a_joint_rests():
    """Two rows that bring more than 1e16 times what was known, and one that brings nothing."""
    estimator = RecursiveLeastSquares(names(3), np.ones(3), forgetting=0.99)
    for _ in range(3):
        estimator.update(np.diag([1e4, 1e4, 0.0]), np.array([1e4, -2e4, 0.0]))
    np.testing.assert_allclose(estimator.values, [1.0, -2.0, 0.0], atol=1e-9)
    assert np.all(np.isfinite(estimator.covariance))


@pytest.mark.parametrize('size', [1.0, 1e-3])
@pytest.mark.parametrize('forgetting', [1.0, 0.99])
def test_resting_arm_neither_forgets_nor_drifts(forgetting, size):
    """The same rows for 5 s at 1 kHz, at full strength or as weak as sensor noise."""
    rng = np.random.default_rng(10)
    theta = np.array([1.0, -2.0, 0.5, 3.0])
    estimator = RecursiveLeastSquares(names(4), NOISE[:2], forgetting=forgetting)
    for _ in range(3000):
        rows = rng.normal(size=(2, 4))
        estimator.update(rows, rows @ theta + NOISE[:2] * rng.normal(size=2))
    moved = estimator.estimate
    rows = size * rng.normal(size=(2, 4))
    tau = rows @ theta + NOISE[:2] * rng.normal(size=(5_000, 2))
    for torque in tau:
        estimator.update(rows, torque)
    rested = estimator.estimate
    assert np.all(rested.std <= moved.std * (1.0 + 1e-9))
    assert np.all(np.abs(rested.values - moved.values) < 3.5 * moved.std)
    # directions that no row touches have not been moved or sharpened at all
    silent = np.linalg.svd(rows)[2][2:]
    whitened = np.linalg.inv(moved.covariance) @ (rested.values - moved.values)
    assert np.abs(silent @ whitened).max() < 1e-6 * np.linalg.norm(whitened) + 1e-9
    if forgetting < 1.0:
        assert np.all(rested.std > 1e-3 * moved.std)


def test_with_more_parameters_it_begins_anew_and_equals_batch_of_all():
    """Whatever it had learned, and with fewer again it has learned what it had."""
    rows, tau, _ = linear_data(np.random.default_rng(13))
    estimator = feed(RecursiveLeastSquares(names(8)[:5], NOISE), rows[:, :, :5], tau)
    before = estimator.estimate
    wider = feed(estimator.with_more(names(8)[5:]), rows, tau)
    assert wider.parameters == names(8)
    w, y = weighted(rows, tau)
    np.testing.assert_allclose(wider.values, np.linalg.lstsq(w, y)[0], rtol=1e-6)
    np.testing.assert_array_equal(estimator.values, before.values)
    again = wider.restricted(5)
    np.testing.assert_allclose(again.values, before.values, rtol=1e-6)
    np.testing.assert_allclose(again.covariance, before.covariance, rtol=1e-6)
    assert again.variance_factor == pytest.approx(estimator.variance_factor)
