# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of ROS 1 hold what they held when they are bags of ROS 2; joints can get other names."""

from armid_ros.errors import RecordingError
from armid_ros.recording import read_recording, topics
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.copying import copy_bag
import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

JOINTS = ('fer_joint1', 'fer_joint2')
JOINT_STATE = 'sensor_msgs/msg/JointState'
T0 = 1_700_000_000


@pytest.fixture
def motion():
    """Return time, positions and torques."""
    t = np.arange(300) * 0.01
    q = np.column_stack([np.sin(t), np.cos(2 * t)])
    return t, q, 5.0 * q


@pytest.fixture
def bag(tmp_path, motion):
    """Write a bag of ROS 1 with joint states, a description and a type of its own."""
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg('float64 x', 'my_msgs/msg/Own'))
    states, header = store.types[JOINT_STATE], store.types['std_msgs/msg/Header']
    stamp, own = store.types['builtin_interfaces/msg/Time'], store.types['my_msgs/msg/Own']
    path = tmp_path / 'run.bag'
    with Writer(path) as writer:
        connections = {
            name: writer.add_connection(name, kind, typestore=store)
            for name, kind in (
                ('/joint_states', JOINT_STATE),
                ('/robot_description', 'std_msgs/msg/String'),
                ('/own', 'my_msgs/msg/Own'),
            )
        }

        def write(name, kind, message, when):
            raw = store.serialize_ros1(message, kind)
            writer.write(connections[name], when, raw)

        write('/own', 'my_msgs/msg/Own', own(1.0), T0 * 10**9)
        text = store.types['std_msgs/msg/String']('<robot name="r"/>')
        write('/robot_description', 'std_msgs/msg/String', text, T0 * 10**9)
        for k, (when, q, tau) in enumerate(zip(*motion, strict=True)):
            ns = round(when * 1e9)
            time = stamp(T0 + ns // 10**9, ns % 10**9)
            message = states(header(k, time, 'base'), list(JOINTS), q, np.zeros(0), tau)
            write('/joint_states', JOINT_STATE, message, T0 * 10**9 + ns + 500)
    return path


def test_what_ros_2_has_a_type_for_is_kept_and_the_rest_is_named(bag, motion, tmp_path):
    copied = copy_bag(bag, tmp_path / 'out')
    assert {topic.name: topic.count for topic in topics(tmp_path / 'out')} == {
        '/joint_states': 300,
        '/robot_description': 1,
    }
    assert len(copied.left_out) == 1
    assert '/own (my_msgs/msg/Own)' in copied.left_out[0]
    recording = read_recording(tmp_path / 'out', joints=JOINTS)
    np.testing.assert_allclose(recording.t, motion[0], atol=1e-9)
    np.testing.assert_array_equal(recording.q, motion[1])
    np.testing.assert_array_equal(recording.tau, motion[2])
    assert recording.dq is None
    assert recording.start_ns == T0 * 10**9
    assert recording.clock == 'header'


@pytest.mark.parametrize(
    ('joints', 'rule'),
    [
        (('panda_joint1', 'panda_joint2'), '--rename fer_:panda_'),
        (('joint1', 'joint2'), '--rename fer_:'),
        (('arm_fer_joint1', 'arm_fer_joint2'), '--rename fer_:arm_fer_'),
        (('ferjoint1', 'ferjoint2'), '--rename fer_:fer'),
    ],
)
def test_one_rule_renames_all_joints(bag, motion, joints, rule):
    with pytest.raises(RecordingError, match=f'{rule}$'):
        read_recording(bag, joints=joints)
    said = ColumnSettings(rename=(tuple(rule.split(' ')[1].split(':')),))
    recording = read_recording(bag, joints=joints[::-1], columns=said)
    np.testing.assert_array_equal(recording.q, motion[1][:, ::-1])
    assert (recording.joints, recording.source) == (joints[::-1], str(bag))
