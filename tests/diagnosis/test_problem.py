# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The weighted rows and what free columns leave of them."""

from types import SimpleNamespace

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import Problem, project
from armid_ros.diagnosis.data.trajectory import block_rows, trajectories
from armid_ros.diagnosis.search.candidates import candidates
from armid_ros.diagnosis.search.explain import nuisance_of
from armid_ros.diagnosis.search.fit import fit, Start
from armid_ros.diagnosis.search.trial import SelectedEffect
from armid_ros.effects import CATALOGUE
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest


@pytest.fixture
def problem():
    """Blocks of rows of which some tell nothing."""
    rng = np.random.default_rng(0)
    block = np.repeat(np.arange(4), 20)
    weight = rng.uniform(0.5, 2.0, (80, 2)) * (rng.uniform(size=(80, 2)) > 0.2)
    x = rng.normal(size=(80, 2, 4)) * weight[:, :, np.newaxis]
    return Problem(x, rng.normal(size=(80, 2)) * weight, weight, block, np.array([0, 0, 1, 1]))


@pytest.mark.parametrize('rows', [1, 2, 7, 13, 60, 200])
def test_every_block_has_rows(rows):
    """A short stretch makes folds of a row or two."""
    parts = [SimpleNamespace(fold=k, rows=np.arange(count)) for k, count in enumerate((rows, 90))]
    block, fold = block_rows(parts)
    assert np.all(np.bincount(block, minlength=len(fold)) > 0)
    assert len(block) == rows + 90


def test_products_of_what_is_left_need_not_know_what_is_left(problem):
    projection = project(problem, [0, 2])
    columns = problem.x[:, :, [1, 3]]
    left = projection.rest(columns).reshape(-1, 2)
    np.testing.assert_allclose(
        projection.products(columns.reshape(-1, 2)), left.T @ left, atol=1e-12
    )


def test_shapes_of_a_name_are_held_by_what_all_data_tell_of_them(bench):
    def hidden(motion, tau):
        return [0.0, 0.2] * np.sign(motion.dq) * np.exp(-((motion.dq / 0.3) ** 2))

    data = trajectories(bench.recordings(hidden), Conditioning(200.0, 10.0, 11))
    sigma = [np.full(2, 0.01)] * len(data)
    effect = CATALOGUE['stribeck_friction'].on(bench.robot, ('elbow',)).with_shape((0.2, 2.0))
    evidence, start = Evidence.over_noise(data, sigma), Start([np.array([0.2])])
    fitted = fit(bench.arm, [SelectedEffect(effect, (0,))], evidence, None, start)
    assert fitted.named[0].effect.shape[0] == pytest.approx(0.3, rel=0.2)
    found = candidates(fitted, evidence, [CATALOGUE['viscous_friction']])
    problem, nuisance = nuisance_of(found, fitted, evidence)
    value, *shapes = np.sum(problem.x[:, :, list(nuisance.free)] ** 2, axis=(0, 1))
    assert value > 0.0
    np.testing.assert_allclose(np.diag(nuisance.prior.matrix), [0.0, *shapes])
