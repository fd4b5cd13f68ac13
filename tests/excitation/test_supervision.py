# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where an arm is known to be, whether it follows, how it comes to rest, and its rehearsal."""

from armid_ros.arm import ArmModel
from armid_ros.excitation import Excitation, FourierTrajectory
from armid_ros.excitation.pose_monitor import PoseMonitor
from armid_ros.excitation.supervision import jump_fault, Rehearsal, tracking_fault
from armid_ros.robots import load_robot
import numpy as np
import pytest

JOINTS = ('shoulder', 'elbow')
SENDERS = [(joint,) for joint in JOINTS]
NONE = np.empty(0)


@pytest.fixture
def monitor(two_link):
    return PoseMonitor(two_link, 0.1)


def test_a_pose_is_put_together_from_messages_with_some_of_the_joints(monitor):
    shoulder, elbow = SENDERS
    assert "'shoulder'" in monitor.staleness(0.0, 1.0)
    monitor.update(elbow, np.array([2.0]), NONE, 5, 10.0)
    assert "'shoulder'" in monitor.staleness(10.0, 1.0)
    monitor.update(shoulder, np.array([1.0]), NONE, 6, 10.5)
    np.testing.assert_array_equal(monitor.q, [1.0, 2.0])
    assert monitor.staleness(10.9, 1.0) == ''
    late = monitor.staleness(11.2, 1.0)
    assert "'elbow'" in late and '1.20 s' in late
    assert monitor.sources == 2


@pytest.mark.parametrize(('stamp', 'position'), [(5, 0.0), (7, np.nan), (7, np.inf)])
def test_a_stamp_again_or_no_number_is_no_news(monitor, stamp, position):
    for number, q, now in (5, 0.0, 10.0), (stamp, position, 20.0):
        monitor.update(JOINTS, np.full(2, q), NONE, number, now)
    np.testing.assert_array_equal(monitor.q, 0.0)
    np.testing.assert_array_equal(monitor.seen, 10.0)


def test_messages_without_stamps_are_news_every_time(monitor):
    for now in 10.0, 20.0:
        monitor.update(JOINTS, np.zeros(2), NONE, 0, now)
    assert monitor.staleness(20.0, 0.1) == ''


@pytest.mark.parametrize('stamped', [False, True])
def test_two_senders_of_a_joint_count_as_one_and_have_to_agree(monitor, stamped):
    """As a simulated arm beside the real one, which names its joints in another order."""
    monitor.update(('finger',), np.zeros(1), NONE, 1, 0.0)
    for k in range(100):
        now, q = 0.01 * k, np.array([0.5 * 0.01 * k, 0.0])
        stamp = (k + 1) * 10**7 * stamped
        monitor.update(JOINTS, q, NONE, stamp, now)
        monitor.update(JOINTS[::-1], np.zeros(2), NONE, stamp + stamped, now + 1e-3)
        if monitor.contradiction(now):
            break
    assert monitor.sources == 2
    assert "'shoulder'" in monitor.contradiction(now) and q[0] < 0.1
    assert abs(monitor.q[0] - q[0]) < 0.03


def test_the_joint_that_lags_most_is_named_with_how_far():
    wanted, measured = np.array([1.0, 1.0]), np.array([0.9, 1.3])
    assert tracking_fault(JOINTS, ('rad', 'm'), wanted, measured, 0.31) == ''
    fault = tracking_fault(JOINTS, ('rad', 'm'), wanted, measured, 0.2)
    assert "'elbow'" in fault and '0.3 m' in fault


@pytest.mark.parametrize(('time', 'faulty'), [(0.0, True), (0.2, True), (0.3, False)])
def test_a_first_waypoint_needs_the_time_to_get_there(time, faulty):
    fault = jump_fault(JOINTS, (time, np.array([0.0, 0.5])), np.zeros(2), np.full(2, 2.0), 0.01)
    assert bool(fault) is faulty
    if faulty:
        assert "joint 'elbow'" in fault and '0.5' in fault


@pytest.fixture(scope='module')
def arm():
    return ArmModel(load_robot('humanoid_arm'))


@pytest.fixture(scope='module')
def run(arm):
    robot = arm.robot
    a = np.full((6, 1), 0.1)
    middle = (robot.lower + robot.upper) / 2.0
    return Excitation(FourierTrajectory(robot.joints, 5.0, middle, a, 0.0 * a), 1, 1.0)


def rehearsed(arm, run, off=0.0, factor=1.0, count=500):
    rehearsal = Rehearsal(run, arm)
    for t in np.linspace(0.0, run.duration, count):
        motion = run.at([t])
        rehearsal.add(t, motion.q[0] + off, factor * arm.joint_torque(motion)[0])
    return rehearsal


def test_an_arm_as_described_surprises_nobody(arm, run):
    rehearsal = rehearsed(arm, run)
    assert rehearsal.report()[1] == ()
    np.testing.assert_allclose(rehearsal.torque, rehearsal.predicted(), rtol=2e-5)
    np.testing.assert_allclose(rehearsal.tracking, 0.0, atol=1e-12)


def test_the_largest_distance_is_reported(arm, run):
    rehearsal = rehearsed(arm, run, off=0.02)
    np.testing.assert_allclose(rehearsal.tracking, 0.02, atol=1e-12)
    assert '0.02' in rehearsal.report()[0]


def test_ten_times_the_torque_is_a_surprise(arm, run):
    assert rehearsed(arm, run, factor=10.0).report()[1]


def test_without_joint_states_it_is_said(arm, run):
    text, surprises = Rehearsal(run, arm).report()
    assert surprises == (text,) and 'joint state' in text
