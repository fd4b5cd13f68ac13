# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the criteria mean."""

from armid_ros.errors import TrajectoryError
from armid_ros.estimate import ParameterName
from armid_ros.excitation import DesignProblem, DesignSettings
from armid_ros.excitation.search.criteria import Criterion, Information
from armid_ros.model import random_motion
import numpy as np
import pytest

from ..conftest import with_effects


@pytest.fixture
def w():
    return np.random.default_rng(0).normal(size=(40, 5)) @ np.diag([1.0, 2.0, 5.0, 0.3, 1.0])


def spectral(name, scale, balance=0.0):
    count = len(scale)
    return Criterion(name, scale, np.ones(count, dtype=bool), np.zeros(count), balance)


def names(count):
    return tuple(ParameterName(f'p{i}', '', '-') for i in range(count))


@pytest.mark.parametrize(('factor', 'unseen'), [(0.0, [1]), (3.0, [0, 1])])
def test_parameters_that_are_not_seen_or_confounded_have_infinite_deviations(w, factor, unseen):
    w[:, 1] = factor * w[:, 0]
    std = Information(names(5), w.T @ w, np.ones(5)).std
    assert np.flatnonzero(np.isinf(std)).tolist() == unseen


def test_condition_number_is_that_of_the_regressor_not_of_its_square(w):
    information = Information(names(5), w.T @ w, np.ones(5))
    assert information.condition == pytest.approx(np.linalg.cond(w))
    cost = spectral('condition', np.ones(5)).cost(w.T @ w)
    assert cost == pytest.approx(np.log(np.linalg.cond(w)))


def test_costs_are_those_of_the_covariance(w):
    covariance = np.linalg.inv(w.T @ w)
    scale = np.array([1.0, 0.5, 0.2, 3.0, 1.0])
    scaled = covariance / np.outer(scale, scale)
    expected = {
        'D': np.linalg.slogdet(covariance)[1] / 5,
        'A': np.log(np.trace(scaled) / 5),
        'E': np.log(np.linalg.eigvalsh(scaled)[-1]),
    }
    for name, value in expected.items():
        assert spectral(name, scale).cost(w.T @ w) == pytest.approx(value)
    balanced = expected['D'] + 2.0 * np.log(np.linalg.cond(w))
    assert spectral('D', scale, 2.0).cost(w.T @ w) == pytest.approx(balanced)


@pytest.mark.parametrize('name', ['E', 'condition'])
def test_smooth_cost_is_just_above_the_cost(w, name):
    criterion = spectral(name, np.ones(5))
    cost, smooth = criterion.cost(w.T @ w), criterion.smooth(w.T @ w)[0]
    assert cost <= smooth <= cost + np.log(5) / 12.0


def test_subset_is_judged_with_the_others_fitted(w):
    wanted = np.array([False, True, False, True, False])
    covariance = np.linalg.inv(w.T @ w)[np.ix_([1, 3], [1, 3])]
    cost = Criterion('D', np.ones(5), wanted, np.zeros(5)).cost(w.T @ w)
    assert cost == pytest.approx(np.linalg.slogdet(covariance)[1] / 2)


@pytest.mark.parametrize('spoil', ['nothing', 'equal', 'idle', 'all idle'])
def test_rival_is_judged_by_its_best_fit_of_columns_that_may_be_dependent(w, spoil):
    """One joint that moves slowly: of the rival's columns some are equal, or nothing happens."""
    w = w.copy()
    if spoil == 'equal':
        w[:, 1] = w[:, 0]
    w[:, {'idle': [1], 'all idle': [0, 1, 2]}.get(spoil, [])] = 0.0
    values = np.array([0.0, 0.0, 0.0, 0.7, -2.0])
    torque = w @ values
    fitted = w[:, :3] @ np.linalg.lstsq(w[:, :3], torque, rcond=None)[0]
    lacking = np.array([False, False, False, True, True])
    criterion = Criterion('T', np.ones(5), lacking, values)
    cost, gradient = criterion.smooth(w.T @ w)
    assert cost == pytest.approx(-np.log(np.sum((torque - fitted) ** 2)))
    assert np.all(np.isfinite(gradient))


def test_rival_needs_criterion_t_and_a_difference(two_link_arm, two_link):
    rng = np.random.default_rng(0)
    arm, rival = with_effects(two_link, 'torque_offset'), with_effects(two_link)
    with pytest.raises(TrajectoryError, match='torque_offset'):
        DesignProblem.of(arm, DesignSettings(criterion='T'), rng, rival)
    with pytest.raises(TrajectoryError, match="'T'"):
        DesignProblem.of(two_link_arm, DesignSettings(), rng, rival)
    with pytest.raises(TrajectoryError, match='rival'):
        DesignProblem.of(two_link_arm, DesignSettings(criterion='T'), rng)


def test_gravity_target_has_the_gravity_composites_only(humanoid):
    settings = DesignSettings(target='gravity')
    problem = DesignProblem.of(with_effects(humanoid), settings, np.random.default_rng(0))
    assert problem.base.rank == 12
    assert not any(p.name.startswith('I') for p in problem.base.parameters)


def test_payload_is_visible_when_the_arm_is_known(humanoid):
    arm = with_effects(humanoid, 'payload')
    rng = np.random.default_rng(0)
    assert DesignProblem.of(arm, DesignSettings(target='effects'), rng).base.rank == 10
    with pytest.raises(TrajectoryError, match=r"payload.*'effects'"):
        DesignProblem.of(arm, DesignSettings(focus=('payload',)), rng)


def test_information_of_two_recordings_adds_up(two_link_arm):
    rng = np.random.default_rng(0)
    problem = DesignProblem.of(two_link_arm, DesignSettings(), rng)
    motion = random_motion(two_link_arm.robot, rng, 60)
    whole = problem.information(motion).matrix
    parts = [problem.information(motion.select(s)).matrix for s in (slice(0, 20), slice(20, 60))]
    np.testing.assert_allclose(sum(parts), whole, rtol=1e-10, atol=1e-9)
    repeated = problem.information(motion, n_recorded=180).matrix
    np.testing.assert_allclose(repeated, 3.0 * whole, rtol=1e-10, atol=1e-9)
