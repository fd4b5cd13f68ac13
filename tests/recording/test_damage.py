# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Nothing damaged passes for data: it is left out, and said; what a killed writer left is read."""

import re
import struct

from armid_ros.errors import RecordingError
from armid_ros.recording import (
    BagWriter,
    copy_bag,
    read_recording,
    read_robot_description,
    ReadSettings,
    topics,
    write_recording,
)
from armid_ros.recording.mcap.contents import walk
from armid_ros.recording.mcap.records import map_file
from armid_ros.recording.message_types import STRING, string_cdr
from armid_ros.recording.metadata import LATCHED
from mcap.records import Chunk, Message
from mcap.stream_reader import breakup_chunk, StreamReader
import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from .conftest import assert_same, iter_raw, JOINTS, messages_of, sqlite_bag, swing


@pytest.fixture(params=['none', 'zstd', 'lz4'])
def bag(request, tmp_path):
    """Return a recording of 300 samples, and its bag of several chunks."""
    recording = swing(300)
    write_recording(tmp_path / 'bag', recording, compression=request.param, chunk_size=10_000)
    return recording, tmp_path / 'bag' / 'bag_0.mcap'


def chunks_of(path):
    return map_file(path.read_bytes(), path).chunks


def change(path, at, value=None):
    """Flip the bits of a byte, or write bytes over it."""
    content = bytearray(path.read_bytes())
    new = bytes([content[at] ^ 0xFF]) if value is None else value
    content[at : at + len(new)] = new
    path.write_bytes(content)


def test_a_damaged_chunk_is_left_out_and_said_with_its_time(bag, tmp_path):
    recording, path = bag
    chunk = chunks_of(path)[2]
    change(path, chunk.end - 40)
    got = read_recording(path, joints=JOINTS)
    begin, end = (
        (time - recording.start_ns) * 1e-9 for time in (chunk.start_time, chunk.end_time)
    )
    assert all(fact in got.report.damage for fact in (f'{begin:.3f}', f'{end:.3f}', '300'))
    left = (recording.t < begin - 1e-6) | (recording.t > end + 1e-6)
    assert 0 < left.sum() < 300
    np.testing.assert_array_equal(got.q, recording.q[left])
    assert len(list(iter_raw(path))) == left.sum()
    report = copy_bag(path, tmp_path / 'out')
    assert report.damage and report.messages == left.sum()
    again = read_recording(tmp_path / 'out', joints=JOINTS)
    np.testing.assert_array_equal(again.tau, recording.tau[left])
    assert again.report.damage == ''


def test_checksums_are_not_compared_for_who_does_not_want_it(tmp_path):
    write_recording(tmp_path / 'bag', swing(300), compression='none')
    path = tmp_path / 'bag' / 'bag_0.mcap'
    change(path, chunks_of(path)[0].end - 40)
    got = read_recording(path, joints=JOINTS, settings=ReadSettings(check_crc=False))
    assert len(got) + got.report.nan == 300


