# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Positions and torques of several senders become one joint state, whatever brings them."""

from armid_ros.errors import RecordingError
from armid_ros.nodes.joint_state_merger import JointStateMergerNode
from armid_ros.nodes.qos import LATCHED
from armid_ros.robots import load_robot
from control_msgs.msg import DynamicJointState, InterfaceValue
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

from tests.ros.controller import joint_state, stamp_of

JOINTS = ('a', 'b')
OUT = 'joint_state_merger/joint_states'


def merger(bench, **parameters):
    node = bench.add(JointStateMergerNode, joints=list(JOINTS), **parameters)
    return node, bench.listen(JointState, OUT)


def sender(bench, node, kind, topic):
    """Return a publisher that the node listens to."""
    publisher = bench.probe.create_publisher(kind, topic, 10)
    bench.spin_until(lambda: node.poll() or publisher.get_subscription_count(), topic)
    return publisher


def test_joints_of_two_senders_are_one_message_in_the_order_asked_for(bench):
    node, out = merger(bench, position_topics=['left', 'right'])
    left, right = (sender(bench, node, JointState, topic) for topic in ('left', 'right'))
    for t in (1.0, 1.1, 1.2):
        left.publish(
            joint_state(t, ['b', 'gripper'], [20.0 * t, 0.0], [2.0, 0.0], [200.0 * t, 9.0])
        )
        right.publish(joint_state(t - 0.05, ['a'], [t - 0.05], [1.0], [-t]))
    bench.spin_until(lambda: len(out) >= 2, OUT)
    assert out[0].name == list(JOINTS)
    np.testing.assert_allclose(out[0].position, [1.05, 21.0])
    np.testing.assert_allclose(out[0].velocity, [1.0, 2.0])
    np.testing.assert_allclose(out[0].effort, [-1.1, 210.0])
    assert out[0].header.stamp == stamp_of(1.05)


def currents(t, values):
    """Return currents as a broadcaster of ros2_control says them, under names of its own."""
    message = DynamicJointState(joint_names=['drive_b', 'drive_a'])
    message.header.stamp = stamp_of(t)
    for value in values[::-1]:
        message.interface_values.append(
            InterfaceValue(interface_names=['temperature', 'current'], values=[40.0, value])
        )
    return message


def test_currents_of_dynamic_joint_states_become_torques_by_gains(bench):
    node, out = merger(
        bench,
        effort_topic='dynamic_joint_states',
        effort_interface='current',
        effort_joints=['drive_a', 'drive_b'],
        gains=[2.0, -0.5],
    )
    efforts = sender(bench, node, DynamicJointState, 'dynamic_joint_states')
    positions = sender(bench, node, JointState, 'joint_states')
    for t in (1.0, 1.1):
        efforts.publish(currents(t, [t, 10.0 * t]))
    positions.publish(joint_state(1.05, JOINTS, [0.1, 0.2], [0.0, 0.0], [77.0, 77.0]))
    bench.spin_until(lambda: out, OUT)
    np.testing.assert_allclose(out[0].effort, [2.0 * 1.05, -0.5 * 10.5])
    np.testing.assert_allclose(out[0].position, [0.1, 0.2])


def test_an_array_without_a_stamp_is_of_the_time_it_comes(bench):
    node, out = merger(bench, effort_topic='currents', gains=[3.0])
    efforts = sender(bench, node, Float64MultiArray, 'currents')
    positions = sender(bench, node, JointState, 'joint_states')
    for k in range(4):
        positions.publish(joint_state(1.0 + k, JOINTS, [k, k]))
        bench.settle()
        efforts.publish(Float64MultiArray(data=[1.0, 2.0]))
        bench.settle()
    assert out
    np.testing.assert_allclose(out[-1].effort, [3.0, 6.0])


def test_the_joints_are_those_of_the_description_for_which_it_waits(bench):
    robot, logged = load_robot('humanoid_arm'), bench.rosout()
    node = bench.add(JointStateMergerNode)
    for _ in range(3):
        node.log_trouble()
    bench.spin_until(lambda: logged, 'the log')
    bench.settle()
    assert ['robot_description' in log.msg for log in logged] == [True]
    publisher = bench.matched_publisher(String, 'robot_description', LATCHED)
    publisher.publish(String(data=robot.urdf))
    bench.spin_until(lambda: node.joints, 'the joints')
    assert node.joints == robot.joints
    assert ', '.join(robot.joints) in node.condition()[0]


def test_what_is_missing_is_named(bench):
    node, _ = merger(bench, effort_topic='dynamic_joint_states', effort_interface='torque')
    efforts = sender(bench, node, DynamicJointState, 'dynamic_joint_states')
    positions = sender(bench, node, JointState, 'joint_states')
    positions.publish(joint_state(1.0, JOINTS, [0.1, 0.2]))
    efforts.publish(currents(1.0, [1.0, 1.0]))
    bench.settle()
    assert 'torque' in node.condition()[0] and 'a, b' in node.condition()[0]
    assert "'torque'" in node.complaints.latest and 'current' in node.complaints.latest


def test_a_topic_without_torques_and_wrong_counts_are_refused(bench):
    with pytest.raises(RecordingError, match=r'gains.*3.*a, b'):
        merger(bench, gains=[1.0, 2.0, 3.0])
    node, _ = merger(bench, effort_topic='words')
    bench.probe.create_publisher(String, 'words', 10)
    bench.spin_until(lambda: node.complaints.counts, 'a complaint')
    assert 'std_msgs/msg/String' in node.complaints.latest
