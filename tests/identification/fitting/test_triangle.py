# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Triangles of rows: whatever the tree of their merges, the fit is that of all rows at once."""

import pickle

from armid_ros.identification import IdentificationSettings, identify, SignalSettings
from armid_ros.identification.fitting.least_squares import solve
from armid_ros.identification.fitting.triangle import (
    fit_scaled,
    fit_triangle,
    joint_std,
    Triangle,
    TriangleFit,
)
from armid_ros.identification.online.recursive import RecursiveLeastSquares
from armid_ros.identification.rows.regression import regressions
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

from ..conftest import multisine, recorded

USED = Conditioning(200.0, 20.0, 8)


@pytest.fixture(scope='module')
def problem(arm, structure):
    """Return the rows of five recordings in the base parameters."""
    theory = structure.base_parameters(np.random.default_rng(0))
    bags = [
        recorded(arm, multisine(arm.robot.joints, 20.0, 200.0, seed), seed, torque_noise=0.02)
        for seed in range(5)
    ]
    return regressions(structure, theory.independent, bags, USED)


def merged(triangles, fan_in):
    """Merge triangles in a tree."""
    while len(triangles) > 1:
        starts = range(0, len(triangles), fan_in)
        triangles = [Triangle.merged(triangles[k : k + fan_in]) for k in starts]
    return triangles[0]


@pytest.mark.parametrize('fan_in', [2, 3, 5])
def test_any_tree_gives_the_fit_of_all_rows(problem, fan_in):
    whole = solve(problem)
    tree = merged([Triangle.of([part]) for part in problem], fan_in)
    fit = fit_triangle(tree)
    np.testing.assert_allclose(fit.values, whole.values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(joint_std(tree, fit.values), whole.joint_std, rtol=1e-9)
    assert fit.condition_number == pytest.approx(whole.condition_number, rel=1e-9)


def test_recursion_batch_and_tree_agree(problem, structure):
    theory = structure.base_parameters(np.random.default_rng(0))
    whole = solve(problem)
    noise = 1.0 / np.max(whole.weights, axis=0)
    recursive = RecursiveLeastSquares(theory.parameters, noise)
    for part in problem:
        for rows, tau, told in zip(part.columns, part.tau, part.informative, strict=True):
            recursive.update(rows, tau, told.astype(float))
    tree = fit_scaled(merged([Triangle.of([part]) for part in problem], 2), noise)
    np.testing.assert_allclose(tree.values, whole.values, rtol=1e-9, atol=1e-12)
    # the recursion begins with a ridge, which is all that is between them
    np.testing.assert_allclose(recursive.values, whole.values, rtol=1e-6, atol=1e-9)


def test_squares_of_torques_and_residuals_are_those_of_the_rows(problem):
    triangle = merged([Triangle.of([part]) for part in problem], 2)
    values = np.random.default_rng(1).normal(size=triangle.rank)
    told = np.concatenate([part.informative for part in problem])
    tau = np.concatenate([part.tau for part in problem])
    left = tau - np.concatenate([part.columns for part in problem]) @ values
    np.testing.assert_allclose(triangle.torque_squares, np.sum(told * tau**2, axis=0))
    np.testing.assert_allclose(triangle.squares(values), np.sum(told * left**2, axis=0))
    np.testing.assert_array_equal(triangle.counts, told.sum(axis=0))


def test_some_columns_of_a_triangle_are_the_triangle_of_some_columns(problem):
    kept = np.arange(5, 30)
    small = Triangle.of(problem).restrict(kept)
    direct = Triangle.of([part.restrict(kept) for part in problem])
    for one, other in zip(small.factors, direct.factors, strict=True):
        np.testing.assert_allclose(one.T @ one, other.T @ other, rtol=1e-9, atol=1e-9)


def test_a_triangle_travels_packed_and_arrives_whole(problem):
    triangle = Triangle.of(problem)
    data = pickle.dumps(triangle)
    arrived = pickle.loads(data)
    np.testing.assert_array_equal(arrived.factors, triangle.factors)
    np.testing.assert_array_equal(arrived.counts, triangle.counts)
    assert len(data) < 0.45 * triangle.factors.nbytes


def test_the_size_of_a_triangle_is_that_of_its_columns_not_of_its_rows(problem):
    assert len(Triangle.of(problem[:1]).packed()) == len(Triangle.of(problem).packed())


def test_identify_is_the_fit_of_its_triangles(arm, structure):
    bags = [
        recorded(arm, multisine(arm.robot.joints, 20.0, 200.0, seed), seed, torque_noise=0.02)
        for seed in range(2)
    ]
    settings = IdentificationSettings('wls', SignalSettings(20.0, 8))
    result = identify(structure, bags, settings, rng=np.random.default_rng(0))
    rows = regressions(structure, result.base.independent, bags, result.used)
    fit = fit_triangle(merged([Triangle.of([part]) for part in rows], 2))
    np.testing.assert_allclose(fit.values, result.estimate.values, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize('condition', [1e2, 1e10, 1e13])
def test_a_covariance_is_positive_semi_definite_whatever_the_condition(condition):
    """A short motion hardly determines some values; the products lose them to rounding."""
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.standard_normal((40, 40)))[0]
    rows = rng.standard_normal((400, 40)) @ (np.geomspace(1.0, 1.0 / condition, 40) * axes).T
    fit = TriangleFit(np.zeros(40), np.ones(1), np.linalg.qr(rows)[1])
    found = fit.covariance(rows.T @ rows)
    std = np.sqrt(np.diag(found))
    correlations = found / np.outer(std, std)
    assert np.all(std > 0.0) and np.abs(correlations).max() < 1.0 + 1e-12
    assert np.linalg.eigvalsh(correlations).min() > -1e-12
    if condition < 1e3:
        np.testing.assert_allclose(found, np.linalg.inv(rows.T @ rows), rtol=1e-8)
