# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Designs and random trajectories: better than chance, inside every limit, the same for a seed."""

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
    Limits,
    Obstacle,
    random_feasible,
    with_obstacles,
)
from armid_ros.robots import collision_model
import numpy as np
import pytest

from tests.clearance import path_clearance

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


def test_random_trajectories_keep_every_limit(humanoid, humanoid_collision):
    arm, limits = with_effects(humanoid), Limits.of(humanoid)
    rng = np.random.default_rng(0)
    for _ in range(5):
        trajectory = random_feasible(
            arm, limits, 6.0, 3, rng, clearance=ClearanceModel.of(humanoid_collision, 0.01)
        )
        motion = trajectory.one_period(3000)
        assert not check_limits(limits, motion, arm.torque(motion))
        assert path_clearance(humanoid_collision, motion.q).min() >= 0.01


def test_torque_limit_below_gravity_is_named(two_link_arm):
    limits = Limits.of(two_link_arm.robot)
    pinned = replace(
        limits, lower=np.array([1.2, -0.1]), upper=np.array([1.4, 0.1]), torque=np.array([2.0, 90])
    )
    with pytest.raises(TrajectoryError, match=r'shoulder.*2 N'):
        random_feasible(two_link_arm, pinned, 6.0, 3, np.random.default_rng(0))


@pytest.mark.parametrize('name', ['coulomb_friction', 'presliding_hysteresis'])
def test_friction_beyond_the_torque_limit_is_no_room_to_move(two_link, name):
    arm = ArmModel(two_link).with_effect(make_effect(name, two_link), [100.0, 0.0])
    with pytest.raises(TrajectoryError, match='shoulder: torque'):
        random_feasible(arm, Limits.of(two_link), 6.0, 3, np.random.default_rng(0))


def test_bodies_that_cannot_be_kept_apart_are_named(two_link_arm):
    robot = two_link_arm.robot
    walled = with_obstacles(
        collision_model(robot), [Obstacle('wall', 'box', (3.0, 3.0, 3.0), (0.0, 0.0, 0.5))]
    )
    with pytest.raises(TrajectoryError, match=r'(upper|lower).*wall'):
        random_feasible(
            two_link_arm,
            Limits.of(robot),
            6.0,
            3,
            np.random.default_rng(0),
            clearance=ClearanceModel.of(walled),
        )


def test_trajectory_in_a_narrow_gap_touches_no_wall(two_link_arm):
    robot = two_link_arm.robot
    walls = [
        Obstacle('behind', 'plane', (), (-0.35, 0.0, 0.0), (0.0, np.pi / 2, 0.0)),
        Obstacle('ahead', 'plane', (), (0.35, 0.0, 0.0), (0.0, -np.pi / 2, 0.0)),
    ]
    between = with_obstacles(collision_model(robot), walls)
    limits, rng = Limits.of(robot), np.random.default_rng(0)
    bodies = ClearanceModel.of(between, 0.01)
    trajectory = random_feasible(two_link_arm, limits, 6.0, 3, rng, clearance=bodies)
    q = trajectory.one_period(3000).q
    assert path_clearance(between, q).min() >= 0.01
    assert np.ptp(q, axis=0).min() > 0.0
