# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The one test of changes: its statistic, its distribution and its correction for many."""

from armid_ros.changes.statistic import beyond_chance, limits, tail, two_means
import numpy as np
import pytest
from scipy import stats


def test_limits_are_exceeded_as_often_as_they_say():
    rank, freedom = np.array([1.0, 3.0, 6.0]), np.array([5.0, 40.0, 1e6])
    found = limits(1e-8, rank, freedom)
    np.testing.assert_allclose(tail(found, rank, freedom), 1e-8, rtol=1e-6)
    np.testing.assert_allclose(tail(found[2], 6.0), 1e-8, rtol=1e-3)


@pytest.mark.parametrize('freedom', [4.0, np.inf])
def test_of_one_parameter_it_is_the_test_of_student(freedom):
    student = stats.norm() if freedom == np.inf else stats.t(freedom)
    assert tail(3.0**2, 1, freedom) == pytest.approx(2.0 * student.sf(3.0))


def test_two_means_are_those_of_the_parts():
    rng = np.random.default_rng(1)
    x, std = rng.normal(size=9), rng.uniform(0.5, 2.0, 9)
    low, high, error = two_means(x, std**-2.0)
    assert low[3] == pytest.approx(np.average(x[:4], weights=std[:4] ** -2.0))
    assert high[3] == pytest.approx(np.average(x[4:], weights=std[4:] ** -2.0))
    parts = [1.0 / np.sum(std[part] ** -2.0) for part in (slice(4), slice(4, None))]
    assert error[3] == pytest.approx(np.sqrt(sum(parts)))


def test_of_many_true_null_hypotheses_one_in_twenty_lists_has_a_false_change():
    rng = np.random.default_rng(2)
    false = [any(beyond_chance(rng.uniform(size=30), 0.05)) for _ in range(2000)]
    assert 0.035 < np.mean(false) < 0.065
