# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Where noise is white the jackknife has the variance of least squares, whoever moves when.

What values vary by from recording to recording is their variance, whatever makes them vary.

"""

from armid_ros.identification.fitting.normal_equations import jackknife, scatter
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import Motion
import numpy as np
import pytest

ROWS, DRAWS = 10, 1500
#: Of a recording, of which the scatter is asked.
LONG, NOISE = 80, 0.1


def fits(parts, noise):
    """Return values and deviations of a fit to all parts, and to all but each."""
    own = np.array([x.T @ x for x in parts])
    aim = np.array([x.T @ y for x, y in zip(parts, noise, strict=True)])

    def fit(left):
        inverse = np.linalg.pinv(own[left].sum(axis=0), hermitian=True)
        return inverse @ aim[left].sum(axis=0), np.sqrt(np.diag(inverse))

    held = [fit(np.arange(len(parts)) != k) for k in range(len(parts))]
    values, std = fit(np.full(len(parts), True))
    return values, std, np.array([one[0] for one in held]), np.array([one[1] for one in held])


@pytest.mark.slow
@pytest.mark.parametrize('size', [1, 2, 4])
@pytest.mark.parametrize('loud', [(1, 1, 1, 1, 1, 1), (1, 1, 1, 1, 1, 10), (1, 1, 1, 1, 5, 10)])
def test_white_noise_gives_the_variance_of_least_squares(size, loud):
    rng = np.random.default_rng(0)
    parts = [factor * rng.normal(size=(ROWS, size)) for factor in loud]
    found = np.zeros(size)
    for _ in range(DRAWS):
        values, std, *held = fits(parts, rng.normal(size=(len(parts), ROWS)))
        found += jackknife(values, std, *held) / DRAWS
    assert found == pytest.approx(std**2, rel=0.2)


def test_a_part_without_which_nothing_tells_a_value_counts_nothing():
    rng = np.random.default_rng(1)
    first, second = np.eye(2)[:1], np.eye(2)[1:]  # the second value is told by one part alone
    parts = [first * rng.normal(size=(ROWS, 1)) for _ in range(4)]
    parts.append(second * rng.normal(size=(ROWS, 1)))
    found = jackknife(*fits(parts, rng.normal(size=(5, ROWS))))
    assert found[1] == 0.0 < found[0]


def test_noise_that_lasts_makes_values_less_sure():
    rng = np.random.default_rng(2)
    parts = list(rng.normal(size=(8, ROWS, 1)) + 1.0)
    ratio = []
    for _ in range(DRAWS):
        values, std, *held = fits(parts, [np.full(ROWS, rng.normal()) for _ in parts])
        ratio.append(jackknife(values, std, *held)[0] / std[0] ** 2)
    rows, power = (np.array([f(x) for x in parts]) for f in (np.sum, lambda x: np.sum(x**2)))
    assert np.mean(ratio) == pytest.approx(np.sum(rows**2) / power.sum(), rel=0.1)


def recording(rng, values, source, columns=None):
    """Return rows of two joints that have values in one recording, with noise."""
    own = rng.normal(size=(LONG, 2, len(values))) if columns is None else columns
    tau = own @ np.asarray(values) + NOISE * rng.normal(size=(LONG, 2))
    still = np.zeros((LONG, 2))
    motion = Motion(('a', 'b'), np.arange(LONG), still, still, still, tau)
    return Regression(source, motion, np.ones(tau.shape, np.bool_), own)


def fitted(problem):
    """Return the scatter of a least-squares fit, and its standard deviations for noise."""
    rows = np.concatenate([part.columns.reshape(2 * LONG, -1) for part in problem])
    aim = np.concatenate([part.tau.ravel() for part in problem])
    values = np.linalg.lstsq(rows, aim, rcond=None)[0]
    weights = np.full((len(problem) * LONG, 2), 1.0 / NOISE)
    std = NOISE * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    return scatter(problem, weights, values), std


def test_noise_alone_makes_the_variance_that_least_squares_have():
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(40):
        problem = [recording(rng, [1.0, -2.0, 0.5], f'{k}') for k in range(4)]
        found, std = fitted(problem)
        ratios.append(np.sum(found**2, axis=0) / std**2)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)


def test_values_that_differ_from_recording_to_recording_have_the_variance_of_their_mean():
    rng = np.random.default_rng(1)
    squares = []
    for _ in range(40):
        drawn = rng.normal(size=(4, 3))
        problem = [recording(rng, own, f'{k}') for k, own in enumerate(drawn)]
        squares.append(np.sum(fitted(problem)[0] ** 2, axis=0))
    assert np.mean(squares) == pytest.approx(0.25, rel=0.15)


def test_stretches_of_one_recording_are_one():
    rng = np.random.default_rng(2)
    problem = [recording(rng, [1.0, 2.0], name) for name in ('one', 'two', 'one')]
    found, _ = fitted(problem)
    assert len(found) == 2
    assert scatter(problem[:1], np.ones((LONG, 2)), np.zeros(2)).shape == (0, 2)


def test_what_one_recording_alone_tells_has_no_scatter():
    rng = np.random.default_rng(3)
    still = rng.normal(size=(LONG, 2, 2)) * [1.0, 0.0]
    problem = [recording(rng, [1.0, 2.0], 'moves')]
    problem += [recording(rng, [3.0, 2.0], f'{k}', still) for k in range(2)]
    found, _ = fitted(problem)
    assert np.all(found[1:, 0] != 0.0)
    np.testing.assert_array_equal(found[0, 1], 0.0)
