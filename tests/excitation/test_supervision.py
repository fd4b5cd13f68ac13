# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where an arm is known to be, whether it follows, and how its set point comes to rest."""

from armid_ros.excitation.supervision import jump_fault, MeasuredPose, tracking_fault
import numpy as np
import pytest

JOINTS = ('a', 'b')


def test_a_pose_is_put_together_from_messages_with_some_of_the_joints():
    pose = MeasuredPose.unknown(JOINTS)
    assert "joint 'a'" in pose.staleness(0.0, 1.0)
    pose = pose.updated([np.nan, 2.0], 5, 10.0)
    assert "'a'" in pose.staleness(10.0, 1.0)
    pose = pose.updated([1.0, np.nan], 6, 10.5)
    np.testing.assert_array_equal(pose.q, [1.0, 2.0])
    assert pose.staleness(10.9, 1.0) == ''
    late = pose.staleness(11.2, 1.0)
    assert "'b'" in late and '1.20 s' in late


@pytest.mark.parametrize(('stamp', 'position'), [(5, 1.0), (7, np.nan), (7, np.inf)])
def test_a_stamp_again_or_no_number_is_no_news(stamp, position):
    pose = MeasuredPose.unknown(JOINTS).updated([0.0, 0.0], 5, 10.0)
    pose = pose.updated([position, position], stamp, 20.0)
    np.testing.assert_array_equal(pose.q, 0.0)
    np.testing.assert_array_equal(pose.seen, 10.0)


def test_messages_without_stamps_are_news_every_time():
    pose = MeasuredPose.unknown(JOINTS).updated([0.0, 0.0], 0, 10.0)
    assert pose.updated([0.0, 0.0], 0, 20.0).staleness(20.0, 0.1) == ''


def test_the_joint_that_lags_most_is_named_with_how_far():
    wanted, measured = np.array([1.0, 1.0]), np.array([0.9, 1.3])
    assert tracking_fault(JOINTS, ('rad', 'm'), wanted, measured, 0.31) == ''
    fault = tracking_fault(JOINTS, ('rad', 'm'), wanted, measured, 0.2)
    assert "'b'" in fault and '0.3 m' in fault


@pytest.mark.parametrize(('time', 'faulty'), [(0.0, True), (0.2, True), (0.3, False)])
def test_a_first_waypoint_needs_the_time_to_get_there(time, faulty):
    fault = jump_fault(JOINTS, (time, np.array([0.0, 0.5])), np.zeros(2), np.full(2, 2.0), 0.01)
    assert bool(fault) is faulty
    if faulty:
        assert "joint 'b'" in fault and '0.5' in fault
