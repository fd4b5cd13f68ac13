# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The distance of an estimate from the truth has the distribution that is stated beside it."""

from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.assess.agreement import Agreement
import numpy as np
import pytest

#: Freedom of a covariance that is known.
KNOWN = 1e9


def experiments(count, scale=1.0):
    """Draw estimates of 20 correlated parameters of very different sizes."""
    rng = np.random.default_rng(3)
    factor = rng.normal(size=(20, 20)) * np.logspace(-4, 2, 20)[:, np.newaxis]
    names = tuple(ParameterName(f'p{k}', 'joint', 'N m') for k in range(20))
    truth = rng.normal(size=20)
    for _ in range(count):
        values = truth + scale * factor @ rng.normal(size=20)
        yield Agreement.of(Estimate(names, values, factor @ factor.T), truth, KNOWN)


def test_nineteen_of_twenty_right_estimates_are_in_the_range():
    drawn = list(experiments(2000))
    assert np.mean([one.holds for one in drawn]) == pytest.approx(0.95, abs=0.015)
    assert np.mean([one.within for one in drawn]) == pytest.approx(drawn[0].expected, rel=0.01)
    too_small = [one.holds for one in experiments(500, scale=1.5)]
    assert np.mean(too_small) < 0.3


def test_a_covariance_from_few_values_widens_the_range():
    """Twenty parameters whose variance is that of forty residuals."""
    rng = np.random.default_rng(4)
    names = tuple(ParameterName(f'p{k}', 'joint', 'N m') for k in range(20))
    held = []
    for _ in range(2000):
        values, variance = rng.normal(size=20), np.mean(rng.normal(size=40) ** 2)
        estimate = Estimate(names, values, variance * np.eye(20))
        held.append([Agreement.of(estimate, np.zeros(20), free).holds for free in (40, KNOWN)])
    estimated, known = np.mean(held, axis=0)
    assert estimated == pytest.approx(0.95, abs=0.015)
    assert known < 0.9
