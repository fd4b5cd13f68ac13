# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is unpacked stays within its stated size and within the memory limit, which is named."""

import resource
import struct

from armid_ros.errors import RecordingError
from armid_ros.recording import read_recording, ReadSettings, write_recording
from armid_ros.recording.bag import Bag
from armid_ros.recording.compression import CORRUPT, decompressed
from armid_ros.recording.mcap.records import MAGIC
from armid_ros.recording.source import DEFAULT
import lz4.frame
import pytest
import zstandard

from .conftest import JOINTS, swing

SMALL = ReadSettings(memory_limit=10_000_000)
FAR_TOO_MUCH = 400_000_000


def zeros(size, compression, stated=True):
    """Return a compressed frame of zeros, made a piece at a time."""
    size = size >> 20 << 20
    if compression == 'zstd':
        maker = zstandard.ZstdCompressor().compressobj(size=size if stated else -1)
    else:
        frame = lz4.frame.LZ4FrameCompressor()
        pieces = [frame.begin(source_size=size if stated else 0)]
        pieces += [frame.compress(bytes(1 << 20)) for _ in range(size >> 20)]
        return b''.join([*pieces, frame.flush()])
    pieces = [maker.compress(bytes(1 << 20)) for _ in range(size >> 20)]
    return b''.join([*pieces, maker.flush()])


def chunked(path, compression, stored, size, crc=0):
    """Write a file of one chunk, without a summary."""
    name = compression.encode()
    head = struct.pack(f'<QQQII{len(name)}sQ', 1, 2, size, crc, len(name), name, len(stored))
    record = b'\x06' + struct.pack('<Q', len(head) + len(stored)) + head + stored
    path.write_bytes(MAGIC + record)
    return path


@pytest.fixture
def memory():
    """Return a function that says how much the process has grown since [bytes]."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return lambda: 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)


@pytest.mark.parametrize('compression', ['zstd', 'lz4'])
@pytest.mark.parametrize('frame_says', [True, False])
@pytest.mark.parametrize('chunk_says', [FAR_TOO_MUCH, 1000, 2**62])
def test_a_chunk_that_unpacks_to_hundreds_of_megabytes_is_refused(
    tmp_path, memory, compression, frame_says, chunk_says
):
    size = FAR_TOO_MUCH >> 20 << 20
    stored = zeros(size, compression, frame_says)
    said = size if chunk_says == FAR_TOO_MUCH else chunk_says
    path = chunked(tmp_path / 'bomb.mcap', compression, stored, said)
    with pytest.raises(RecordingError, match=r'bomb.mcap: .*(memory_limit|damaged)') as refusal:
        read_recording(path, joints=JOINTS, settings=SMALL)
    assert ('10 MB' in str(refusal.value)) == (
        said > 10_000_000 and (said == size or not frame_says)
    )
    assert memory() < 100_000_000


def test_a_file_that_unpacks_to_more_than_the_limit_is_refused(tmp_path, memory):
    (tmp_path / 'bomb.mcap.zstd').write_bytes(zeros(FAR_TOO_MUCH, 'zstd'))
    with pytest.raises(RecordingError, match=r'bomb\.mcap\.zstd: .*memory_limit'):
        Bag(tmp_path / 'bomb.mcap.zstd', SMALL)
    assert memory() < 100_000_000


def test_a_recording_that_takes_more_than_the_limit_is_refused(tmp_path):
    write_recording(tmp_path / 'bag', swing(2000), compression='none')
    with pytest.raises(RecordingError, match=r'memory limit.*100 kB'):
        read_recording(
            tmp_path / 'bag', joints=JOINTS, settings=ReadSettings(memory_limit=100_000)
        )
    enough = ReadSettings(memory_limit=2000 * (3 + 3 * 3) * 8)
    assert len(read_recording(tmp_path / 'bag', joints=JOINTS, settings=enough)) == 2000
    with pytest.raises(RecordingError, match='memory_limit'):
        ReadSettings(memory_limit=0)


@pytest.mark.parametrize('compression', ['zstd', 'lz4'])
def test_a_frame_holds_what_it_states(compression):
    content = bytes(range(256)) * 100
    pack = zstandard.ZstdCompressor().compress if compression == 'zstd' else lz4.frame.compress
    stored = pack(content)
    assert decompressed(stored, compression, len(content), DEFAULT) == content
    assert decompressed(pack(b''), compression, 0, DEFAULT) == b''
    for size in (len(content) - 1, len(content) + 1, 0, 2**63):
        with pytest.raises(CORRUPT):
            decompressed(stored, compression, size, DEFAULT)
    for cut in (1, len(stored) // 2, len(stored) - 5):
        with pytest.raises(CORRUPT):
            decompressed(stored[:cut], compression, len(content), DEFAULT)
