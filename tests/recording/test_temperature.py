# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Temperatures of joints in bags."""

from dataclasses import replace
import struct

from armid_ros.errors import RecordingError
from armid_ros.motion import Temperatures
from armid_ros.recording import BagWriter, read_recording, Recording, write_recording
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.joint_state.encoder import write_joint_states
from armid_ros.recording.temperature import TEMPERATURE
import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

JOINTS = ('shoulder', 'elbow')
T = np.arange(400) / 100.0
Q = np.column_stack([np.sin(T), np.cos(T)])
STATES = 'control_msgs/msg/DynamicJointState'
DEFINITIONS = f"""std_msgs/Header header
string[] joint_names
InterfaceValue[] interface_values
{'=' * 80}
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
"""


def recording(values=((20.0, 30.0), (24.0, np.nan)), t=(0.0, 2.0)):
    heat = Temperatures(np.array(t), np.array(values))
    return Recording(joints=JOINTS, t=T, q=Q, tau=Q, temperature=heat)


def message(stamp, frame, value):
    """Serialise a sensor_msgs/Temperature."""
    head = struct.pack('<iII', *divmod(stamp, 10**9), len(frame) + 1) + frame.encode() + b'\0'
    head += bytes(-len(head) % 8)
    return b'\0\1\0\0' + head + struct.pack('<dd', value, 0.0)


def bag_with(path, topics):
    """Write a bag of joint states and of one temperature for each topic and frame."""
    with BagWriter(path) as writer:
        write_joint_states(writer, '/joint_states', JOINTS, 10**9 + T * 1e9, Q, None, Q)
        for topic, frame, value in topics:
            writer.add_topic(topic, TEMPERATURE)
            for stamp in (10**9, 3 * 10**9):
                writer.write(topic, message(stamp, frame, value), stamp)
    return path


def test_a_bag_keeps_the_temperatures_of_its_joints(tmp_path):
    write_recording(tmp_path / 'bag', recording())
    back = read_recording(tmp_path / 'bag', joints=JOINTS[::-1])
    np.testing.assert_allclose(back.temperature.at([0.0, 1.0, 9.0])[:, 1], [20.0, 22.0, 24.0])
    np.testing.assert_allclose(back.temperature.at(T)[:, 0], 30.0)
    assert back.report.unharmed


def test_a_joint_is_named_by_the_frame_or_by_the_topic(tmp_path):
    topics = [
        ('/heat', 'shoulder', 20.0),
        ('/arm/elbow_temperature', 'link_2', 30.0),
        ('/hall', '', 300.0),
    ]
    back = read_recording(bag_with(tmp_path / 'bag', topics), joints=JOINTS)
    np.testing.assert_allclose(back.temperature.at(T[:1]), [[20.0, 30.0]])


@pytest.mark.parametrize(
    ('value', 'problem'), [(300.0, '300.*150 degC'), (np.nan, 'no temperature is a finite')]
)
def test_wrong_temperatures_are_refused_with_their_place(tmp_path, value, problem):
    path = bag_with(tmp_path / 'bag', [('/heat', 'elbow', value)])
    with pytest.raises(RecordingError, match=f'bag: /heat: elbow: .*{problem}'):
        read_recording(path, joints=JOINTS)
    without = read_recording(path, columns=ColumnSettings(temperature='none'))
    assert without.temperature is None


def test_ros2_control_has_temperatures_as_an_interface(tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(DEFINITIONS, STATES))
    value = store.types['control_msgs/msg/InterfaceValue']
    header = store.types['std_msgs/msg/Header']
    stamp = store.types['builtin_interfaces/msg/Time']
    with BagWriter(tmp_path / 'bag') as writer:
        write_joint_states(writer, '/joint_states', JOINTS, 10**9 + T * 1e9, Q)
        writer.add_topic('/dynamic_joint_states', STATES, definition=DEFINITIONS)
        names = ['position', 'motor_temperature']
        states = [value(names, np.array([0.1, 31.0])), value(names, np.array([0.2, 41.0]))]
        one = store.types[STATES](header(stamp(1, 0), ''), list(JOINTS), states)
        cdr = bytes(store.serialize_cdr(one, STATES))
        for k in range(100):
            writer.write('/dynamic_joint_states', cdr, 10**9 + k * 10**7)
    back = read_recording(tmp_path / 'bag', joints=JOINTS)
    np.testing.assert_allclose(back.temperature.at(T[:1]), [[31.0, 41.0]])


def test_temperatures_have_a_column_for_each_joint():
    with pytest.raises(RecordingError, match=r'temperatures have shape \(2, 1\)'):
        recording(values=((20.0,), (21.0,)))
    kept = replace(recording(), source='run').select(slice(100, 200))
    np.testing.assert_allclose(kept.temperature.at(kept.t[:1])[0, 0], 22.0)
