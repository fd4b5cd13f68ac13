# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Files whose writer was killed: read as far as they go, and made whole."""

import re

from armid_ros.errors import RecordingError
from armid_ros.recording import (
    BagWriter,
    LATCHED,
    read_recording,
    read_robot_description,
    recover,
    string_cdr,
    topics,
    write_recording,
)
from armid_ros.recording.message_types import STRING
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import breakup_chunk, StreamReader
import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from .conftest import iter_raw, JOINTS


@pytest.fixture(params=['zstd', 'lz4', 'none'])
def whole(request, make_swing, tmp_path):
    """Return a recording of 300 samples, and its file."""
    recording = make_swing(300)
    write_recording(tmp_path / 'whole', recording, compression=request.param, chunk_size=10_000)
    path = tmp_path / 'whole' / 'whole_0.mcap'
    return recording, path


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


def test_a_file_cut_anywhere_gives_all_samples_before_the_cut(whole, tmp_path):
    recording, path = whole
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


def test_the_share_of_a_chunk_cut_off_is_the_share_of_its_messages(make_swing, tmp_path):
    """A chunk that is cut off is read as far as it goes, beyond the last whole record."""
    write_recording(tmp_path / 'bag', make_swing(6000), compression='zstd', chunk_size=10**9)
    path = tmp_path / 'bag' / 'bag_0.mcap'
    ends, counted = chunk_ends(path)
    largest = int(np.argmax(np.diff(ends))) + 1
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(path.read_bytes()[: (ends[largest - 1] + 2 * ends[largest]) // 3])
    got = read_recording(cut, joints=JOINTS)
    read, of = map(int, re.search(r'(\d+) of (\d+) bytes', got.report.damage).groups())
    inside = counted[largest] - counted[largest - 1]
    assert (len(got) - counted[largest - 1]) / inside == pytest.approx(read / of, abs=0.01)


def test_a_recovered_bag_is_whole_for_every_reader(whole, tmp_path, assert_same):
    recording, path = whole
    content = path.read_bytes()
    cut = tmp_path / 'cut.mcap'
    ends, _ = chunk_ends(path)
    for number, size in enumerate([*ends, ends[0] + 50, ends[-1] - 50, len(content) - 1]):
        cut.write_bytes(content[:size])
        as_read = read_recording(cut, joints=JOINTS)
        bag = tmp_path / f'recovered{number}'
        report = recover(cut, bag)
        assert cut.read_bytes() == content[:size]
        again = read_recording(bag, joints=JOINTS)
        assert_same(again, recording, slice(0, len(as_read)))
        assert again.report.clean
        assert report.messages == len(as_read)
        assert f'/joint_states ({len(as_read)})' in report.describe()
        with Reader(bag) as reader:
            assert reader.message_count == len(list(reader.messages())) == len(as_read)
        with (bag / f'recovered{number}_0.mcap').open('rb') as stream:
            assert len(list(make_reader(stream, validate_crcs=True).iter_messages())) == len(
                as_read
            )


def test_recovery_keeps_types_qos_and_times(swinging, stamps, messages_of, tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/robot_description', STRING, qos=[LATCHED])
        writer.write('/robot_description', string_cdr('<robot/>'), 5000, 4000)
        writer.add_topic(
            '/own', 'my_msgs/msg/Own', definition='float64 x', type_hash='RIHS01_something'
        )
        writer.write('/own', bytes(12), 6000, 5500)
        path = writer.file
    report = recover(path, tmp_path / 'out')
    assert list(iter_raw(tmp_path / 'out')) == list(iter_raw(tmp_path / 'bag'))
    assert topics(tmp_path / 'out') == topics(tmp_path / 'bag')
    assert read_robot_description(tmp_path / 'out') == '<robot/>'
    assert 'whole' in report.describe()
    assert recover(tmp_path / 'bag', tmp_path / 'again').messages == 2


def test_recovery_refuses_what_it_cannot_do(swinging, tmp_path):
    write_recording(tmp_path / 'bag', swinging)
    with BagWriter(tmp_path / 'empty') as writer:
        writer.add_topic('/chatter', STRING)
    for source, out, fact in (
        (tmp_path / 'bag' / 'bag_0.mcap', tmp_path / 'bag', 'bag: '),
        (tmp_path / 'absent', tmp_path / 'out', 'absent: '),
        (tmp_path, tmp_path / 'out', '.mcap'),
        (writer.file, tmp_path / 'out', 'empty_0.mcap: '),
    ):
        with pytest.raises(RecordingError, match=fact):
            recover(source, out)
    assert not (tmp_path / 'out').exists()
