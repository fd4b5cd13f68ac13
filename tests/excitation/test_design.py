# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Designs: better than chance, inside every limit, the same for the same seed."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    check_limits,
    ClearanceModel,
    design,
    DesignProblem,
    DesignSettings,
    evaluate,
    random_feasible,
)
import numpy as np
import pytest

from .conftest import with_effects


def test_a_run_of_more_than_a_day_is_refused_before_it_is_searched_for():
    with pytest.raises(TrajectoryError, match=r'1e\+09 s.*day'):
        DesignSettings(period=5e8)


def coefficients(result):
    return result.excitation.trajectory.coefficients


@pytest.fixture(scope='module')
def humanoid_design(humanoid, humanoid_collision, quick):
    arm = with_effects(humanoid, 'viscous_friction', 'coulomb_friction')
    settings = replace(quick, period=10.0, starts=1, iterations=40)
    rng = np.random.default_rng(0)
    return arm, design(arm, settings, rng, collision=humanoid_collision)


@pytest.mark.parametrize('criterion', ['D', 'E'])
def test_design_beats_random_trajectories(two_link_arm, quick, criterion):
    settings = replace(quick, criterion=criterion, starts=1)
    rng = np.random.default_rng(1)
    problem = DesignProblem.of(two_link_arm, settings, rng)
    chance = [
        evaluate(problem, random_feasible(two_link_arm, problem.limits, 6.0, 3, rng))
        for _ in range(30)
    ]
    result = design(two_link_arm, settings, np.random.default_rng(2))
    assert result.cost < min(one.cost for one in chance)
    if criterion == 'D':
        assert result.information.log_det > max(one.information.log_det for one in chance)


def test_design_keeps_every_limit_at_ten_times_the_samples(humanoid_design, humanoid_collision):
    arm, result = humanoid_design
    rate = 10.0 * result.settings.samples / result.settings.period
    motion = result.excitation.motion(max(rate, 1000.0))
    assert check_limits(result.limits, motion, arm.torque(motion)) == ()
    margin = result.settings.clearance
    assert ClearanceModel.of(humanoid_collision).smallest(motion.q).min() >= margin


def test_predicted_deviations_are_the_scatter_of_repeats(humanoid_design):
    arm, result = humanoid_design
    rng = np.random.default_rng(3)
    settings = replace(result.settings, rate=20.0)
    problem = DesignProblem.of(arm, settings, rng)
    predicted = evaluate(problem, result.excitation).information.std
    run, lead = result.excitation, int(np.ceil(20.0 * result.excitation.run_in))
    periods = slice(lead, lead + run.n_periods * round(20.0 * run.trajectory.period))
    w = problem.columns(run.motion(20.0).select(periods))[:, problem.base.independent]
    scatter = (np.linalg.pinv(w) @ rng.normal(size=(len(w), 400))).std(axis=1)
    np.testing.assert_allclose(predicted, scatter, rtol=0.2)


def test_same_seed_same_trajectory(two_link_arm, quick):
    first, again, other = (
        design(two_link_arm, quick, np.random.default_rng(s)) for s in (7, 7, 8)
    )
    np.testing.assert_array_equal(coefficients(first), coefficients(again))
    assert np.abs(coefficients(first) - coefficients(other)).max() > 1e-3


def test_interrupt_keeps_the_best_so_far(two_link_arm, quick):
    seen = []

    def interrupt(done, cost):
        seen.append(cost)
        if len(seen) == 10:
            raise KeyboardInterrupt

    result = design(two_link_arm, quick, np.random.default_rng(0), progress=interrupt)
    assert result.stopped == 'interrupted'
    assert result.cost == pytest.approx(seen[-1], abs=0.05)
    motion = result.excitation.motion(500.0)
    assert check_limits(result.limits, motion, two_link_arm.torque(motion)) == ()


def test_time_budget_ends_the_search_with_the_best_so_far(two_link_arm, quick):
    """One that is used up before anything is found is of a slow computer, and no error."""
    settings = replace(quick, time_budget=1e-9, iterations=100000)
    result = design(two_link_arm, settings, np.random.default_rng(0))
    assert result.stopped == 'time budget'
    assert np.isfinite(result.cost)


def test_progress_grows_to_one_and_cost_only_falls(two_link_arm, quick):
    done, costs = [], []

    def note(share, cost):
        done.append(share)
        costs.append(cost)

    result = design(two_link_arm, quick, np.random.default_rng(0), progress=note)
    assert done == sorted(done)
    assert done[-1] == 1.0
    assert costs == sorted(costs, reverse=True)
    assert result.stopped == ''
    assert result.cost == pytest.approx(costs[-1], abs=0.05)


def test_design_after_a_recording_adds_what_it_lacks(two_link_arm, quick):
    """The first run holds the elbow still; what is added is about the elbow."""
    rng = np.random.default_rng(0)
    problem = DesignProblem.of(two_link_arm, quick, rng)
    first = random_feasible(two_link_arm, problem.limits, 6.0, 3, rng).scaled([1.0, 1e-3])
    known = evaluate(problem, first).information.matrix
    blind = design(two_link_arm, quick, np.random.default_rng(1))
    after = design(two_link_arm, quick, np.random.default_rng(1), prior_information=known)
    together = evaluate(problem, blind.excitation, known)
    assert after.cost <= together.cost + 1e-6
    assert after.information.log_det > blind.information.log_det
    with pytest.raises(TrajectoryError, match='prior information'):
        design(two_link_arm, quick, rng, prior_information=np.eye(3))


def test_design_against_a_rival_leaves_it_more_to_explain(two_link, quick):
    """Friction that grows with speed against friction that does not."""
    arm = ArmModel(two_link).with_effect(make_effect('viscous_friction', two_link), [0.5, 0.3])
    rival = with_effects(two_link, 'coulomb_friction')
    settings = replace(quick, criterion='T', starts=1)
    rng = np.random.default_rng(0)
    problem = DesignProblem.of(arm, settings, rng, rival)
    chance = [
        evaluate(problem, random_feasible(arm, problem.limits, 6.0, 3, rng)).cost
        for _ in range(20)
    ]
    result = design(arm, settings, rng, rival=rival)
    assert result.cost < min(chance)
