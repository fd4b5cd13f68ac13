# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a group predicts of data that it was not fitted to, beside a refit row by row."""

from dataclasses import dataclass

from armid_ros.diagnosis.data.rows import Problem
from armid_ros.diagnosis.search.held_out import held_out
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.effects import CATALOGUE
from armid_ros.identification.fitting.normal_equations import NormalEquations
import numpy as np
import pytest
from scipy import stats

FOLDS = np.repeat(np.arange(6), 6)
ROWS_OF_A_BLOCK, JOINTS, OWN, FREE = 20, 2, 2, 3


def make_problem(rng, cause=(0.0, 0.0), noise=1.0):
    """Return rows of which the first columns are a group's and the others free."""
    block = np.repeat(np.arange(len(FOLDS)), ROWS_OF_A_BLOCK)
    weight = 1.0 * (rng.uniform(size=(len(block), JOINTS)) > 0.2)
    x = rng.normal(size=(len(block), JOINTS, OWN + FREE)) * weight[:, :, np.newaxis]
    x[:, :, OWN] += 0.7 * x[:, :, 0]
    values = np.array([*cause, 1.0, -2.0, 0.5])
    y = x @ values + noise * rng.normal(size=weight.shape) * weight
    return Problem(x, y, weight, block, FOLDS)


@dataclass(frozen=True)
class Expected(CATALOGUE['viscous_friction']):
    """Friction of which values about zero are expected, as surely as these precisions say."""

    precision: tuple[float, ...] = (0.0, 0.0)

    def spread(self, robot, found=None):
        with np.errstate(divide='ignore'):
            return np.array(self.precision) ** -0.5


def group(bench, precision=(0.0, 0.0)):
    """Return the group whose columns come first."""
    effect = Expected(bench.robot.joints, precision=precision)
    return Candidate(effect, slice(0, OWN), (0, 1), bench.robot)


def held(rng):
    """Return what is known of free values."""
    root = rng.normal(size=(FREE, FREE))
    return NormalEquations(root @ root.T, rng.normal(size=FREE))


def with_own(precision, prior):
    """Return the same with values of the group ahead, known to be zero."""
    matrix = np.zeros((OWN + FREE, OWN + FREE))
    matrix[:OWN, :OWN], matrix[OWN:, OWN:] = np.diag(precision), prior.matrix
    return NormalEquations(matrix, np.concatenate([np.zeros(OWN), prior.vector]))


def refitted(problem, columns, prior, rows):
    """Fit columns to some rows by least squares."""
    x = problem.x[rows][:, :, columns].reshape(-1, len(columns))
    return np.linalg.solve(x.T @ x + prior.matrix, x.T @ problem.y[rows].ravel() + prior.vector)


def by_brute_force(problem, precision, prior):
    """Return what is left, what the group predicts of it, and the part of every row."""
    left, made = np.zeros_like(problem.y), np.zeros_like(problem.y)
    fold = FOLDS[problem.block]
    free, all_of_it = list(range(OWN, OWN + FREE)), list(range(OWN + FREE))
    whole = with_own(precision, prior)
    for part in range(6):
        train, test = fold != part, fold == part
        alone = refitted(problem, free, prior, train)
        both = refitted(problem, all_of_it, whole, train)
        without = problem.x[test][:, :, free] @ alone
        left[test] = problem.y[test] - without
        made[test] = problem.x[test] @ both - without
    return left, made, fold


def test_products_of_blocks_say_what_a_refit_says(bench):
    rng = np.random.default_rng(0)
    problem, precision = make_problem(rng, (0.5, -0.3)), (3.0, 0.5)
    prior = held(rng)
    left, made, _ = by_brute_force(problem, precision, prior)
    one, free = [group(bench, precision)], range(OWN, OWN + FREE)
    (trial,), power = held_out(problem, free, one, prior, whole=False)
    owner = problem.block
    expected = made * left, made**2
    for measured, rows in zip((trial.cross, trial.square), expected, strict=True):
        np.testing.assert_allclose(measured, np.bincount(owner, rows.sum(axis=1)), rtol=1e-8)
    gains = 2.0 * expected[0] - expected[1]
    assert trial.gain == pytest.approx(gains.sum(), rel=1e-8)
    own, beside = problem.x[:, :, :OWN], problem.x[:, :, OWN:]
    for measured, rows in zip(
        trial.left_out(problem.y, problem.block, own, beside), (left, left - made), strict=True
    ):
        np.testing.assert_allclose(measured, rows, atol=1e-8)
    joints = trial.joint_gains(problem.y, problem.block, own, beside)
    np.testing.assert_allclose(joints, gains.sum(axis=0), rtol=1e-8)
    np.testing.assert_allclose(power, np.bincount(owner, np.sum(left**2, axis=1)))


def test_values_are_those_of_least_squares_of_all_rows(bench):
    rng = np.random.default_rng(1)
    problem, precision = make_problem(rng, (0.5, -0.3)), (3.0, 0.5)
    prior = held(rng)
    (trial,), _ = held_out(problem, range(OWN, OWN + FREE), [group(bench, precision)], prior)
    whole = with_own(precision, prior)
    every = np.ones(len(problem.block), dtype=bool)
    expected = refitted(problem, list(range(OWN + FREE)), whole, every)
    np.testing.assert_allclose(trial.values, expected[:OWN], rtol=1e-8)
    assert 0.0 < trial.freedom < OWN


def trial_of(bench, seed, cause):
    """Return a group that is tried beside free columns that nothing holds."""
    problem = make_problem(np.random.default_rng(seed), cause)
    nothing = NormalEquations.none(FREE)
    (trial,), power = held_out(problem, range(OWN, OWN + FREE), [group(bench)], nothing)
    return trial, power


@pytest.mark.parametrize('seed', range(5))
def test_the_slope_of_a_cause_is_one(bench, seed):
    trial, power = trial_of(bench, seed, (0.8, -0.5))
    assert trial.slope == pytest.approx(1.0, abs=3.0 * trial.slope / trial.z)
    assert trial.p < 1e-4
    assert trial.replicated == 6
    assert 0.0 < trial.gain < power.sum()


def test_noise_is_seldom_a_cause(bench):
    p = np.array([trial_of(bench, seed, (0.0, 0.0))[0].p for seed in range(300)])
    low, _ = stats.binomtest(int(np.sum(p < 0.05)), len(p)).proportion_ci()
    assert low < 0.05
    assert np.mean(p < 0.5) > 0.2


def test_columns_that_free_ones_make_are_not_seen(bench):
    problem = make_problem(np.random.default_rng(2))
    problem.x[:, :, :OWN] = problem.x[:, :, OWN : 2 * OWN]
    nothing = NormalEquations.none(FREE)
    assert held_out(problem, range(OWN, OWN + FREE), [group(bench)], nothing)[0] == []
