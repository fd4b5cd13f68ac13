# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Normal equations add up to the fit of all rows; what data do not tell is not changed."""

from armid_ros.identification.fitting.covariance import sandwich
from armid_ros.identification.fitting.least_squares import (
    factored,
    informative_basis,
    NormalEquations,
    solve,
    weighted_fit,
)
from armid_ros.identification.rows.regression import regressions
from armid_ros.identification.rows.signals import Conditioning
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from ..conftest import multisine, recorded

USED = Conditioning(200.0, 20.0, 8)


@pytest.fixture(scope='module')
def theory(structure):
    return structure.base_parameters(np.random.default_rng(0))


@pytest.fixture(scope='module')
def problem(arm, structure, theory):
    """Return the rows of five recordings in the base parameters."""
    bags = [
        recorded(arm, multisine(arm.robot.joints, 20.0, 200.0, seed), seed, torque_noise=0.02)
        for seed in range(5)
    ]
    return regressions(structure, theory.independent, bags, USED)


def added(problem):
    """Add up the normal equations of each recording."""
    first, *others = (NormalEquations.of([part]) for part in problem)
    return sum(others, first)


def test_the_fit_of_a_sum_is_that_of_all_rows(problem):
    whole, normal = solve(problem), NormalEquations.unpacked(added(problem).packed())
    fit = weighted_fit(normal)
    np.testing.assert_allclose(fit.values, whole.values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(normal.joint_std(fit.values), whole.joint_std, rtol=1e-9)
    rows = np.concatenate([part.columns for part in problem]) * whole.weights[:, :, np.newaxis]
    condition = np.linalg.cond(rows.reshape(-1, rows.shape[2]))
    assert np.linalg.cond(fit.factor) == pytest.approx(condition, rel=1e-6)


def test_squares_of_torques_and_residuals_are_those_of_the_rows(problem):
    normal = added(problem)
    values = np.random.default_rng(1).normal(size=normal.rank)
    told = np.concatenate([part.informative for part in problem])
    tau = np.concatenate([part.tau for part in problem])
    left = tau - np.concatenate([part.columns for part in problem]) @ values
    error = 100.0 * np.linalg.norm(told * left) / np.linalg.norm(told * tau)
    assert normal.relative_error_percent(values) == pytest.approx(error)
    np.testing.assert_allclose(normal.squares(values), np.sum(told * left**2, axis=0))
    np.testing.assert_array_equal(normal.counts, told.sum(axis=0))


@pytest.mark.parametrize('condition', [1e2, 1e10, 1e13])
def test_a_covariance_is_positive_semi_definite_whatever_the_condition(condition):
    """A short motion hardly determines some values; the products lose them to rounding."""
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.standard_normal((40, 40)))[0]
    rows = rng.standard_normal((400, 40)) @ (np.geomspace(1.0, 1.0 / condition, 40) * axes).T
    products = rows.T @ rows
    _, inverse = factored(products)
    found = sandwich(inverse @ inverse.T, products)
    std = np.sqrt(np.diag(found))
    correlations = found / np.outer(std, std)
    assert np.all(std > 0.0) and np.abs(correlations).max() < 1.0 + 1e-12
    assert np.linalg.eigvalsh(correlations).min() > -1e-12
    if condition < 1e3:
        np.testing.assert_allclose(found, np.linalg.inv(products), rtol=1e-8)


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


@pytest.mark.parametrize(('apart', 'told'), [(1e-3, 2), (1e-6, 1), (0.0, 1)])
def test_a_direction_is_told_by_columns_that_differ_in_more_than_rounding(apart, told):
    first, second = np.linalg.qr(np.random.default_rng(2).normal(size=(50, 2)))[0].T
    columns = np.column_stack([first, first + apart * second, 0.0 * first])
    basis = informative_basis(columns.T @ columns)
    assert basis.shape == (3, told) and not basis[2].any()
    fitted = columns @ (basis @ (basis.T @ (columns.T @ (first + second))))
    np.testing.assert_allclose(fitted, first + (told - 1) * second, atol=1e-5)
