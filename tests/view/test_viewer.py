# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The viewer shows what is on the topics, in the namespace of the arm."""

from __future__ import annotations

from armid_ros.nodes.qos import LATCHED
from armid_ros.robots import load_robot
from armid_ros.view.nodes.viewer import ViewerNode
from builtin_interfaces.msg import Time
import rerun.chunk
from sensor_msgs.msg import JointState
from std_msgs.msg import String


def joint_state(robot, k, **parts):
    message = JointState(name=list(robot.joints), **parts)
    message.header.stamp = Time(sec=100, nanosec=k * 10**6)
    return message


def test_what_is_on_the_topics_is_in_the_file(bench, tmp_path):
    out, robot = tmp_path / 'live.rrd', load_robot('humanoid_arm')
    node = bench.add(ViewerNode, namespace='left', out=str(out), mark=['elbow_pitch'])
    descriptions = bench.matched_publisher(String, '/left/robot_description', LATCHED)
    states = bench.matched_publisher(JointState, '/left/joint_states')
    residuals = bench.matched_publisher(JointState, '/left/online_identifier/residual')
    descriptions.publish(String(data=robot.urdf))
    bench.spin_until(lambda: node.log is not None, 'the robot')
    zero = [0.0] * robot.n_joints
    for k in range(20):
        states.publish(joint_state(robot, k, position=zero, velocity=zero, effort=zero))
        residuals.publish(joint_state(robot, k, effort=zero))
    bench.spin_until(lambda: node.received == 20, 'joint states')
    bench.settle()
    node.close()
    chunks = rerun.chunk.RrdReader(out).stream().to_chunks()
    rows = {chunk.entity_path: 0 for chunk in chunks}
    for chunk in chunks:
        rows[chunk.entity_path] += 0 if chunk.is_static else chunk.num_rows
    assert rows['/position/elbow_pitch'] == rows['/residual/elbow_pitch'] == 20
    assert rows['/arm/elbow_pitch'] >= 1


def test_a_robot_that_is_none_is_complained_of(bench, tmp_path):
    node = bench.add(ViewerNode, out=str(tmp_path / 'live.rrd'))
    descriptions = bench.matched_publisher(String, 'robot_description', LATCHED)
    descriptions.publish(String(data='<robot/>'))
    bench.spin_until(lambda: node.complaints.counts, 'the complaint')
    assert node.log is None
