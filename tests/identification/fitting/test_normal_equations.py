# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Normal equations of which data do not tell every direction."""

from armid_ros.identification.fitting.normal_equations import (
    informative_basis,
    informative_solution,
    NormalEquations,
)
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest


@given(st.integers(0, 1000), st.integers(1, 6))
def test_a_fit_is_the_same_in_any_units(seed, size):
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(40, size)) * 10.0 ** rng.uniform(-6.0, 6.0, size)
    basis = informative_basis(columns.T @ columns)
    y = rng.normal(size=40)
    fitted = columns @ (basis @ (basis.T @ (columns.T @ y)))
    scaled = columns / np.linalg.norm(columns, axis=0)
    expected = scaled @ np.linalg.lstsq(scaled, y)[0]
    np.testing.assert_allclose(fitted, expected, atol=1e-8)


def test_a_direction_that_is_not_told_stays_where_it_is():
    columns = np.column_stack([np.ones(10), np.ones(10), np.arange(10.0), np.zeros(10)])
    basis = informative_basis(columns.T @ columns)
    values = basis @ (basis.T @ (columns.T @ np.full(10, 3.0)))
    np.testing.assert_allclose(values, [1.5, 1.5, 0.0, 0.0], atol=1e-9)
    assert basis.shape == (4, 2)


@pytest.mark.parametrize(('apart', 'told'), [(1e-3, 2), (1e-6, 1)])
def test_a_direction_is_told_by_columns_that_differ_in_more_than_rounding(apart, told):
    first, second = np.linalg.qr(np.random.default_rng(2).normal(size=(50, 2)))[0].T
    columns = np.column_stack([first, first + apart * second])
    basis = informative_basis(columns.T @ columns)
    assert basis.shape == (2, told)
    fitted = columns @ (basis @ (basis.T @ (columns.T @ (first + second))))
    np.testing.assert_allclose(fitted, first + (told - 1) * second, atol=1e-5)


def rows(rng, count, size=3):
    return rng.normal(size=(count, size)), rng.normal(size=count)


def test_sources_that_are_independent_add_up_and_can_be_taken_away():
    rng = np.random.default_rng(4)
    (x, y), (more, z) = rows(rng, 20), rows(rng, 30)
    first, second = NormalEquations.of_rows(x, y), NormalEquations.of_rows(more, z)
    both = NormalEquations.of_rows(np.vstack([x, more]), np.concatenate([y, z]))
    for one, other in ((first + second, both), (both - second, first)):
        np.testing.assert_allclose(one.matrix, other.matrix, atol=1e-12)
        np.testing.assert_allclose(one.vector, other.vector, atol=1e-12)


def test_what_is_still_to_be_added_is_the_rest_of_the_solution():
    rng = np.random.default_rng(5)
    known, change = NormalEquations.of_rows(*rows(rng, 20)), rng.normal(size=3)
    rest = known.after(change)
    np.testing.assert_allclose(
        change + informative_solution(rest.matrix, rest.vector),
        informative_solution(known.matrix, known.vector),
    )


def test_more_values_are_zero_as_surely_as_they_are_known_to_be():
    rng = np.random.default_rng(6)
    known = NormalEquations.of_rows(*rows(rng, 20))
    more = known.and_zeros(np.array([2.0, 0.0]))
    solution = informative_solution(more.matrix, more.vector)
    expected = informative_solution(known.matrix, known.vector)
    np.testing.assert_allclose(solution, [*expected, 0.0, 0.0], atol=1e-12)
    assert more.matrix[3, 3] == 2.0
    np.testing.assert_array_equal(more.among(range(3)).matrix, known.matrix)
