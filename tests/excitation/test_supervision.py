# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where an arm is known to be, whether it follows, and how its set point comes to rest."""

from armid_ros.excitation import brought_to_rest, jump_fault, MeasuredPose, tracking_fault
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np
import pytest

JOINTS = ('a', 'b')


def test_a_pose_is_put_together_by_name_from_any_messages():
    pose = MeasuredPose.unknown(JOINTS)
    assert "joint 'a'" in pose.staleness(0.0, 1.0)
    pose = pose.updated(['gripper', 'b'], [9.0, 2.0], 5, 10.0)
    assert "no position of joint 'a'" in pose.staleness(10.0, 1.0)
    pose = pose.updated(['a'], [1.0], 6, 10.5)
    np.testing.assert_array_equal(pose.q, [1.0, 2.0])
    assert pose.staleness(10.9, 1.0) == ''
    assert "joint 'b' came 1.20 s ago" in pose.staleness(11.2, 1.0)


@pytest.mark.parametrize(('stamp', 'position'), [(5, 1.0), (7, np.nan), (7, np.inf)])
def test_a_stamp_again_or_no_number_is_no_news(stamp, position):
    pose = MeasuredPose.unknown(JOINTS).updated(JOINTS, [0.0, 0.0], 5, 10.0)
    pose = pose.updated(JOINTS, [position, position], stamp, 20.0)
    np.testing.assert_array_equal(pose.q, 0.0)
    np.testing.assert_array_equal(pose.seen, 10.0)


def test_messages_without_stamps_are_news_every_time():
    pose = MeasuredPose.unknown(JOINTS).updated(JOINTS, [0.0, 0.0], 0, 10.0)
    assert pose.updated(JOINTS, [0.0, 0.0], 0, 20.0).staleness(20.0, 0.1) == ''


def test_the_joint_that_lags_most_is_named_with_how_far():
    wanted, measured = np.array([1.0, 1.0]), np.array([0.9, 1.3])
    assert tracking_fault(JOINTS, ('rad', 'm'), wanted, measured, 0.31) == ''
    assert "'b' is 0.3 m" in tracking_fault(JOINTS, ('rad', 'm'), wanted, measured, 0.2)


@pytest.mark.parametrize(('time', 'faulty'), [(0.0, True), (0.2, True), (0.3, False)])
def test_a_first_waypoint_needs_the_time_to_get_there(time, faulty):
    fault = jump_fault(JOINTS, (time, np.array([0.0, 0.5])), np.zeros(2), np.full(2, 2.0), 0.01)
    assert bool(fault) is faulty
    if faulty:
        assert "joint 'b'" in fault and '0.5' in fault


def test_an_arm_that_does_not_follow_comes_to_rest_from_where_it_is():
    robot = load_robot('humanoid_arm')
    home = (robot.lower + robot.upper) / 2.0
    fast = 0.5 * robot.velocity_limit * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    now = Motion(robot.joints, [0.0], home[None], fast[None], np.zeros((1, 6)))
    # one that lags, one that is blocked, two that go elsewhere, one too fast, one at its limit
    velocity = fast * np.array([0.5, 0.0, -1.0, 1.0, 3.0, 1.0])
    measured = home + np.array([-0.2, 0.1, 0.1, -0.1, 0.0, 0.0])
    measured[5] = robot.lower[5] + 0.01
    motion = brought_to_rest(now, measured, velocity, robot, 0.5, 1000.0)
    taken = np.clip(velocity / fast, 0.0, 1.0) * fast
    taken[5] = -2.0 * 0.01 / 0.5
    lead = motion.t[0]
    off = np.abs(measured - home)
    np.testing.assert_array_less(off / lead, robot.velocity_limit)
    away = motion.q[0] - measured
    assert np.all(np.abs(away) <= np.abs(taken) * lead + 1e-12)
    assert away[1] == away[2] == 0.0 and np.all(away[[0, 3, 4]] * fast[[0, 3, 4]] > 0.0)
    assert np.all((motion.q >= robot.lower - 1e-12) & (motion.q <= robot.upper))
    np.testing.assert_allclose(motion.dq[-1], 0.0, atol=1e-12)
    for rate, value in ((motion.dq, motion.q), (motion.ddq, motion.dq)):
        np.testing.assert_allclose(
            rate[2:-2], np.gradient(value, motion.t, axis=0)[2:-2], atol=1e-3
        )
