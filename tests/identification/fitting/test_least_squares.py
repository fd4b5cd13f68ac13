# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from armid_ros.identification.fitting.least_squares import solve
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import Motion
import numpy as np
import pytest
from scipy.signal import lfilter

TRUTH = np.array([2.0, -1.0, 0.5])
SCALE = np.array([0.1, 1.0])


def problem(rng, n_samples=400, noise=None, colour=0.0):
    """Return a two-joint problem with slowly varying columns, and AR(1) noise of given size."""
    t = np.arange(n_samples) / 50.0
    slow = np.column_stack([np.sin(0.7 * t), np.cos(1.3 * t), np.sin(2.9 * t + 1.0)])
    columns = np.stack([slow, slow[:, ::-1] * [1.0, -2.0, 0.5]], axis=1)
    white = rng.normal(size=(n_samples + 200, 2))
    coloured = lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], white, axis=0)[200:]
    tau = columns @ TRUTH + coloured * (SCALE if noise is None else noise)
    zero = np.zeros((n_samples, 2))
    motion = Motion(('a', 'b'), t, zero, zero, zero, tau)
    return Regression('bag', motion, np.ones((n_samples, 2), dtype=bool), columns)


def test_weights_find_the_noise_of_each_joint_and_pay():
    """With ten-fold different noise, weighting is worth about a factor in the deviation."""
    errors = {'ols': [], 'wls': []}
    for seed in range(60):
        data = [problem(np.random.default_rng(seed))]
        for method, found in errors.items():
            found.append(solve(data, method).values - TRUTH)
    spread = {method: np.std(found, axis=0) for method, found in errors.items()}
    assert np.all(spread['wls'] < 0.5 * spread['ols'])
    np.testing.assert_allclose(
        solve([problem(np.random.default_rng(0))]).joint_std, SCALE, rtol=0.1
    )


@pytest.mark.parametrize(
    ('colour', 'gap', 'tolerance'), [(0.0, 0, 0.25), (0.9, 0, 0.25), (0.8, 20, 0.2)]
)
def test_stated_deviations_are_the_scatter_over_repeats(colour, gap, tolerance):
    """
    The naive deviations of AR(1) noise with a = 0.9 are four times too small.

    A third of the rows may have no information, and any torque. Counted as rows without noise,
    they would make the deviations a third smaller.

    """
    told = np.tile(np.arange(60) >= gap, 25)[:, np.newaxis] & np.ones(2, dtype=bool)
    solutions = []
    for seed in range(150):
        whole = problem(np.random.default_rng(seed), 1500, colour=colour)
        motion = whole.motion.with_torque(np.where(told, whole.tau, 7.0))
        solutions.append(solve([replace(whole, motion=motion, informative=told)]))
    values = [s.values for s in solutions]
    stated = np.sqrt(np.mean([np.diag(s.covariance) for s in solutions], axis=0))
    np.testing.assert_allclose(np.mean(values, axis=0), TRUTH, atol=0.05)
    np.testing.assert_allclose(stated, np.std(values, axis=0, ddof=1), rtol=tolerance)


def test_no_gaps_make_deviations_that_are_out_of_all_proportion():
    """Of a motion with dwells the products of rows may be those of no noise at all."""
    stated = []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        lengths = rng.integers([5, 1], [40, 25], (40, 2)).ravel()
        told = np.repeat(np.tile([True, False], 40), lengths)[:200]
        data = replace(
            problem(rng, 200, colour=0.97), informative=told[:, np.newaxis] & [True, True]
        )
        stated.append(np.sqrt(np.diag(solve([data]).covariance)))
    usual = np.median(stated, axis=0)
    assert np.all(stated < 5.0 * usual)


def test_outliers_do_not_pull():
    data = problem(np.random.default_rng(1), noise=np.full(2, 0.05))
    tau = data.tau.copy()
    tau[::40] += 30.0
    spoiled = Regression('bag', data.motion.with_torque(tau), data.informative, data.columns)
    robust, plain = solve([spoiled], 'irls'), solve([spoiled], 'wls')
    assert np.abs(robust.values - TRUTH).max() < 0.03
    assert np.abs(plain.values - TRUTH).max() > 0.1
    assert robust.outliers >= 2 * len(tau[::40])


def test_bounds_hold_and_the_others_make_up_for_it():
    """With the second parameter held at zero, the fit is that without its column."""
    data = [problem(np.random.default_rng(4))]
    bounds = (np.array([-np.inf, 0.0, -np.inf]), np.full(3, np.inf))
    bounded = solve(data, 'wls', bounds)
    assert bounded.values[1] == 0.0
    free = solve(data)
    np.testing.assert_array_equal(solve(data, 'wls', (-bounds[1], bounds[1])).values, free.values)
    weights = 1.0 / free.joint_std
    columns = (data[0].columns * weights[:, None])[:, :, [0, 2]].reshape(-1, 2)
    expected = np.linalg.lstsq(columns, (data[0].tau * weights).ravel(), rcond=None)[0]
    np.testing.assert_allclose(bounded.values[[0, 2]], expected, rtol=1e-3)


def test_noise_that_the_fit_takes_is_made_up_for():
    """Regressor and noise have their power in one narrow band, where the residual has least."""
    rng = np.random.default_rng(0)
    t = np.arange(1200) / 50.0
    angle = 2.0 * np.pi * 0.125 * np.arange(1, 5) * t[:, np.newaxis]
    columns = np.concatenate([np.sin(angle), np.cos(angle)], axis=1)[:, np.newaxis]
    zero, used = np.zeros((1200, 1)), np.ones((1200, 1), dtype=bool)
    values, stated = [], []
    for _ in range(200):
        noise = lfilter([1.0], [1.0, -0.9], rng.normal(size=(1400, 1)), axis=0)[200:]
        motion = Motion(('a',), t, zero, zero, zero, noise)
        solution = solve([Regression('bag', motion, used, columns)])
        values.append(solution.values)
        stated.append(np.diag(solution.covariance))
    ratio = np.sqrt(np.mean(stated, axis=0)) / np.std(values, axis=0)
    assert 0.9 < np.sqrt(np.mean(ratio**2)) < 1.1
