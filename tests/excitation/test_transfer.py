# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ways from pose to pose are within limits, past what stands around, and as long as they need."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    check_limits,
    ClearanceModel,
    Excitation,
    FourierTrajectory,
    Limits,
    Obstacle,
    plan_run,
    random_feasible,
    transfer_limits,
    TransferPlanner,
    with_obstacles,
)
from armid_ros.excitation.run import _unwound
from armid_ros.robots import collision_model, robot_from_urdf
import numpy as np
import pinocchio as pin
import pytest

from .conftest import urdf

MARGIN = 0.02


def planner(robot, *obstacles, speed='slow', margin=MARGIN):
    clearance = ClearanceModel.of(with_obstacles(collision_model(robot), obstacles), margin)
    return TransferPlanner(ArmModel(robot), transfer_limits(robot, speed), clearance)


def dense(way, count=4001):
    return way.at(np.linspace(0.0, way.duration, count))


@pytest.mark.parametrize('speed', ['slow', 0.05])
def test_a_way_takes_the_time_that_distance_and_limits_ask_for(two_link, speed):
    plan = planner(two_link, speed=speed)
    way = plan(np.zeros(2), np.array([1.2, -0.4]))
    assert check_limits(plan.limits, dense(way)) == ()
    faster = dense(way.lasting(0.99 * way.duration))
    assert check_limits(plan.limits, faster)
    assert plan(np.zeros(2), np.array([1.2, -0.4]), shortest=60.0).duration == 60.0


def test_a_way_of_joints_without_limits_is_slow(two_link):
    free = replace(
        transfer_limits(two_link), velocity=np.full(2, np.inf), acceleration=np.full(2, np.inf)
    )
    way = TransferPlanner(ArmModel(two_link), free, None)(np.zeros(2), np.ones(2))
    assert np.abs(dense(way).dq).max() == pytest.approx(0.5, rel=1e-3)


def test_a_way_keeps_the_torque_limits(two_link):
    """Drives that just hold the arm leave nothing for haste."""
    hasty = replace(two_link, acceleration_limit=np.full(2, 200.0))
    limits = Limits.of(hasty, speed=1.0)
    arm, goal = ArmModel(two_link), np.array([1.4, 0.0])
    quick = TransferPlanner(arm, limits, None)(np.zeros(2), goal)
    torque = np.abs(arm.torque(dense(quick))).max(axis=0)
    assert np.all(torque <= limits.torque * (1.0 + 1e-6))
    weak = replace(limits, torque=0.6 * torque)
    with pytest.raises(TrajectoryError, match=r'torque|still'):
        TransferPlanner(arm, weak, None)(np.zeros(2), goal)


def test_a_way_goes_around_what_stands_in_the_straight_one(two_link):
    """A wall in the plane of the shoulder; over the top or beside it, the outer link gets past."""
    wall = Obstacle('wall', 'box', (0.04, 0.3, 0.6), (0.25, 0.0, 1.25))
    plan = planner(two_link, wall)
    start, goal = np.array([-0.9, 0.0]), np.array([1.2, 0.0])
    assert plan.fault(start) == '' and plan.fault(goal) == ''
    way = plan(start, goal)
    assert len(way.q) > 2
    assert plan.clearance.smallest(dense(way).q).min() >= MARGIN - 1e-6
    np.testing.assert_array_equal(way.q[[0, -1]], [start, goal])
    again = plan(start, goal)
    np.testing.assert_array_equal(way.q, again.q)


def test_where_there_is_no_way_the_bodies_are_named(two_link):
    wall = Obstacle('wall', 'box', (0.02, 6.0, 4.0), (0.0, 0.0, 2.65))
    with pytest.raises(TrajectoryError, match=r'wall'):
        planner(two_link, wall, margin=0.0)(np.array([-1.3, 0.0]), np.array([1.2, 0.0]))


def test_a_pose_that_is_not_free_is_refused_with_what_is_wrong(two_link):
    plan = planner(two_link, Obstacle('floor', 'plane', (), (0.0, 0.0, 0.3)))
    with pytest.raises(TrajectoryError, match=r'start.*upper'):
        plan(np.array([3.0, 0.0]), np.zeros(2))
    with pytest.raises(TrajectoryError, match=r'goal.*floor'):
        plan(np.zeros(2), np.array([2.4, 0.0]))


