# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The excitation publisher in front of a trajectory controller, with what can go wrong there."""

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import save_excitation, transfer_limits, TransferPlanner
from armid_ros.excitation.schedule import excitation_text
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.nodes.qos import LATCHED, STREAM
from armid_ros.recording.trajectory import waypoints_of
from armid_ros.robots import load_robot
import numpy as np
import pytest
from rclpy.parameter import Parameter
from std_msgs.msg import String

from tests.ros.controller import Controller, SECOND

ROBOT = load_robot('humanoid_arm')
HOME = (ROBOT.lower + ROBOT.upper) / 2.0


@pytest.fixture(params=['topic', 'action'])
def arm(bench, request):
    arm = Controller(bench, ROBOT, HOME, action=request.param == 'action')
    yield arm
    arm.leave()


def free_planner():
    """Plan without bodies: the excitations here are drawn without looking at any."""
    return TransferPlanner(ArmModel(ROBOT), transfer_limits(ROBOT, 1.0), None)


def waiting(bench, excitation, **parameters):
    """Make a publisher on simulated time, at 99 s, that begins when `start` is called."""
    options = {'start': False, 'use_sim_time': True, 'approach': 1.0, 'state_timeout': 0.5}
    planner = None if excitation is None else free_planner()
    node = bench.add(ExcitationPublisherNode, excitation, planner, **(options | parameters))
    bench.tick(99 * SECOND)
    return node


def publisher(bench, arm, excitation, **parameters):
    node = waiting(bench, excitation, **parameters)
    arm.run(100.2)
    return node


def begun(bench, arm, excitation, **parameters):
    node = publisher(bench, arm, excitation, **parameters)
    node.start()
    bench.spin_until(lambda: arm.accepted, 'the trajectory')
    return node


def set_parameter(node, name, value):
    return node.set_parameters([Parameter(name, value=value)])[0]


def test_an_arm_that_follows_gets_to_the_end(bench, arm, excitation):
    node = begun(bench, arm, excitation)
    assert node.activity == 'running'
    arm.run(100.4 + node.duration)
    assert len(arm.accepted) == 1
    assert (node.activity, node.elapsed) == ('complete', None)
    np.testing.assert_allclose(arm.q, excitation.at([excitation.duration]).q[0], atol=1e-3)
    assert not node.condition()[0]


def test_a_controller_that_keeps_going_is_stopped_again_and_reported(bench, arm, excitation):
    node = begun(bench, arm, excitation)
    arm.run(101.5)
    arm.faults.deaf = True
    node.stop()
    arm.run(103.2)
    assert 'emergency stop' in node.condition()[0]
    with pytest.raises(TrajectoryError, match='at rest'):
        node._on_experiment(String(data=excitation_text(excitation)))
    arm.faults.deaf = False
    arm.run(105.5)
    np.testing.assert_allclose(arm.state(arm.now).dq, 0.0, atol=1e-9)
    count = len(arm.accepted)
    arm.run(107.0)
    assert count == len(arm.accepted) > 1


@pytest.mark.parametrize(('fault', 'value'), [('late', 0.2), ('lost', 3)])
def test_late_and_lost_joint_states_do_not_stop_the_arm(bench, arm, excitation, fault, value):
    node = begun(bench, arm, excitation, tracking_tolerance=0.05)
    setattr(arm.faults, fault, value)
    arm.run(103.0)
    assert node.elapsed is not None
    assert len(arm.accepted) == 1


def test_at_half_the_speed_the_path_is_the_same_and_the_time_twice(bench, arm, excitation):
    node = publisher(bench, arm, excitation)
    assert set_parameter(node, 'speed_scaling', 0.5).successful
    assert not set_parameter(node, 'speed_scaling', 2.0).successful
    node.start()
    bench.spin_until(lambda: arm.accepted, 'the trajectory')
    sent = waypoints_of(arm.accepted[0])
    slow = excitation.at_speed(0.5, 100.0)
    t = np.linspace(0.0, excitation.duration, 50)
    np.testing.assert_allclose(slow.at(2.0 * t).q, excitation.at(t).q, atol=1e-9)
    expected = slow.motion(100.0).q
    np.testing.assert_allclose(sent.q[-len(expected) :], expected, atol=1e-6)


def test_a_rehearsal_is_slow_and_reports_how_the_arm_followed(bench, arm, excitation):
    node = publisher(bench, arm, excitation, rehearsal_speed=0.5)
    answer = bench.call('excitation_publisher/rehearse')
    assert answer.success and '50 %' in answer.message
    arm.run(100.4 + node.duration, step=0.2)
    node.poll()
    said = node.condition()[0]
    assert all(fact in said for fact in ('rehearsed', '~/start', '100 %'))
    assert any(joint in said for joint in ROBOT.joints)
    assert len(arm.accepted) == 1
    node._on_experiment(String(data=excitation_text(excitation.at_speed(0.4, 100.0))))
    assert 'rehearsed' not in node.condition()[0]  # another path


def test_with_a_zero_stamp_a_controller_of_another_clock_begins_at_once(bench, excitation):
    arm = Controller(bench, ROBOT, HOME, STREAM)
    node = begun(bench, arm, excitation, zero_stamp=True)
    stamp = arm.accepted[0].header.stamp
    assert (stamp.sec, stamp.nanosec) == (0, 0)
    arm.run(102.0)
    assert node.elapsed is not None


def test_an_excitation_that_was_planned_elsewhere_is_taken_and_not_begun(
    bench, arm, excitation, tmp_path
):
    node = publisher(bench, arm, excitation)
    other = excitation.at_speed(0.4, 100.0)
    sender = bench.matched_publisher(String, 'experiment', LATCHED)
    sender.publish(String(data=excitation_text(other)))
    bench.settle()
    assert node.elapsed is None
    assert node.duration == pytest.approx(1.0 + other.sampled_duration(100.0))
    save_excitation(excitation, tmp_path / 'run.yaml')
    assert set_parameter(node, 'file', str(tmp_path / 'run.yaml')).successful
    assert node.duration == pytest.approx(1.0 + excitation.sampled_duration(100.0))
    refused = set_parameter(node, 'file', str(tmp_path / 'none.yaml'))
    assert not refused.successful
    assert 'none.yaml' in refused.reason
    sender.publish(String(data='schema: other'))
    bench.settle()
    assert node.complaints.latest.startswith('experiment: ')


def test_an_excitation_that_was_planned_elsewhere_does_not_begin_by_itself(bench, arm, excitation):
    node = waiting(bench, excitation, start=True)
    sender = bench.matched_publisher(String, 'experiment', LATCHED)
    sender.publish(String(data=excitation_text(excitation.at_speed(0.4, 100.0))))
    bench.spin_until(lambda: node.complaints.latest.startswith('experiment: '), 'the refusal')
    arm.run(100.2)
    bench.spin_until(lambda: arm.accepted, 'the trajectory')
    assert node._gate.run.excitation.duration == pytest.approx(excitation.duration)
