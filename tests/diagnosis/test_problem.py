# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The weighted rows and their products."""

from armid_ros.diagnosis.data.rows import Problem, project
import numpy as np
import pytest


@pytest.fixture
def problem():
    """Three parts of the data, one of which is cut in two; some rows tell nothing."""
    rng = np.random.default_rng(0)
    fold = np.array([0] * 30 + [2] * 10 + [1] * 25 + [2] * 15)
    weight = rng.uniform(0.5, 2.0, (80, 2)) * (rng.uniform(size=(80, 2)) > 0.2)
    x = rng.normal(size=(80, 2, 4)) * weight[:, :, np.newaxis]
    return of_rows(x, rng.normal(size=(80, 2)) * weight, weight, fold)


def of_rows(x, y, weight, fold):
    together = np.concatenate([x, y[:, :, np.newaxis]], axis=2)
    parts = [together[fold == k].reshape(-1, together.shape[2]) for k in range(3)]
    return Problem(x, y, weight, fold, np.array([part.T @ part for part in parts]))


def test_more_columns_bring_their_products_of_every_part(problem):
    columns = np.random.default_rng(1).normal(size=(80, 2, 3))
    more = problem.with_columns(columns)
    whole = of_rows(more.x, more.y, more.weight, more.fold)
    np.testing.assert_allclose(more.products, whole.products, atol=1e-12)
    weighted = columns * problem.weight[:, :, np.newaxis]
    np.testing.assert_array_equal(more.x[:, :, 4:], weighted)


def test_products_of_what_is_left_need_not_know_what_is_left(problem):
    projection = project(problem, [0, 2])
    columns = problem.x[:, :, [1, 3]]
    left = projection.rest(columns).reshape(-1, 2)
    np.testing.assert_allclose(
        projection.products(columns.reshape(-1, 2)), left.T @ left, atol=1e-12
    )
