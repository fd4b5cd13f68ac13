# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags in all the forms they come in, and things that are no bags."""

import shutil
import sqlite3

from armid_ros.errors import RecordingError
from armid_ros.recording import (
    BagWriter,
    read_recording,
    read_robot_description,
    topics,
    write_recording,
)
from armid_ros.recording.message_types import JOINT_STATE, message_type, STRING, string_cdr
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapFileWriter
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
import yaml

from .conftest import assert_same, iter_raw, JOINTS, messages_of, serialised, sqlite_bag


@pytest.fixture
def split_bag(swinging, tmp_path):
    """Return a bag split into 12 files by rosbag2, without metadata."""
    bag = tmp_path / 'split'
    bag.mkdir()
    for number, at in enumerate(range(0, 500, 42)):
        part = tmp_path / f'part{number}'
        piece = swinging.select(slice(at, at + 42))
        write_recording(part, piece, compression='lz4' if number % 2 else 'none')
        shutil.move(part / f'part{number}_0.mcap', bag / f'split_{number}.mcap')
    return bag


def test_a_split_bag_is_read_in_order_with_and_without_metadata(split_bag, swinging):
    without = read_recording(split_bag, joints=JOINTS)
    assert_same(without, swinging)
    assert without.report.clean
    assert [topic.count for topic in topics(split_bag)] == [500]
    times = [message.log_time_ns for message in iter_raw(split_bag)]
    assert times == sorted(times)
    assert len(times) == 500
    names = [f'split_{number}.mcap' for number in range(11)]
    metadata = {'version': 9, 'relative_file_paths': names, 'storage_identifier': 'mcap'}
    (split_bag / 'metadata.yaml').write_text(
        yaml.safe_dump({'rosbag2_bagfile_information': metadata})
    )
    assert_same(read_recording(split_bag, joints=JOINTS), swinging, slice(0, 462))