def test_measured_a_little_beyond_a_limit_is_at_the_limit(two_link):
    way = planner(two_link)(two_link.lower - 0.005, np.zeros(2))
    np.testing.assert_array_equal(way.q[0], two_link.lower)


def test_where_zero_is_not_free_a_pose_beside_it_is_taken(two_link):
    data = two_link.model.createData()
    pin.forwardKinematics(two_link.model, data, np.zeros(2))
    hand = data.oMi[2].act(np.array([0.0, 0.0, 0.3]))
    ball = Obstacle('ball', 'sphere', (0.05,), tuple(hand))
    q = planner(two_link, ball).free_start()
    assert 'ball' in planner(two_link, ball).fault(np.zeros(2)) and 0.0 < np.abs(q).max() < 0.5
    assert planner(two_link, ball).fault(q) == ''
    assert not planner(two_link).free_start().any()


def test_the_default_start_keeps_the_reserve_at_a_position_limit(two_link):
    one_sided = replace(two_link, lower=np.array([0.5, -1.0]), upper=np.array([1.5, 0.0]))
    start = planner(one_sided).free_start()
    np.testing.assert_allclose(start, [0.52, -0.02])


@pytest.mark.parametrize('back', [True, False])
@pytest.mark.parametrize('rate', [50.0, 130.0])
def test_a_run_is_one_motion_from_its_start(two_link, back, rate):
    """Sampled and evaluated it is the same; it moves without a jump, and the periods are equal."""
    plan, rng = planner(two_link), np.random.default_rng(0)
    limits = Limits.of(two_link, speed='medium')
    path = random_feasible(plan.arm, limits, 4.0, 3, rng, clearance=plan.clearance)
    excitation = Excitation(path, 2, 0.77)
    run = plan_run(excitation, plan, np.zeros(2), rate, back=back)
    motion, exact = run.motion(), run.at(run.motion().t)
    for name in ('q', 'dq', 'ddq'):
        np.testing.assert_allclose(getattr(motion, name), getattr(exact, name), atol=1e-9)
    assert motion.t[-1] == pytest.approx(run.duration)
    np.testing.assert_allclose(motion.q[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.q[-1], 0.0 if back else excitation.at([99.0]).q[0])
    np.testing.assert_allclose(motion.dq[[0, -1]], 0.0, atol=1e-9)
    fine = run.at(np.linspace(0.0, run.duration, 20001))
    np.testing.assert_allclose(
        fine.dq, np.gradient(fine.q, fine.t, axis=0), atol=0.02 * np.abs(fine.dq).max()
    )
    begin = round(run.approach.duration * rate) + int(np.ceil(0.77 * rate))
    first, second = motion.q[begin:][: 2 * round(4.0 * rate)].reshape(2, -1, 2)
    np.testing.assert_allclose(first, second, atol=1e-12)


TWICE = ('shoulder', 'revolute', 'base', 'upper', '0 0 0.3', '0 1 0', -6.3, 6.3, 60)


def turned_far(robot):
    a = np.array([[0.2]])
    return Excitation(FourierTrajectory(robot.joints, 4.0, np.array([5.0]), a, 0.0 * a))


def test_joints_are_unwound_so_that_the_floor_is_not_in_the_way():
    robot = robot_from_urdf(urdf(TWICE))
    plan = planner(robot, Obstacle('floor', 'plane'))
    far = turned_far(robot)
    with pytest.raises(TrajectoryError, match='floor'):
        plan(np.zeros(1), far.at([0.0]).q[0])
    run = plan_run(far, plan, np.zeros(1), 50.0)
    np.testing.assert_allclose(run.excitation.trajectory.q0, 5.0 - 2.0 * np.pi)


def test_joints_are_not_unwound_beyond_their_limits():
    robot = robot_from_urdf(urdf((*TWICE[:6], -1.0, 6.3, 60)))
    far = turned_far(robot)
    same = _unwound(far, ArmModel(robot), transfer_limits(robot), np.zeros(1))
    assert same is far
