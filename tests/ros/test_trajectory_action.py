# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation as a goal of follow_joint_trajectory: accepted, watched, cancelled, ended."""

from dataclasses import replace
import gc
import sys
import time

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from armid_ros.errors import TrajectoryError
from armid_ros.nodes.trajectory_controller import TrajectoryController, write_trajectory
from armid_ros.recording.trajectory import waypoints_of
from control_msgs.action import FollowJointTrajectory
import numpy as np
import pytest
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse

from tests.ros.controller import Controller, NAME
from tests.ros.test_controller import begun, HOME, publisher, ROBOT, set_parameter


@pytest.fixture
def arm(bench):
    arm = Controller(bench, ROBOT, HOME, action=True)
    yield arm
    arm.leave()


def test_the_excitation_is_a_goal_and_no_message(bench, arm, excitation):
    node = publisher(bench, arm, excitation, tracking_tolerance=0.3, goal_tolerance=0.05)
    assert set_parameter(node, 'goal_time_tolerance', 1.5).successful
    answer = bench.call('excitation_publisher/start')
    assert answer.success and f'/{NAME}' in answer.message
    bench.spin_until(lambda: arm.goals, 'the goal')
    bench.settle()
    goal = arm.goals[0]
    assert len(arm.accepted) == 1
    assert [t.name for t in goal.path_tolerance] == list(ROBOT.joints)
    assert {t.position for t in goal.path_tolerance} == {0.3}
    assert {t.position for t in goal.goal_tolerance} == {0.05}
    assert (goal.goal_time_tolerance.sec, goal.goal_time_tolerance.nanosec) == (1, 500_000_000)
    assert waypoints_of(goal.trajectory).duration == pytest.approx(node.duration, abs=1e-6)


def test_a_trajectory_is_stamped_after_the_discovery_of_the_controller(
    bench, arm, excitation, monkeypatch
):
    node, stamped = publisher(bench, arm, excitation), []
    bench.spin_until(lambda: node.poll() or node._controller._ready, 'the action')
    begun, begin = time.monotonic(), node._controller.begin
    monkeypatch.setattr(
        TrajectoryController, '_ready', property(lambda _: time.monotonic() > begun + 0.3)
    )
    node._controller.begin = lambda message: stamped.append(time.monotonic()) or begin(message)
    node.start()
    assert stamped[0] > begun + 0.3


def test_a_run_ends_when_the_controller_says_so(bench, arm, excitation):
    arm.faults.lag = 1.5  # the arm arrives later than planned
    node = begun(bench, arm, excitation, goal_tolerance=1e-4, tracking_tolerance=5.0)
    arm.run(102.0)
    node.publish_diagnostics()
    _, values = node.condition()
    assert 0.0 < values['controller_error'] < 5.0
    end = 100.2 + node.duration
    arm.run(end + 0.4)
    assert node.elapsed is not None
    assert not bench.call('excitation_publisher/start').success
    arm.run(end + 0.7)
    assert node.condition()[0]
    arm.run(end + 1.7)
    assert arm.ends == ['succeed']
    assert node.elapsed is None
    assert not node.condition()[0]


@pytest.mark.parametrize(('deaf', 'fact'), [(True, 'refused'), (False, '0 s')])
def test_a_goal_that_is_refused_or_not_answered_is_no_run(
    bench, arm, excitation, monkeypatch, deaf, fact
):
    if not deaf:
        monkeypatch.setattr('armid_ros.nodes.trajectory_controller._ANSWER_TIMEOUT', 0.0)
    node = publisher(bench, arm, excitation)
    arm.faults.deaf = deaf
    node.start()
    bench.spin_until(lambda: node.poll() or node.condition()[0], 'the reason')
    assert f'/{NAME}' in node.condition()[0] and fact in node.condition()[0]
    assert node.elapsed is None


def test_a_controller_that_gives_up_is_quoted(bench, arm, excitation):
    node = begun(bench, arm, excitation, tracking_tolerance=1.0)
    arm.run(101.5)
    arm.faults.stuck = 3
    arm._goal.path[:] = 0.02  # the controller's own are narrower than those of the node
    arm.run(103.5)
    assert arm.ends == ['abort']
    said = node.condition()[0]
    assert 'path tolerance' in said and 'elbow_pitch' in said
    assert node.elapsed is None
    assert len(arm.accepted) == 1