@pytest.mark.parametrize('entry', [-1, 0, 2**63 - 1])
def test_an_index_that_lies_costs_no_message(bag, entry):
    recording, path = bag
    chunk = chunks_of(path)[1]
    (at, count) = chunk.indexes[1]
    change(path, at + 16 * (count // 2) + 8, struct.pack('<q', entry))
    got = read_recording(path, joints=JOINTS)
    np.testing.assert_array_equal(got.q, recording.q)
    assert got.report.clean


def test_a_summary_that_is_damaged_is_not_believed(bag):
    recording, path = bag
    content = path.read_bytes()
    change(path, content.rindex(b'/joint_states') + 3)
    got = read_recording(path, joints=JOINTS)
    assert 'checksum' in got.report.damage
    assert got.topic == '/joint_states'
    np.testing.assert_array_equal(got.q, recording.q)


@pytest.mark.parametrize(
    ('old', 'new', 'facts'),
    [
        ('count: 300', 'count: 310', ('310', '/joint_states', '300')),
        ('name: /joint_states', 'name: /other', ('300', '/other')),
    ],
)
def test_counts_and_topics_of_metadata_are_compared(tmp_path, old, new, facts):
    write_recording(tmp_path / 'bag', swing(300))
    metadata = tmp_path / 'bag' / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace(old, new))
    damage = read_recording(tmp_path / 'bag', joints=JOINTS).report.damage
    assert all(fact in damage for fact in facts)


def test_a_message_of_2_63_bytes_or_less_than_its_head_is_no_message(tmp_path):
    write_recording(tmp_path / 'bag', swing(300), compression='none')
    path = tmp_path / 'bag' / 'bag_0.mcap'
    content = path.read_bytes()
    begin = chunks_of(path)[0].begin
    first = int(walk(content, begin, len(content))[0][0])
    for length in (2**63 - 1, 2**64 - 1, 21, 0):
        change(path, first + 1, struct.pack('<Q', length))
        for check_crc in (True, False):
            settings = ReadSettings(check_crc=check_crc)
            with pytest.raises(RecordingError, match=r'bag_0.mcap'):
                read_recording(path, joints=JOINTS, settings=settings)
    path.write_bytes(content[:8] + b'\x05' + struct.pack('<Q', 10) + bytes(10))
    with pytest.raises(RecordingError, match=r'bag_0.mcap'):
        read_recording(path, joints=JOINTS)


def test_a_message_logged_after_2262_is_left_out_and_said(tmp_path):
    write_recording(tmp_path / 'bag', swing(300), compression='none')
    path = tmp_path / 'bag' / 'bag_0.mcap'
    content = path.read_bytes()
    chunk = chunks_of(path)[0]
    fifth = int(walk(content, chunk.begin, chunk.end)[0][5])
    for field in (15, 23):
        path.write_bytes(content)
        change(path, fifth + field, b'\xff' * 8)
        crc = chunk.begin - 8 - len(chunk.compression) - 8
        change(path, crc, bytes(4))  # no checksum
        report = copy_bag(path, tmp_path / f'out{field}')
        assert report.messages == 299 and '2262' in report.damage
        assert len(read_recording(path, joints=JOINTS)) == 299


@pytest.mark.parametrize('value', ['NULL', "'text'", '3.5', "CAST(x'ff' AS TEXT)"])
@pytest.mark.parametrize('column', ['timestamp', 'data', 'topic_id'])
def test_rows_that_are_no_messages_are_left_out_and_said(
    swinging, stamps, tmp_path, column, value
):
    path = tmp_path / 'bag.db3'
    with sqlite_bag(path, messages_of(swinging, stamps)) as database:
        database.execute(f'UPDATE messages SET {column} = {value} WHERE id = 10')
    got = read_recording(path, joints=JOINTS)
    assert len(got) == len(list(iter_raw(path))) == 499
    assert '1 rows' in got.report.damage


def test_a_view_in_place_of_a_table_is_refused(swinging, stamps, tmp_path):
    path = tmp_path / 'bag.db3'
    with sqlite_bag(path, messages_of(swinging, stamps)) as database:
        database.executescript(
            'DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE n(i) AS '
            '(SELECT 1 UNION ALL SELECT i + 1 FROM n) '
            "SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"
        )
    with pytest.raises(RecordingError, match='rosbag2'):
        read_recording(path, joints=JOINTS)


def chunk_ends(path):
    """Return where each chunk of a file ends, and how many messages there are up to there."""
    ends, counted, count = [], [], 0
    with path.open('rb') as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                count += sum(isinstance(inner, Message) for inner in breakup_chunk(record))
                ends.append(stream.tell())
                counted.append(count)
    return ends, counted


def test_a_file_cut_anywhere_gives_all_samples_before_the_cut(bag, tmp_path):
    recording, path = bag
    content = path.read_bytes()
    ends, counted = chunk_ends(path)
    cut = tmp_path / 'cut.mcap'
    before = 0
    for size in range(ends[0], len(content), len(content) // 61):
        cut.write_bytes(content[:size])
        got = read_recording(cut, joints=JOINTS)
        complete = max(n for end, n in zip(ends, counted, strict=True) if end <= size)
        assert max(before, complete) <= len(got) <= 300
        before = len(got)
        np.testing.assert_array_equal(got.q, recording.q[: len(got)])
        np.testing.assert_array_equal(got.tau, recording.tau[: len(got)])
        assert got.report.damage
        assert len(list(iter_raw(cut))) == len(got)
        assert topics(cut)[0].count == len(got)
    assert before == 300


def test_the_share_of_a_chunk_cut_off_is_the_share_of_its_messages(tmp_path):
    """A chunk that is cut off is read as far as it goes, beyond the last whole record."""
    write_recording(tmp_path / 'bag', swing(6000), compression='zstd', chunk_size=10**9)
    path = tmp_path / 'bag' / 'bag_0.mcap'
    ends, counted = chunk_ends(path)
    largest = int(np.argmax(np.diff(ends))) + 1
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(path.read_bytes()[: (ends[largest - 1] + 2 * ends[largest]) // 3])
    got = read_recording(cut, joints=JOINTS)
    read, of = map(int, re.search(r'(\d+) of (\d+) bytes', got.report.damage).groups())
    inside = counted[largest] - counted[largest - 1]
    assert (len(got) - counted[largest - 1]) / inside == pytest.approx(read / of, abs=0.01)


def test_a_recovered_bag_is_whole(bag, tmp_path):
    recording, path = bag
    content = path.read_bytes()
    cut = tmp_path / 'cut.mcap'
    ends, _ = chunk_ends(path)
    for number, size in enumerate([*ends, ends[0] + 50, ends[-1] - 50, len(content) - 1]):
        cut.write_bytes(content[:size])
        as_read = read_recording(cut, joints=JOINTS)
        out = tmp_path / f'recovered{number}'
        report = copy_bag(cut, out)
        assert cut.read_bytes() == content[:size]
        again = read_recording(out, joints=JOINTS)
        assert_same(again, recording, slice(0, len(as_read)))
        assert again.report.clean
        assert report.messages == len(as_read)
        assert f'/joint_states ({len(as_read)})' in report.describe()
        with Reader(out) as reader:
            assert reader.message_count == len(list(reader.messages())) == len(as_read)


def test_recovery_keeps_types_qos_and_times(swinging, stamps, tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/robot_description', STRING, qos=[LATCHED])
        writer.write('/robot_description', string_cdr('<robot/>'), 5000, 4000)
        writer.add_topic(
            '/own', 'my_msgs/msg/Own', definition='float64 x', type_hash='RIHS01_something'
        )
        writer.write('/own', bytes(12), 6000, 5500)
        path = writer.file
    report = copy_bag(path, tmp_path / 'out')
    assert list(iter_raw(tmp_path / 'out')) == list(iter_raw(tmp_path / 'bag'))
    assert topics(tmp_path / 'out') == topics(tmp_path / 'bag')
    assert read_robot_description(tmp_path / 'out') == '<robot/>'
    assert 'not damaged' in report.describe()
    assert copy_bag(tmp_path / 'bag', tmp_path / 'again').messages == 2


def test_recovery_refuses_what_it_cannot_do(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    with BagWriter(tmp_path / 'empty') as writer:
        writer.add_topic('/chatter', STRING)
    (tmp_path / 'run.bag').write_text('no bag of ROS 1')
    for source, out, fact in (
        (tmp_path / 'bag' / 'bag_0.mcap', tmp_path / 'bag', 'bag: '),
        (tmp_path / 'run.bag', tmp_path / 'out', r'run\.bag: '),
        (tmp_path / 'absent', tmp_path / 'out', 'absent: '),
        (tmp_path, tmp_path / 'out', '.mcap'),
        (writer.file, tmp_path / 'out', 'empty_0.mcap: '),
    ):
        with pytest.raises(RecordingError, match=fact):
            copy_bag(source, out)
    assert not (tmp_path / 'out').exists()
