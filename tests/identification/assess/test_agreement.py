# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The distance of an estimate from the truth has the distribution that is stated beside it."""

from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.assess.agreement import Agreement
import numpy as np
import pytest


def experiments(count, scale=1.0):
    """Draw estimates of 20 correlated parameters of very different sizes."""
    rng = np.random.default_rng(3)
    factor = rng.normal(size=(20, 20)) * np.logspace(-4, 2, 20)[:, np.newaxis]
    names = tuple(ParameterName(f'p{k}', 'joint', 'N m') for k in range(20))
    truth = rng.normal(size=20)
    for _ in range(count):
        values = truth + scale * factor @ rng.normal(size=20)
        yield Agreement.of(Estimate(names, values, factor @ factor.T), truth)


def test_nineteen_of_twenty_right_estimates_are_in_the_range():
    drawn = list(experiments(2000))
    assert np.mean([one.holds for one in drawn]) == pytest.approx(0.95, abs=0.015)
    assert np.mean([one.within for one in drawn]) == pytest.approx(drawn[0].expected, rel=0.01)


def test_deviations_that_are_a_third_too_small_are_noticed():
    assert np.mean([one.holds for one in experiments(500, scale=1.5)]) < 0.3


def test_numbers_and_what_is_expected_of_them_are_in_the_sentence():
    one = next(experiments(1))
    said = one.sentence()
    assert f'{one.within} of 20' in said
    assert '(19 expected)' in said
    assert f'{one.lower:.0f} to {one.upper:.0f}' in said
