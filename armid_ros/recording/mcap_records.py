# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The records of an MCAP file, found without its index.

An MCAP file is a sequence of records, each an opcode, a length and a content; messages are as a
rule inside chunks, and after each chunk come the offsets of its messages. Walking from the start
finds everything, whether or not the writer lived to write the summary at the end.
Specification: https://mcap.dev/spec

"""

from __future__ import annotations

from dataclasses import dataclass, field
from io import BytesIO
import mmap
from pathlib import Path
import struct

from armid_ros.errors import RecordingError
import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, Schema, Statistics
import numpy as np
import zstandard

MAGIC = b'\x89MCAP0\r\n'
RECORD_HEADER = 9
# A message record up to its data.
MESSAGE = np.dtype(
    {
        'names': ['opcode', 'length', 'channel', 'log_time', 'publish_time'],
        'formats': ['u1', '<u8', '<u2', '<i8', '<i8'],
        'offsets': [0, 1, 9, 15, 23],
        'itemsize': 31,
    }
)
_CHUNK_HEADER = struct.Struct('<QQQII')


@dataclass(frozen=True)
class Chunk:
    """
    Where a chunk is in its file.

    Attributes
    ----------
    start_time, end_time : int
        Range of the log times in it [ns].
    compression : str
        'zstd', 'lz4' or empty.
    size : int
        Bytes of its content once decompressed.
    crc : int
        CRC-32 of the content, 0 if the writer left it out.
    begin, end : int
        Where its content, as stored, begins and ends in the file.
    whole : bool
        False for the last chunk of a file that ends within it.
    indexes : dict
        Where the offsets of a channel's messages are in the file, and how many.

    """

    start_time: int
    end_time: int
    compression: str
    size: int
    crc: int
    begin: int
    end: int
    whole: bool = True
    indexes: dict[int, tuple[int, int]] = field(default_factory=dict)


@dataclass
class FileMap:
    """
    What a walk over the records of a file found.

    Attributes
    ----------
    data : mmap or bytes
        The file.
    chunks : list of Chunk
        Its chunks, in order.
    loose : list of (int, int)
        Beginning and end of messages outside chunks: channel, sequence, times, then the CDR.
    schemas, channels : dict
        Those met outside chunks, which in a finished file are all.
    statistics : Statistics, optional
        The summary's.
    finished : bool
        Whether the file has its footer.
    damage : str
        What is wrong with it; empty for a whole file.

    """

    data: bytes | mmap.mmap
    chunks: list[Chunk] = field(default_factory=list)
    loose: list[tuple[int, int]] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    statistics: Statistics | None = None
    finished: bool = False
    damage: str = ''


def map_file(data: bytes | mmap.mmap, path: Path) -> FileMap:
    """
    Walk over the records of a file.

    Raises
    ------
    RecordingError
        It is no MCAP file.

    """
    if data[: len(MAGIC)] != MAGIC:
        raise RecordingError(f'{path}: not an MCAP file, or its beginning is damaged')
    found = FileMap(data)
    size, position = len(data), len(MAGIC)
    while position + RECORD_HEADER <= size:
        opcode, length = struct.unpack_from('<BQ', data, position)
        begin, end = position + RECORD_HEADER, position + RECORD_HEADER + length
        if end > size or not opcode:
            if opcode == Opcode.CHUNK:
                _add_chunk(found, begin, size, whole=False)
            break
        if opcode == Opcode.CHUNK:
            _add_chunk(found, begin, end)
        elif opcode == Opcode.MESSAGE_INDEX and found.chunks:
            channel, count = struct.unpack_from('<HI', data, begin)
            if length == 6 + count:
                found.chunks[-1].indexes[channel] = (begin + 6, count // 16)
        elif opcode == Opcode.MESSAGE:
            found.loose.append((begin, end))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS):
            add_definition(found, opcode, data[begin:end])
        position = end
        if opcode == Opcode.FOOTER:
            found.finished = data[end : end + len(MAGIC)] == MAGIC
            break
    if not found.finished:
        found.damage = (
            f'the file ends without its index, as after a crash: readable up to byte {position} '
            f'of {size}'
        )
    return found


def add_definition(found: FileMap, opcode: int, content: bytes) -> None:
    """Note a schema, a channel or statistics."""
    stream = ReadDataStream(BytesIO(content))
    try:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            found.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            found.channels[channel.id] = channel
        else:
            found.statistics = Statistics.read(stream)
    except (EndOfFile, struct.error, UnicodeDecodeError) as error:
        found.damage = f'a record of the file is damaged: {error}'


def chunk_content(found: FileMap, chunk: Chunk) -> bytes:
    """
    Return the decompressed content of a chunk; of a chunk cut off, as much as there is.

    Raises
    ------
    RecordingError
        The content is damaged.

    """
    stored = memoryview(found.data)[chunk.begin : chunk.end]
    try:
        if not chunk.whole:
            return _partial_content(stored, chunk.compression)
        if chunk.compression == 'zstd':
            return zstandard.ZstdDecompressor().decompress(stored, max_output_size=chunk.size)
        if chunk.compression == 'lz4':
            return bytes(lz4.frame.decompress(stored))
    except (zstandard.ZstdError, RuntimeError, MemoryError, OverflowError) as error:
        raise RecordingError(
            f'a {chunk.compression} chunk at byte {chunk.begin} is damaged: {error}'
        ) from error
    if chunk.compression:
        raise RecordingError(
            f"a chunk is compressed with '{chunk.compression}'; zstd and lz4 can be read"
        )
    return bytes(stored)


def _partial_content(stored: memoryview, compression: str) -> bytes:
    """Decompress as far as possible; compressors write blocks that stand on their own."""
    if compression == 'zstd':
        decompressor = zstandard.ZstdDecompressor().decompressobj()
    elif compression == 'lz4':
        decompressor = lz4.frame.LZ4FrameDecompressor()
    else:
        return bytes(stored)
    content = bytearray()
    try:
        for at in range(0, len(stored), 1024):
            content += decompressor.decompress(bytes(stored[at : at + 1024]))
    except (zstandard.ZstdError, RuntimeError):
        pass
    return bytes(content)


def _add_chunk(found: FileMap, begin: int, end: int, *, whole: bool = True) -> None:
    """Note a chunk, unless the file ends within its head."""
    data = found.data
    if end - begin < _CHUNK_HEADER.size:
        return
    start_time, end_time, size, crc, name = _CHUNK_HEADER.unpack_from(data, begin)
    position = begin + _CHUNK_HEADER.size
    if name > 64 or position + name + 8 > end:
        return
    compression = data[position : position + name].decode('ascii', 'replace')
    content = position + name + 8
    (stored,) = struct.unpack_from('<Q', data, content - 8)
    if whole and content + stored != end:
        found.damage = f'the chunk at byte {begin} is damaged'
        return
    found.chunks.append(
        Chunk(start_time, end_time, compression, size, crc, content, end, whole=whole)
    )
