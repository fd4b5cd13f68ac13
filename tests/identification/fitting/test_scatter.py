# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The scatter of values between recordings is their variance, whatever makes them vary."""

from armid_ros.identification.fitting.held_out import jackknife
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import Motion
import numpy as np
import pytest

#: Of a recording, of which the scatter is asked.
LONG, NOISE = 80, 0.1


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
    return jackknife(problem, weights, values), std


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


def test_stretches_of_a_recording_are_one_and_what_one_recording_alone_shows_has_no_scatter():
    rng = np.random.default_rng(2)
    problem = [recording(rng, [1.0, 2.0], name) for name in ('one', 'two', 'one')]
    assert len(fitted(problem)[0]) == 2
    assert jackknife(problem[:1], np.ones((LONG, 2)), np.zeros(2)).shape == (0, 2)
    still = rng.normal(size=(LONG, 2, 2)) * [1.0, 0.0]
    others = [recording(rng, [3.0, 2.0], f'{k}', still) for k in range(2)]
    found, _ = fitted([problem[0], *others])
    assert np.all(found[1:, 0] != 0.0)
    np.testing.assert_array_equal(found[0, 1], 0.0)