def test_paths_of_old_metadata_begin_with_the_directory(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    information = {'version': 3, 'relative_file_paths': ['bag/bag_0.mcap']}
    (tmp_path / 'bag' / 'metadata.yaml').write_text(
        yaml.safe_dump({'rosbag2_bagfile_information': information})
    )
    assert_same(read_recording(tmp_path / 'bag', joints=JOINTS), swinging)


@pytest.mark.parametrize('compression', list(CompressionType))
@pytest.mark.parametrize('indexes', [IndexType.ALL, IndexType.NONE])
@pytest.mark.parametrize('chunked', [True, False])
@pytest.mark.parametrize('summary', [True, False])
def test_files_of_mcaps_own_writer_are_read_however_bare(
    swinging, stamps, tmp_path, compression, indexes, chunked, summary
):
    """Of two publishers there are two channels, which are one topic."""
    path = tmp_path / 'file.mcap'
    messages = serialised(JOINTS, stamps, swinging.q, swinging.dq, swinging.tau)
    with path.open('wb') as stream:
        writer = McapFileWriter(
            stream,
            chunk_size=20_000,
            compression=compression,
            index_types=indexes,
            use_chunking=chunked,
            repeat_channels=summary,
            repeat_schemas=summary,
            use_statistics=summary,
            use_summary_offsets=summary,
        )
        writer.start(profile='ros2')
        text = message_type(JOINT_STATE).definition.encode()
        schema = writer.register_schema('sensor_msgs/JointState', 'ros2msg', text)
        other = writer.register_channel('/chatter', 'cdr', 0)
        channels = [writer.register_channel('/joint_states', 'cdr', schema) for _ in range(2)]
        for at, (stamp, message) in enumerate(zip(stamps.tolist(), messages, strict=True)):
            writer.add_message(channels[at % 3 == 0], stamp, message, stamp)
            writer.add_message(other, stamp, b'x' * (at % 50), stamp)
        writer.finish()
    recording = read_recording(path, joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.report.clean
    assert {topic.name: topic.count for topic in topics(path)} == {
        '/chatter': 500,
        '/joint_states': 500,
    }
    assert len(list(iter_raw(path))) == 1000


@pytest.mark.parametrize('columns', ['', ', offered_qos_profiles TEXT NOT NULL'])
def test_sqlite_files_of_the_first_distributions_are_read(swinging, stamps, tmp_path, columns):
    path = tmp_path / 'old.db3'
    sqlite_bag(path, messages_of(swinging, stamps), columns).close()
    before = path.read_bytes()
    recording = read_recording(path, joints=JOINTS)
    assert_same(recording, swinging)
    assert [message.log_time_ns for message in iter_raw(path)] == stamps.tolist()
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ['old.db3']


@pytest.mark.parametrize('times', [np.random.default_rng(5).permutation(2000).tolist(), 50 * [10]])
def test_messages_come_in_the_order_of_time_and_then_of_storage(tmp_path, times):
    stored = [('/b' if time % 2 else '/a', time, str(k)) for k, time in enumerate(times)]
    with BagWriter(tmp_path / 'bag', chunk_size=500) as writer:
        writer.add_topic('/a', STRING)
        writer.add_topic('/b', STRING)
        for topic, time, text in stored:
            writer.write(topic, string_cdr(text), time)
    messages = [(m.topic, m.log_time_ns, m.cdr) for m in iter_raw(tmp_path / 'bag')]
    in_order = sorted(stored, key=lambda message: message[1])
    assert messages == [(topic, time, string_cdr(text)) for topic, time, text in in_order]


def test_several_robot_descriptions_are_refused_equal_ones_are_not(tmp_path):
    for name, texts in (('same', ['<a/>', '<a/>']), ('other', ['<a/>', '<b/>'])):
        with BagWriter(tmp_path / name) as writer:
            for side, text in zip(('left', 'right'), texts, strict=True):
                writer.add_topic(f'/{side}/robot_description', STRING)
                writer.write(f'/{side}/robot_description', string_cdr(text), 1)
    assert read_robot_description(tmp_path / 'same') == '<a/>'
    with pytest.raises(RecordingError, match='/left/robot_description, /right/robot_description'):
        read_robot_description(tmp_path / 'other')


@pytest.mark.parametrize(
    ('name', 'content', 'fact'),
    [
        ('file.mcap', b'', 'empty'),
        ('file.mcap', bytes(1000), 'MCAP'),
        ('file.mcap', b'\x89MCAP0\r\n', 'no message'),
        ('file.mcap', b'\x89MCAP0\r\n' + b'\xff' * 500, 'no message'),
        ('file.db3', b'', 'rosbag2'),
        ('file.db3', b'rubbish' * 500, 'rosbag2'),
        ('file.mcap.zstd', b'rubbish' * 500, 'damaged'),
        ('file.bag', b'#ROSBAG V2.0', 'ROS 1'),
        ('absent', None, ''),
    ],
)
def test_what_is_no_bag_is_refused_with_its_name(tmp_path, name, content, fact):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordingError, match=f'{name}: .*{fact}'):
        read_recording(tmp_path / name, joints=JOINTS)


def test_directories_that_are_no_bags_are_refused_with_what_they_hold(swinging, tmp_path):
    write_recording(tmp_path / 'runs' / 'first', swinging)
    with pytest.raises(RecordingError, match=r'runs: .*runs/first'):
        read_recording(tmp_path / 'runs', joints=JOINTS)
    bag = tmp_path / 'runs' / 'first'
    (bag / 'first_0.db3').write_bytes(b'')
    (bag / 'metadata.yaml').unlink()
    with pytest.raises(RecordingError, match=r'first_0.db3, first_0.mcap'):
        read_recording(bag, joints=JOINTS)


@pytest.mark.parametrize(
    ('old', 'new', 'fact'),
    [
        ('bag_0.mcap', 'bag_1.mcap', 'bag_1.mcap.*bag_0.mcap'),
        ('bag_0.mcap', 'metadata.yaml', 'metadata.yaml'),
        (None, 'a: [', ''),
        (None, 'rosbag2_bagfile_information: 3', ''),
        (None, '', ''),
    ],
)
def test_metadata_that_lies_is_refused_with_what_there_is(swinging, tmp_path, old, new, fact):
    write_recording(tmp_path / 'bag', swinging)
    metadata = tmp_path / 'bag' / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace(old, new) if old else new)
    with pytest.raises(RecordingError, match=f'metadata.yaml: .*{fact}'):
        read_recording(tmp_path / 'bag', joints=JOINTS)


def test_a_crashed_sqlite_recording_is_read_with_its_journal(swinging, stamps, tmp_path):
    bag = tmp_path / 'bag'
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = serialised(JOINTS, stamps, swinging.q, swinging.dq, swinging.tau)
    with Writer(bag, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection('/joint_states', JOINT_STATE, typestore=store)
        for stamp, message in zip(stamps[:300].tolist(), messages[:300], strict=True):
            writer.write(connection, stamp, message)
    (bag / 'metadata.yaml').unlink()
    database = sqlite3.connect(bag / 'bag.db3')
    database.execute('PRAGMA journal_mode = WAL')
    rows = zip(stamps[300:].tolist(), messages[300:], strict=True)
    database.executemany('INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)', rows)
    database.commit()
    crashed = tmp_path / 'crashed'
    shutil.copytree(bag, crashed)
    database.close()
    assert (crashed / 'bag.db3-wal').exists()
    assert_same(read_recording(crashed, joints=JOINTS), swinging)
