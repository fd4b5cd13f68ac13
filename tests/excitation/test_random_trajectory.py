# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Random trajectories, and what is said when there is none."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    check_limits,
    ClearanceModel,
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
