# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags as rosbag2 expects them, whatever ends the writing."""

import inspect
import resource
import signal
import subprocess
import sys
import tracemalloc

from armid_ros.errors import RecordingError
from armid_ros.recording import BagWriter, read_recording, topics, write_recording
from armid_ros.recording.mcap.writer import McapWriter
from armid_ros.recording.message_types import (
    JOINT_STATE,
    message_type,
    store_for,
    STRING,
    string_cdr,
)
from armid_ros.recording.metadata import LATCHED, VOLATILE
from armid_ros.recording.writer import atomic_bag, DEFAULT_CHUNK_AGE
from mcap.reader import make_reader
from mcap.records import Chunk, MessageIndex, Metadata
from mcap.stream_reader import StreamReader
import numpy as np
import pytest
from rosbags.interfaces import QosHistory, QosReliability, QosTime
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
import yaml

from .conftest import assert_same, JOINTS, messages_of, serialised, swing

WRITER_FILES = [inspect.getfile(BagWriter), inspect.getfile(McapWriter)]


def metadata_of(bag):
    """Return the inner map of a bag's metadata.yaml."""
    return yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']


@pytest.mark.parametrize('count', [500, 0])
def test_metadata_is_that_which_rosbags_writes(stamps, tmp_path, count):
    recording = swing(count)
    write_recording(tmp_path / 'run', recording)
    store = get_typestore(Stores.ROS2_JAZZY)
    stamps = stamps[:count]
    cdr = serialised(JOINTS, stamps, recording.q, recording.dq, recording.tau)
    bag = tmp_path / 'run_0'  # whose file is run_0.mcap
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(
            '/joint_states', JOINT_STATE, typestore=store, offered_qos_profiles=[VOLATILE]
        )
        for stamp, message in zip(stamps.tolist(), cdr, strict=True):
            writer.write(connection, stamp, message)
    assert metadata_of(tmp_path / 'run') == metadata_of(bag) | {'ros_distro': 'jazzy'}


