# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged bags: what is read of them is what was recorded, or it is said."""

import shutil
import struct
import zlib

from armid_ros.recording import read_recording, ReadSettings, write_recording
from armid_ros.recording.compression import decompressed
from armid_ros.recording.mcap.records import map_file
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.source import DEFAULT
from hypothesis import given
from hypothesis import strategies as st
import lz4.frame
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
import yaml
import zstandard

from tests.fuzz.mutants import (
    BYTE_EDIT,
    edited_bytes,
    edited_records,
    edited_text,
    edited_tree,
    INTEGERS,
    PLACE,
    RECORD_EDIT,
    TEXT_EDIT,
    to_yaml,
    TREE_EDIT,
)
from tests.fuzz.property import judge
from tests.recording.conftest import iter_raw, swing

JOINTS = ('shoulder', 'elbow')
SETTINGS = ReadSettings(memory_limit=200_000_000)
SAMPLES = 60
COMPRESSIONS = ('none', 'zstd', 'lz4')
WHOLE = swing(SAMPLES, JOINTS)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with a bag of each compression and a database of the same recording."""
    folder = tmp_path_factory.mktemp('fuzz')
    for compression in COMPRESSIONS:
        write_recording(folder / compression, WHOLE, compression=compression, chunk_size=4000)
    with Writer(folder / 'bag', version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        store = get_typestore(Stores.ROS2_JAZZY)
        topic = writer.add_connection('/joint_states', JOINT_STATE, typestore=store)
        for message in iter_raw(folder / 'none'):
            writer.write(topic, message.log_time_ns, message.cdr)
    (folder / 'work').mkdir()
    return folder


@pytest.fixture
def database(folder):
    """Return a bag of a database that is changed again and again."""
    return shutil.copytree(folder / 'bag', folder / 'work' / 'bag', dirs_exist_ok=True)


def read(path):
    """Read a bag in both ways."""
    recording = read_recording(path, joints=JOINTS, settings=SETTINGS)
    count = sum(1 for _ in iter_raw(path))
    return recording, count


def agrees(answer, whole):
    """Compare a recording with the undamaged one."""
    recording, _ = answer
    assert np.isfinite(recording.q).all()
    assert (np.diff(recording.t) > 0).all()
    same = (
        len(recording) == len(whole)
        and recording.start_ns == whole.start_ns
        and all(
            getattr(recording, name) is not None
            and np.array_equal(getattr(recording, name), getattr(whole, name))
            for name in ('q', 'dq', 'tau')
        )
    )
    if same:
        return 'same'
    return 'said' if not recording.report.clean else 'other numbers without a word'


def any_answer(answer, whole):
    """Accept what cannot be told from another file that is whole."""
    verdict = agrees(answer, whole)
    return verdict if verdict in ('same', 'said') else 'other'


def fewer_are_said(answer, whole):
    """Accept other numbers, of which there is no checksum, but not fewer."""
    verdict = any_answer(answer, whole)
    if verdict == 'other' and len(answer[0]) < len(whole):
        return f'{len(answer[0])} samples without a word'
    return verdict


@given(
    compression=st.sampled_from(COMPRESSIONS),
    edits=st.one_of(
        st.lists(BYTE_EDIT, min_size=1, max_size=4).map(lambda e: (edited_bytes, e)),
        st.lists(RECORD_EDIT, min_size=1, max_size=3).map(lambda e: (edited_records, e)),
    ),
)
def test_mcap(folder, compression, edits):
    content = (folder / compression / f'{compression}_0.mcap').read_bytes()
    path = folder / 'work' / 'mutant.mcap'
    edit, what = edits
    path.write_bytes(edit(content, what))
    judge(read, path, WHOLE, agrees)


FIELD = st.tuples(PLACE, PLACE, st.sampled_from(INTEGERS), st.sampled_from([1, 2, 4, 8]))


@given(compression=st.sampled_from(COMPRESSIONS), fields=st.lists(FIELD, min_size=1, max_size=4))
def test_mcap_chunks_with_right_checksums(folder, compression, fields):
    path = folder / compression / f'{compression}_0.mcap'
    content = path.read_bytes()
    chunk = map_file(content, path).chunks[1]
    stored = content[chunk.begin : chunk.end]
    plain = bytearray(
        decompressed(stored, chunk.compression, chunk.size, DEFAULT)
        if chunk.compression
        else stored
    )
    for message, place, value, width in fields:
        at = min(int(message * len(plain)) + int(place * 40), len(plain) - width)
        plain[at : at + width] = (value & (2 ** (8 * width) - 1)).to_bytes(width, 'little')
    packed = {'none': bytes, 'zstd': zstandard.compress, 'lz4': lz4.frame.compress}[compression](
        plain
    )
    name = chunk.compression.encode()
    head = struct.pack(
        f'<QQQII{len(name)}sQ',
        chunk.start_time, chunk.end_time, len(plain), zlib.crc32(plain),
        len(name), name, len(packed),
    )  # fmt: skip
    begin = chunk.begin - len(head) - 9
    mutant = folder / 'work' / 'chunk.mcap'
    record = b'\x06' + struct.pack('<Q', len(head) + len(packed)) + head + packed
    mutant.write_bytes(content[:begin] + record + content[chunk.end :])
    judge(read, mutant, WHOLE, any_answer)


@given(edits=st.lists(BYTE_EDIT, min_size=1, max_size=4), head=st.booleans())
def test_sqlite_bytes(folder, database, edits, head):
    content = (folder / 'bag' / 'bag.db3').read_bytes()
    size = 4096 * 6 if head else len(content)
    mutant = edited_bytes(content[:size], edits) + content[size:]
    (database / 'bag.db3').write_bytes(mutant)
    judge(read, database, WHOLE, fewer_are_said)


@given(
    edits=st.one_of(
        st.lists(TEXT_EDIT, min_size=1, max_size=3).map(lambda e: (edited_text, e)),
        st.lists(TREE_EDIT, min_size=1, max_size=3).map(lambda e: (edited_tree, e)),
    )
)
def test_metadata(folder, edits):
    bag = folder / 'work' / 'described'
    bag.mkdir(exist_ok=True)
    (bag / 'zstd_0.mcap').write_bytes((folder / 'zstd' / 'zstd_0.mcap').read_bytes())
    text = (folder / 'zstd' / 'metadata.yaml').read_text()
    edit, what = edits
    mutant = edit(text, what) if edit is edited_text else to_yaml(edit(yaml.safe_load(text), what))
    (bag / 'metadata.yaml').write_text(mutant, errors='surrogatepass')
    judge(read, bag, WHOLE, agrees)
