# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A JointState inside another message or compressed is read; one of another schema is refused."""

from armid_ros.errors import RecordingError
from armid_ros.recording import read_recording, topics
from armid_ros.recording.message_types import JOINT_STATE, message_type
from mcap.writer import Writer as McapFileWriter
import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
import zstandard

from .conftest import assert_same, JOINTS, messages_of, serialised, swing

HEADER = 'std_msgs/Header header'
STANDARD = message_type(JOINT_STATE).definition
PARTS = STANDARD[STANDARD.index('\n===') :]


def write(path, name, kind, definition, encoding, messages, stamps):
    with path.open('wb') as stream:
        writer = McapFileWriter(stream)
        writer.start()
        schema = writer.register_schema(name, kind, definition.encode())
        channel = writer.register_channel('/joint_states', encoding, schema)
        for stamp, message in zip(stamps.tolist(), messages, strict=True):
            writer.add_message(channel, stamp, message, stamp)
        writer.finish()
    return path


def fields_of(recording, stamps):
    """Yield stamp, positions, velocities and efforts of each message."""
    for k, stamp in enumerate(stamps.tolist()):
        yield divmod(stamp, 10**9), recording.q[k], recording.dq[k], recording.tau[k]


def by_schema(path, recording, stamps, definition, make, name=JOINT_STATE):
    """Write messages of a schema of one's own, in CDR; make each of its header and fields."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, name))
    types, messages = store.types, []
    for (sec, nanosec), *fields in fields_of(recording, stamps):
        stamp = types['builtin_interfaces/msg/Time'](sec, nanosec)
        message = make(types, types['std_msgs/msg/Header'](stamp, ''), *fields)
        messages.append(bytes(store.serialize_cdr(message, name)))
    return write(path, name, 'ros2msg', definition, 'cdr', messages, stamps)


def exchanged_fields(path, recording, stamps):
    """Write joint states whose definition has the efforts before the velocities."""

    def make(types, header, q, dq, tau):
        return types[JOINT_STATE](header, list(JOINTS), tau, dq, q)

    lines = [
        HEADER,
        'string[] name',
        *(f'float64[] {x}' for x in ('effort', 'velocity', 'position')),
    ]
    return by_schema(path, recording, stamps, '\n'.join(lines) + PARTS, make)


def inside_another_type(path, recording, stamps):
    name = 'franka_msgs/msg/FrankaRobotState'
    own = 'sensor_msgs/JointState desired_joint_state\nsensor_msgs/JointState measured_joint_state'
    split = '\n' + '=' * 80 + '\n'
    definition = f'{own}{split}MSG: sensor_msgs/JointState\n{STANDARD}'

    def make(types, header, q, dq, tau):
        state = types[JOINT_STATE](header, list(JOINTS), q, dq, tau)
        desired = types[JOINT_STATE](header, list(JOINTS), 0 * q, dq, tau)
        return types[name](desired_joint_state=desired, measured_joint_state=state)

    return by_schema(path, recording, stamps, definition, make, name)


def messages_packed_by_zstd(path, recording, stamps):
    messages = serialised(JOINTS, stamps, recording.q, recording.dq, recording.tau)
    packed = [zstandard.compress(message) for message in messages]
    return write(path, JOINT_STATE, 'ros2msg', STANDARD, 'cdr', packed, stamps)


def file_packed_by_zstd(path, recording, stamps):
    messages = serialised(JOINTS, stamps, recording.q, recording.dq, recording.tau)
    write(path, JOINT_STATE, 'ros2msg', STANDARD, 'cdr', messages, stamps)
    packed = path.with_name('bag.mcap.zst')
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    return packed


@pytest.mark.parametrize(
    'made',
    [inside_another_type, messages_packed_by_zstd, file_packed_by_zstd],
)
def test_what_holds_a_joint_state_is_read(made, swinging, stamps, tmp_path):
    path = made(tmp_path / 'bag.mcap', swinging, stamps)
    read = read_recording(path, joints=JOINTS)
    assert_same(read, swinging)
    assert read.report.clean
    assert any(topic.joints == JOINTS for topic in topics(path))


def test_another_schema_of_joint_states_is_refused(swinging, stamps, tmp_path):
    path = exchanged_fields(tmp_path / 'bag.mcap', swinging, stamps)
    with pytest.raises(RecordingError, match=r'/joint_states: .*sensor_msgs'):
        read_recording(path, joints=JOINTS)


def test_an_encoding_that_nobody_reads_is_named(swinging, stamps, tmp_path):
    path = tmp_path / 'bag.mcap'
    write(path, JOINT_STATE, 'protobuf', '', 'protobuf', [b'\x01'] * len(stamps), stamps)
    with pytest.raises(RecordingError, match='protobuf'):
        read_recording(path, joints=JOINTS)


def test_a_file_behind_a_file_is_said(swinging, stamps, tmp_path):
    messages = serialised(JOINTS, stamps, swinging.q, swinging.dq, swinging.tau)
    half, path = len(stamps) // 2, tmp_path / 'both.mcap'
    parts = [
        write(tmp_path / 'part.mcap', JOINT_STATE, 'ros2msg', STANDARD, 'cdr', messages[of],
              stamps[of]).read_bytes()
        for of in (slice(half), slice(half, None))
    ]  # fmt: skip
    path.write_bytes(b''.join(parts))
    report = read_recording(path, joints=JOINTS).report
    assert report.samples == half
    assert str(len(parts[1])) in report.damage and not report.clean


def test_arms_on_topics_of_their_own_are_one_recording(stamps, write_bag):
    left, right = swing(joints=('left_1', 'left_2')), swing(joints=('right_1',))
    messages = messages_of(left, stamps, topic='/left/joint_states')
    bag = write_bag(messages + messages_of(right, stamps, topic='/right/joint_states'))
    joints = ('right_1', 'left_1', 'left_2')
    read = read_recording(bag, joints=joints)
    np.testing.assert_array_equal(read.q, np.column_stack([right.q, left.q]))
    assert '/left/joint_states' in read.topic and '/right/joint_states' in read.topic