def test_an_end_that_is_not_reached_in_time_is_reported(bench, arm, excitation):
    options = {'goal_tolerance': 0.001, 'goal_time_tolerance': 0.3, 'tracking_tolerance': 1.0}
    node = begun(bench, arm, excitation, **options)
    arm.faults.lag = 2.0
    arm.run(100.2 + node.duration + 1.0)
    assert arm.ends == ['abort']
    assert 'tolerance' in node.condition()[0]


def trouble(fault):
    """Return what makes a run end, given the node and the arm."""

    def stop(node, arm):
        node.stop()

    def silence(node, arm):
        arm.faults.silent = True

    def stick(node, arm):
        set_parameter(node, 'tracking_tolerance', 0.02)
        arm.faults.stuck = int(np.argmax(np.abs(arm.state(arm.now).dq)))

    return {'stop': stop, 'joint states lost': silence, 'not followed': stick}[fault]


@pytest.mark.parametrize('fault', ['stop', 'joint states lost', 'not followed'])
def test_a_stop_replaces_the_goal_by_one_that_comes_to_rest(bench, arm, excitation, fault):
    node = begun(bench, arm, excitation, tracking_tolerance=1.0)
    arm.run(101.5)
    trouble(fault)(node, arm)
    arm.run(104.5)
    node.poll()
    arm.run(106.0)
    assert len(arm.goals) >= 2
    assert {t.position for t in arm.goals[1].path_tolerance} == {-1.0}
    assert arm.ends[:2] == ['abort', 'succeed']
    np.testing.assert_allclose(arm.state(arm.now).dq, 0.0, atol=1e-9)
    assert node.elapsed is None


def test_a_stop_that_is_refused_is_reported_at_once_and_repeated(bench, arm, excitation):
    node = begun(bench, arm, excitation)
    arm.run(101.5)
    arm.faults.deaf = True
    node.stop()
    bench.spin_until(lambda: 'refused' in node.condition()[0], 'the refusal')
    arm.run(103.0)
    arm.faults.deaf = False
    arm.run(105.5)
    np.testing.assert_allclose(arm.state(arm.now).dq, 0.0, atol=1e-9)


class Stubborn:
    """A controller that takes no goal while it has one, and stops when that is cancelled."""

    def __init__(self, bench):
        self.handles, self.cancelled = [], []
        self.server = ActionServer(
            bench.probe,
            FollowJointTrajectory,
            NAME,
            execute_callback=lambda handle: None,
            goal_callback=lambda _: GoalResponse(1 if self.handles else 2),
            handle_accepted_callback=self.handles.append,
            cancel_callback=self._cancel,
        )

    def _cancel(self, handle):
        self.cancelled.append(handle)
        return CancelResponse.ACCEPT


@pytest.fixture
def stubborn(bench):
    controller = Stubborn(bench)
    yield controller
    controller.server.destroy()
    del controller.server, controller.handles, controller.cancelled
    gc.collect()


@pytest.mark.parametrize('fault', ['stop', 'joint states lost'])
def test_a_controller_that_replaces_nothing_is_told_to_cancel(bench, excitation, stubborn, fault):
    arm = Controller(bench, ROBOT, HOME)
    node = publisher(bench, arm, excitation, interface='action', tracking_tolerance=5.0)
    node.start()
    bench.spin_until(lambda: stubborn.handles, 'the goal')
    arm.run(101.0)
    trouble(fault)(node, arm)
    arm.run(102.0)
    node.poll()
    bench.spin_until(lambda: stubborn.cancelled, 'the cancellation')
    assert stubborn.cancelled[0].status == GoalStatus.STATUS_CANCELING
    assert node.elapsed is None


