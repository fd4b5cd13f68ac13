# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Normal equations of which data do not tell every direction."""

from armid_ros.identification.fitting.normal_equations import (
    informative_basis,
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