def test_the_file_is_in_order_by_mcaps_own_rules(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging, chunk_size=20_000, robot_description='<robot/>')
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as stream:
        records = list(StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
        stream.seek(0)
        reader = make_reader(stream, validate_crcs=True)
        inside = list(reader.iter_messages())
        summary = reader.get_summary()
    kinds = [type(record).__name__ for record in records]
    assert kinds[0] == 'Header'
    assert kinds[-1] == 'Footer'
    chunks = [record for record in records if isinstance(record, Chunk)]
    assert len(chunks) == summary.statistics.chunk_count > 3
    assert sum(isinstance(record, MessageIndex) for record in records) == len(chunks) + 1
    assert len(inside) == summary.statistics.message_count == len(swinging) + 1
    assert all(message.publish_time == message.log_time for _, _, message in inside)
    written = [record for record in records if isinstance(record, Metadata)]
    assert [record.name for record in written] == ['rosbag2', 'rosbag2']
    first, last = (yaml.safe_load(record.metadata['serialized_metadata']) for record in written)
    assert (first['message_count'], last['message_count']) == (0, 501)
    assert last == metadata_of(tmp_path / 'bag')


def test_qos_is_recorded(tmp_path):
    offered = [
        LATCHED,
        LATCHED._replace(
            history=QosHistory.KEEP_LAST,
            depth=7,
            reliability=QosReliability.BEST_EFFORT,
            deadline=QosTime(1, 500_000_000),
        ),
    ]
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/chatter', STRING, qos=offered)
    (topic,) = topics(tmp_path / 'bag')
    assert topic.qos == tuple(offered)
    with Reader(tmp_path / 'bag') as reader:
        assert reader.connections[0].ext.offered_qos_profiles == offered


def test_a_type_installed_in_a_workspace_is_found(tmp_path, monkeypatch):
    folder = tmp_path / 'prefix' / 'share' / 'my_msgs' / 'msg'
    folder.mkdir(parents=True)
    (folder / 'Inner.msg').write_text('float64 value\n')
    (folder / 'Outer.msg').write_text('my_msgs/Inner[] parts\ngeometry_msgs/Vector3 axis\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path / "prefix"}')
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/outer', 'my_msgs/msg/Outer')
    (topic,) = topics(tmp_path / 'bag')
    parts = topic.message_type.definition.split('=' * 80 + '\n')
    assert [part.splitlines()[0] for part in parts[1:]] == [
        'MSG: my_msgs/Inner',
        'MSG: geometry_msgs/Vector3',
    ]


def test_a_type_nobody_knows_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/nowhere')
    with BagWriter(tmp_path / 'bag') as writer:
        with pytest.raises(RecordingError, match=r'my_msgs/msg/Outer.*/nowhere'):
            writer.add_topic('/outer', 'my_msgs/msg/Outer')
        with pytest.raises(RecordingError, match='my_msgs/msg/Outer: '):
            writer.add_topic('/outer', 'my_msgs/msg/Outer', definition='float64 ) value')
        assert writer.topics == ()


def test_a_bag_is_never_overwritten(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    before = (tmp_path / 'bag' / 'bag_0.mcap').read_bytes()
    with pytest.raises(RecordingError, match='bag: '):
        write_recording(tmp_path / 'bag', swinging)
    assert (tmp_path / 'bag' / 'bag_0.mcap').read_bytes() == before


def test_misuse_is_refused_by_name(tmp_path):
    with pytest.raises(RecordingError, match=r'gzip.*zstd'):
        BagWriter(tmp_path / 'other', compression='gzip')
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match='file/bag'):
        BagWriter(tmp_path / 'file' / 'bag')
    writer = BagWriter(tmp_path / 'bag')
    writer.add_topic('/chatter', STRING)
    writer.add_topic('/chatter', STRING)
    with pytest.raises(RecordingError, match=r'/chatter.*std_msgs/msg/String'):
        writer.add_topic('/chatter', JOINT_STATE)
    with pytest.raises(RecordingError, match=r'/chat.*/chatter'):
        writer.write('/chat', b'', 1)
    writer.close()
    writer.close()
    with pytest.raises(RecordingError, match='closed'):
        writer.write('/chatter', string_cdr(''), 1)


def test_what_was_written_before_an_error_is_a_complete_bag(swinging, stamps, tmp_path):
    with pytest.raises(ZeroDivisionError), BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/joint_states', JOINT_STATE)
        for topic, cdr, time in messages_of(swinging, stamps)[:100]:
            writer.write(topic, cdr, time)
        raise ZeroDivisionError
    recording = read_recording(tmp_path / 'bag', joints=JOINTS)
    assert_same(recording, swinging, slice(0, 100))
    assert recording.report.clean
    assert metadata_of(tmp_path / 'bag')['message_count'] == 100


class InterruptAt:
    """Raises KeyboardInterrupt when so many lines of the writer have been run."""

    def __init__(self, line):
        self.left = line

    def __call__(self, frame, event, _):
        if frame.f_code.co_filename not in WRITER_FILES:
            return None
        if event == 'line':
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt
        return self


def write_interrupted(bag, messages, line):
    """Write messages and close the bag; return which message was interrupted, None if none."""
    bag_writer = BagWriter(bag, chunk_size=700, clock=lambda: 0.0)
    bag_writer.add_topic('/joint_states', JOINT_STATE)
    trace, struck = sys.gettrace(), None
    rest = list(messages)
    sys.settrace(InterruptAt(line))
    try:
        while rest:
            topic, cdr, time = rest.pop(0)
            bag_writer.write(topic, cdr, time)
        time = None
        bag_writer.close()
    except KeyboardInterrupt:
        struck = time or 'close'
    finally:
        sys.settrace(trace)
    for topic, cdr, time in rest:
        bag_writer.write(topic, cdr, time)
    bag_writer.close()
    return struck


def test_an_interrupt_anywhere_in_the_writer_spoils_nothing(swinging, stamps, tmp_path):
    messages = messages_of(swinging, stamps)[:4]
    expected = stamps[:4].tolist()
    line, struck = 0, True
    while struck:
        line += 1
        bag = tmp_path / f'bag{line}'
        struck = write_interrupted(bag, messages, line)
        with (bag / f'bag{line}_0.mcap').open('rb') as stream:
            reader = make_reader(stream, validate_crcs=True)
            times = [message.log_time for _, _, message in reader.iter_messages()]
            count = reader.get_summary().statistics.message_count
        # Only the message that was being written may be lost.
        assert times in (expected, [time for time in expected if time != struck])
        metadata = (bag / 'metadata.yaml').read_text()
        assert count == len(times)
        assert f'message_count: {count}\n' in metadata
    assert line > 100


KILLED = """
import sys
from armid_ros.recording import BagWriter
from armid_ros.recording.joint_state.encoder import joint_state_cdr
rate, seconds = 3000, 2.0
now = [0.0]
writer = BagWriter(sys.argv[1], clock=lambda: now[0])
writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
values = [[0.1] * 7]
joints = [f'joint_{i}' for i in range(7)]
for number in range(int(rate * seconds)):
    now[0] = number / rate
    stamp = 10**9 + round(now[0] * 1e9)
    (message,) = joint_state_cdr(joints, [stamp], values, values, values)
    writer.write('/joint_states', message.tobytes(), stamp)
print('written', flush=True)
sys.stdin.read()
"""


def test_a_kill_loses_less_than_0_3_s_at_3_khz(tmp_path):
    bag = tmp_path / 'bag'
    with subprocess.Popen(
        [sys.executable, '-c', KILLED, str(bag)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == 'written\n'
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert process.returncode == -signal.SIGKILL
    assert [file.name for file in bag.iterdir()] == ['bag_0.mcap']
    recording = read_recording(bag, joints=[f'joint_{i}' for i in range(7)])
    lost = 6000 - len(recording)
    assert lost <= DEFAULT_CHUNK_AGE * 3000 <= 0.3 * 3000
    np.testing.assert_allclose(recording.t, np.arange(len(recording)) / 3000, atol=1e-8)
    assert 'index' in recording.report.damage
    assert f'{len(recording)} messages' in recording.report.describe()


def test_a_chunk_leaves_nothing_in_memory(tmp_path):
    """A recorder writes ten chunks a second, for days."""
    with BagWriter(tmp_path / 'bag', clock=lambda: 0.0) as writer:
        writer.add_topic('/joint_states', JOINT_STATE)
        cdr = serialised(['a'], [10**18], [[0.0]], [[0.0]], [[0.0]])[0]

        def chunks(count):
            for _ in range(count):
                writer.write('/joint_states', cdr, 10**18)
                writer.flush()

        chunks(2500)  # Python keeps up to 2000 tuples to use again
        tracemalloc.start()
        chunks(2000)
        kept = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
    assert kept < 2000  # a byte a chunk


def test_a_full_disk_is_reported_and_what_fits_again_is_written(swinging, stamps, tmp_path):
    writer = BagWriter(tmp_path / 'bag', clock=lambda: 0.0)
    writer.add_topic('/joint_states', JOINT_STATE)
    for topic, cdr, time in messages_of(swinging, stamps):
        writer.write(topic, cdr, time)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
    try:
        with pytest.raises(RecordingError, match=r'bag_0.mcap: '):
            writer.flush()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    writer.close()
    recording = read_recording(tmp_path / 'bag', joints=JOINTS)
    assert_same(recording, swinging)
    assert recording.report.clean


def test_the_hash_of_a_type_does_not_depend_on_where_its_definition_is_from():
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in (JOINT_STATE, STRING, 'diagnostic_msgs/msg/DiagnosticArray'):
        text, _ = store.generate_msgdef(name, ros_version=2)
        assert message_type(name, text) == message_type(name)
        assert message_type(name).type_hash == store.hash_rihs01(name)
        assert name in store_for(message_type(name)).types


@pytest.mark.parametrize('end', [RecordingError('disk full'), KeyboardInterrupt()])
def test_a_bag_of_which_all_is_known_is_whole_or_absent(tmp_path, end):
    with pytest.raises(type(end)):
        with atomic_bag(tmp_path / 'bag') as writer:
            writer.add_topic('/chatter', STRING)
            raise end
    assert not (tmp_path / 'bag').exists()
    with atomic_bag(tmp_path / 'bag') as writer:
        writer.add_topic('/chatter', STRING)
    assert (tmp_path / 'bag' / 'metadata.yaml').exists()
