# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The double of controller and broadcaster does what the sources of ros2_controllers say."""

from __future__ import annotations

from action_msgs.msg import GoalStatus
from armid_ros.nodes.qos import STREAM
from armid_ros.robots import load_robot
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
import numpy as np
import pytest
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tests.ros.controller import Controller, NAME, Result, stamp_of

ROBOT = load_robot('humanoid_arm')
HOME = (ROBOT.lower + ROBOT.upper) / 2.0


class Client:
    """Sends goals to the double, and keeps their results."""

    def __init__(self, bench, arm):
        self._bench, self.arm = bench, arm
        self.states = bench.listen(JointState, 'joint_states')
        self._action = ActionClient(bench.probe, FollowJointTrajectory, NAME)
        bench.spin_until(self._action.server_is_ready, 'the action')

    def send(self, trajectory, **tolerances):
        goal = FollowJointTrajectory.Goal(trajectory=trajectory, **tolerances)
        future = self._action.send_goal_async(goal)
        self._bench.spin_until(future.done, 'the answer')
        handle = future.result()
        return handle, handle.get_result_async() if handle.accepted else None

    def result(self, future):
        self._bench.spin_until(future.done, 'the result')
        return future.result().status, future.result().result.error_code

    def close(self):
        self._action.destroy()
        self.arm.leave()


@pytest.fixture
def client(bench):
    client = Client(bench, Controller(bench, ROBOT, HOME, action=True, now=100.0))
    yield client
    client.close()


def line(offset, seconds, stamp=0.0, points=4, speed=0.0):
    """Return a trajectory from HOME by an offset of all joints, at rest at its end."""
    message = JointTrajectory(joint_names=list(ROBOT.joints))
    message.header.stamp = stamp_of(stamp)
    for k in range(1, points + 1):
        point = JointTrajectoryPoint(positions=(HOME + offset * k / points).tolist())
        point.velocities = [speed if k == points else offset / seconds] * len(HOME)
        when = stamp_of(seconds * k / points)
        point.time_from_start = Duration(sec=when.sec, nanosec=when.nanosec)
        message.points.append(point)
    return message


@pytest.mark.parametrize('overdue', [False, True])
def test_a_goal_that_is_replaced(client, overdue):
    client.arm.faults.overdue = overdue
    _, first = client.send(line(0.2, 2.0))
    client.arm.run(100.5)
    _, second = client.send(line(0.1, 1.0))
    client.arm.run(101.0)
    assert first.done() is not overdue
    client.arm.run(102.0)
    expected = (GoalStatus.STATUS_ABORTED, Result.INVALID_GOAL)
    if overdue:
        expected = (GoalStatus.STATUS_CANCELED, Result.SUCCESSFUL)
    assert client.result(first) == expected
    assert client.result(second) == (GoalStatus.STATUS_SUCCEEDED, Result.SUCCESSFUL)


def test_a_cancelled_goal_holds_the_measured_position_at_once(bench, client):
    client.arm.faults.lag = 0.2
    handle, result = client.send(line(0.2, 2.0))
    client.arm.run(101.0)
    where = client.arm.q.copy()
    bench.spin_until(handle.cancel_goal_async().done, 'the answer')
    assert client.result(result)[0] == GoalStatus.STATUS_CANCELED
    client.arm.run(101.5)
    np.testing.assert_allclose(client.arm.q, where)


def test_a_message_replaces_the_trajectory_and_not_the_goal(bench, client):
    _, result = client.send(line(0.2, 2.0))
    client.arm.run(101.0)
    bench.matched_publisher(JointTrajectory, 'joint_trajectory', STREAM).publish(line(0.4, 3.0))
    bench.spin_until(lambda: len(client.arm.accepted) == 2, 'the message')
    client.arm.run(103.0)
    assert not client.arm.ends
    client.arm.run(104.5)
    assert client.result(result)[0] == GoalStatus.STATUS_SUCCEEDED
    np.testing.assert_allclose(client.arm.q, HOME + 0.4)


@pytest.mark.parametrize(('asked', 'valid'), [(0.0, 0.05), (-1.0, 0.0), (0.3, 0.3), (-2.0, 0.05)])
def test_tolerances_are_those_of_the_goal_none_or_the_default(client, asked, valid):
    client.arm.path_tolerance = 0.05
    tolerance = JointTolerance(name=ROBOT.joints[1], position=asked)
    client.send(line(0.2, 2.0), path_tolerance=[tolerance])
    assert client.arm._goal.path[1] == valid
    assert client.arm._goal.path[0] == 0.05


def test_results_come_at_the_rate_of_the_monitor(client):
    client.send(line(0.1, 1.0))
    client.arm.run(101.0, step=0.05)
    client.arm.run(101.01, step=0.01)
    assert client.arm._goal is None or not client.arm.ends
    client.arm.run(101.06, step=0.01)
    assert client.arm.ends == ['succeed']


def test_speed_scaling_slows_the_trajectory(client):
    client.arm.scaling = 0.5
    client.send(line(0.2, 1.0))
    client.arm.run(101.0)
    np.testing.assert_allclose(client.arm.q, HOME + 0.1, atol=1e-6)
    client.arm.run(102.2)
    assert client.arm.ends == ['succeed']


@pytest.mark.parametrize(
    ('stamp', 'accepted', 'moved'),
    [(99.5, True, 0.2), (98.0, False, 0.0), (101.0, True, 0.06)],
    ids=['partly past', 'past', 'future'],
)
def test_stamps(client, stamp, accepted, moved):
    """A curve is entered where it is by now; the way to one of later begins at once."""
    handle, _ = client.send(line(0.2, 1.0, stamp))
    assert handle.accepted is accepted
    assert len(client.arm.refused) == (not accepted)
    client.arm.run(101.3)
    np.testing.assert_allclose(client.arm.q, HOME + moved, atol=1e-6)
    if stamp > 100.0:
        assert abs(client.arm._course.sample(100.6)[0] - HOME).max() > 1e-3


@pytest.mark.parametrize(
    'message',
    [
        JointTrajectory(joint_names=list(ROBOT.joints)),
        line(0.2, 1.0, speed=0.1),
        JointTrajectory(joint_names=list(ROBOT.joints[:3]), points=line(0.2, 1.0).points),
    ],
    ids=['no points', 'ends in motion', 'some joints'],
)
def test_trajectories_that_are_refused(client, message):
    assert not client.send(message)[0].accepted


def test_joint_states_are_in_alphabetical_order_and_nan_without_an_interface(client):
    client.arm.interfaces = {'position', 'effort'}
    client.arm.run(100.1)
    state = client.states[-1]
    assert list(state.name) == sorted(ROBOT.joints)
    positions = dict(zip(state.name, state.position, strict=True))
    np.testing.assert_allclose([positions[joint] for joint in ROBOT.joints], HOME)
    assert np.all(np.isnan(state.velocity)) and np.all(np.isfinite(state.effort))
