# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What one writes the other reads: this package, rosbags and mcap-ros2-support."""

from dataclasses import replace

from armid_ros.errors import ArmidError, RecordingError
from armid_ros.recording import (
    given_twice,
    read_recording,
    read_robot_description,
    Recording,
    require_once,
    topics,
    write_recording,
)
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.metadata import LATCHED, VOLATILE
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionFormat, CompressionMode
from rosbags.typesys import get_typestore, Stores

from .conftest import assert_same, serialised, swing


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
@pytest.mark.parametrize('chunk_size', [1, 4096, 1 << 20])
def test_what_is_written_is_read_back_exactly(swinging, tmp_path, compression, chunk_size):
    write_recording(tmp_path / 'bag', swinging, compression=compression, chunk_size=chunk_size)
    back = read_recording(tmp_path / 'bag', joints=swinging.joints)
    assert_same(back, swinging)
    assert back.start_ns == swinging.start_ns
    assert back.clock == 'header'
    assert back.topic == '/joint_states'
    assert back.report.clean
    assert (back.report.messages, back.report.samples) == (500, 500)


def test_the_robot_description_travels_with_the_recording(swinging, tmp_path):
    urdf = '<robot name="ärmchen"/>'
    write_recording(tmp_path / 'with', swinging, robot_description=urdf)
    write_recording(tmp_path / 'without', swinging)
    assert read_robot_description(tmp_path / 'with') == urdf
    assert read_robot_description(tmp_path / 'without') is None
    offered = {topic.name: topic.qos for topic in topics(tmp_path / 'with')}
    assert offered == {'/robot_description': (LATCHED,), '/joint_states': (VOLATILE,)}


def test_rosbags_reads_what_is_written(swinging, tmp_path, stamps):
    write_recording(tmp_path / 'bag', swinging)
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == len(swinging)
        assert reader.start_time == stamps[0]
        assert reader.ros_distro == 'jazzy'
        (connection,) = reader.connections
        assert connection.msgtype == JOINT_STATE
        assert connection.digest == store.hash_rihs01(JOINT_STATE)
        rows = [
            (log, store.deserialize_cdr(raw, JOINT_STATE)) for _, log, raw in reader.messages()
        ]
    np.testing.assert_array_equal([log for log, _ in rows], stamps)
    assert all(tuple(message.name) == swinging.joints for _, message in rows)
    np.testing.assert_array_equal([message.position for _, message in rows], swinging.q)
    np.testing.assert_array_equal([message.effort for _, message in rows], swinging.tau)
    stamp = rows[-1][1].header.stamp
    assert stamp.sec * 10**9 + stamp.nanosec == stamps[-1]


def test_mcap_ros2_reads_what_is_written_by_its_own_schema(swinging, tmp_path, stamps):
    write_recording(tmp_path / 'bag', swinging)
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == 'ros2'
        rows = list(reader.iter_decoded_messages())
    assert [message.log_time for _, _, message, _ in rows] == stamps.tolist()
    np.testing.assert_array_equal([list(row[3].velocity) for row in rows], swinging.dq)


@pytest.mark.parametrize('version', [8, 9])
@pytest.mark.parametrize('distribution', [Stores.ROS2_FOXY, Stores.LATEST])
@pytest.mark.parametrize(
    ('storage', 'mode'),
    [(StoragePlugin.MCAP, mode) for mode in CompressionMode]
    + [(StoragePlugin.SQLITE3, m) for m in CompressionMode if m is not CompressionMode.STORAGE],
)
def test_what_rosbags_writes_is_read(
    swinging, tmp_path, stamps, version, distribution, storage, mode
):
    store = get_typestore(distribution)
    writer = Writer(tmp_path / 'bag', version=version, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    messages = serialised(swinging.joints, stamps, swinging.q, swinging.dq, swinging.tau)
    with writer:
        connection = writer.add_connection('/arm/joint_states', JOINT_STATE, typestore=store)
        for stamp, message in zip(stamps.tolist(), messages, strict=True):
            writer.write(connection, stamp, message)
    back = read_recording(tmp_path / 'bag', joints=swinging.joints)
    assert_same(back, swinging)
    assert back.topic == '/arm/joint_states'
    assert back.report.clean
    (topic,) = topics(tmp_path / 'bag')
    assert (topic.count, topic.type_name) == (len(swinging), JOINT_STATE)
    if mode is CompressionMode.FILE:
        (packed,) = (tmp_path / 'bag').glob('*.zstd')
        assert_same(read_recording(packed, joints=swinging.joints), swinging)


@pytest.mark.parametrize('names', [('j',), ('a', 'bc', 'def', 'ghij', 'klmno'), ('ä', 'gelenk_2')])
@pytest.mark.parametrize('frame_id', ['', 'x', 'a_longer_frame'])
@pytest.mark.parametrize('fields', ['q', 'q dq', 'q tau', 'q dq tau'])
def test_the_encoder_agrees_with_rosbags_whatever_the_lengths(names, frame_id, fields):
    rng = np.random.default_rng(len(names) + len(frame_id))
    arrays = [
        rng.normal(size=(3, len(names))) if name in fields.split() else None
        for name in ('q', 'dq', 'tau')
    ]
    store = get_typestore(Stores.ROS2_JAZZY)
    stamps = [1, 2 * 10**9 + 3, 4 * 10**9]
    messages = serialised(names, stamps, *arrays, frame_id=frame_id)
    for at, (stamp, raw) in enumerate(zip(stamps, messages, strict=True)):
        message = store.deserialize_cdr(raw, JOINT_STATE)
        assert message.header.frame_id == frame_id
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
        assert tuple(message.name) == names
        for field, array in zip(('position', 'velocity', 'effort'), arrays, strict=True):
            expected = [] if array is None else array[at]
            np.testing.assert_array_equal(getattr(message, field), expected)
        assert bytes(store.serialize_cdr(message, JOINT_STATE)) == raw


@pytest.mark.parametrize(
    ('t', 'shape', 'facts'),
    [
        (np.arange(4.0), (4, 2), r'q.*\(4, 2\).*\(4, 3\)'),
        (np.array([0.0, 0.1, 0.1, 0.2]), (4, 3), 'sample 2 '),
        (np.array([0.0, 0.2, 0.1, 0.3]), (4, 3), 'sample 2 '),
    ],
)
def test_a_recording_refuses_arrays_that_do_not_match(t, shape, facts):
    with pytest.raises(ArmidError, match=facts):
        Recording(joints=('a', 'b', 'c'), t=t, q=np.zeros(shape))


def test_a_recording_of_no_samples_is_a_bag_that_says_so(tmp_path):
    empty = Recording(joints=('a',), t=np.empty(0), q=np.empty((0, 1)))
    write_recording(tmp_path / 'bag', empty)
    with pytest.raises(RecordingError, match='bag: /joint_states'):
        read_recording(tmp_path / 'bag', joints=['a'])


@pytest.fixture
def monday():
    return replace(swing(), source='monday')


def test_a_copy_is_said_with_what_it_is_a_copy_of(monday):
    copy = replace(monday, source='copy')
    for recordings in ([monday, copy],), ([monday], [copy]):
        with pytest.raises(RecordingError, match=r'copy.*monday'):
            require_once(*recordings)
    assert 'monday' in given_twice([monday], [monday])


def test_the_same_motion_with_other_torques_is_another_run(monday):
    """Two runs of a simulated trajectory, or of one without encoder noise."""
    assert not given_twice([monday], [replace(monday, tau=monday.tau + 1e-6)])
    assert not given_twice([monday, replace(monday, tau=None)])
    assert not given_twice([monday])