@pytest.mark.parametrize('how', ['cancelled', 'replaced, with an overdue result'])
def test_a_controller_that_another_client_takes_over_is_let_go(bench, arm, excitation, how):
    node = begun(bench, arm, excitation)
    arm.faults.overdue = 'overdue' in how
    arm.run(101.0)
    client = ActionClient(bench.probe, FollowJointTrajectory, NAME)
    if how == 'cancelled':
        canceller = bench.probe.create_client(CancelGoal, f'{NAME}/_action/cancel_goal')
        bench.spin_until(canceller.service_is_ready, 'the service')
        canceller.call_async(CancelGoal.Request())
    else:
        bench.spin_until(client.server_is_ready, 'the action')
        away = node._gate.run.at([3.0])
        goal = write_trajectory(replace(away, t=np.array([2.0]), dq=0 * away.dq, ddq=0 * away.ddq))
        client.send_goal_async(FollowJointTrajectory.Goal(trajectory=goal))
    bench.spin_until(lambda: node.condition()[0], 'the reason')
    sent = len(arm.goals)
    arm.run(104.0)
    assert len(arm.goals) == sent == (1 if how == 'cancelled' else 2)
    assert '/probe' in node.condition()[0]
    client.destroy()


def test_a_success_half_way_is_no_complete_run(bench, arm, excitation):
    node = begun(bench, arm, excitation)
    arm.run(101.5)
    arm._end('succeed')
    arm.run(104.0)
    assert node.activity == node.condition()[1]['run'] == 'stopped'
    assert 'reported the end' in node.condition()[0]
    np.testing.assert_allclose(arm.state(arm.now).dq, 0.0, atol=1e-9)


def test_a_goal_of_another_client_after_a_stop_is_not_stopped(bench, arm, excitation):
    node = begun(bench, arm, excitation)
    arm.run(101.5)
    t = np.arange(0.1, 5.0, 0.1)
    along = replace(node._gate.run.at(1.9 + t), t=t)
    node.stop()
    arm.run(102.0)
    client = ActionClient(bench.probe, FollowJointTrajectory, NAME)
    bench.spin_until(client.server_is_ready, 'the action')
    message = write_trajectory(along)
    message.points[-1].velocities = [0.0] * len(ROBOT.joints)
    client.send_goal_async(FollowJointTrajectory.Goal(trajectory=message))
    bench.spin_until(lambda: node._controller.taken, 'the goal of the other client')
    sent = len(arm.goals)
    arm.run(104.5)
    assert not bench.call('excitation_publisher/stop').success
    arm.run(105.0)
    assert len(arm.goals) == sent
    client.destroy()


def test_a_controller_that_is_gone_is_said(bench, arm, excitation):
    node = begun(bench, arm, excitation, state_timeout=0.2)
    bench.settle()
    arm.leave()
    bench.spin_until(lambda: node.poll() or node.condition()[0], 'a reported condition')
    assert f'/{NAME}' in node.condition()[0]


def test_two_controllers_of_an_action_are_not_started(bench, arm, excitation, stubborn):
    node = publisher(bench, arm, excitation)
    bench.spin_until(lambda: node._controller._servers == 2, 'the second controller')
    answer = bench.call('excitation_publisher/start')
    assert not answer.success and '2 controllers' in answer.message
    assert not stubborn.handles


def test_without_an_action_the_topic_is_used_unless_the_action_is_required(bench, excitation):
    arm = Controller(bench, ROBOT, HOME)
    node = publisher(bench, arm, excitation)
    assert 'subscribers' in node.start()
    bench.spin_until(lambda: arm.accepted, 'the trajectory')
    node.stop()
    arm.run(102.0)
    strict = publisher(bench, arm, excitation, interface='action', action='/x/y')
    arm.run(102.5)
    with pytest.raises(TrajectoryError, match='/x/y'):
        strict.start()


def test_without_control_msgs_the_action_cannot_be_asked_for(bench, excitation, monkeypatch):
    arm = Controller(bench, ROBOT, HOME)
    monkeypatch.setitem(sys.modules, 'control_msgs.action', None)
    node = publisher(bench, arm, excitation)
    node.start()
    assert node._controller.client is None
    with pytest.raises(TrajectoryError, match=r'control_msgs.*apt install'):
        publisher(bench, arm, excitation, interface='action')
