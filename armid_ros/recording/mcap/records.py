# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Find the chunks, loose messages and definitions of an MCAP file without its index.

An MCAP file is a sequence of records, each with opcode, length and content. Messages are usually
inside chunks; each chunk is followed by the offsets of its messages. A walk from the start
finds all records, even if the writer was killed before it wrote the summary. Checksums and
counts of the file are checked if possible. Specification: https://mcap.dev/spec

"""

from __future__ import annotations

from dataclasses import dataclass, field
from io import BytesIO
import mmap
from pathlib import Path
import struct
import zlib

from armid_ros.errors import RecordingError
from armid_ros.recording.source import Damage
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema, Statistics
import numpy as np

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
#: Bytes of a message record between its head and its data.
MESSAGE_HEADER = MESSAGE.itemsize - RECORD_HEADER
_CHUNK_HEADER = struct.Struct('<QQQII')
_FOOTER = struct.Struct('<QQI')
_DEFINITIONS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS)


@dataclass(frozen=True)
class Chunk:
    """
    Position, size, time range and checksum of one chunk of an MCAP file.

    Attributes
    ----------
    start_time, end_time : int
        Range of the log times of its messages [ns].
    compression : str
        'zstd', 'lz4' or empty.
    size : int
        Size of the decompressed content [bytes].
    crc : int
        CRC-32 of the content; 0 if the writer did not compute it.
    begin, end : int
        Range of the stored content in the file [bytes].
    complete : bool
        Whether the chunk is complete; False if the file ends inside the chunk.
    indexes : dict
        Position and number of the message offsets of each channel.

    """

    start_time: int
    end_time: int
    compression: str
    size: int
    crc: int
    begin: int
    end: int
    complete: bool = True
    indexes: dict[int, tuple[int, int]] = field(default_factory=dict)


@dataclass
class FileMap:
    """
    Table of contents of an MCAP file: chunks, other messages, definitions and damage.

    Attributes
    ----------
    data : mmap or bytes
        The file.
    chunks : list of Chunk
        Chunks of the file, in order.
    loose : list of int
        Position of each message record outside chunks.
    schemas, channels : dict
        Definitions outside chunks, by number; in a finished file these are all definitions.
    statistics : Statistics, optional
        Statistics in the summary of the file.
    finished : bool
        Whether the file has a footer and a valid summary.
    damage : Damage
        Damage of the file.

    """

    data: bytes | mmap.mmap
    chunks: list[Chunk] = field(default_factory=list)
    loose: list[int] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    statistics: Statistics | None = None
    finished: bool = False
    damage: Damage = field(default_factory=Damage)

    def span(self, chunk: Chunk) -> str:
        """Return the time range of the messages of a chunk as text, for reports of damage."""
        begin = min((c.start_time for c in self.chunks if c.end_time), default=0)
        start, end = (1e-9 * (time - begin) for time in (chunk.start_time, chunk.end_time))
        return f'from {start:.3f} to {end:.3f} s after the beginning'


def map_file(data: bytes | mmap.mmap, path: Path, *, check: bool = True) -> FileMap:
    """
    Scan an MCAP file; return its chunks, other messages, definitions and damage.

    Parameters
    ----------
    data : mmap or bytes
        The file.
    path : Path
        Name of the file, for error messages.
    check : bool
        Whether to compare checksums of data outside chunks.

    Raises
    ------
    RecordingError
        If the file is not an MCAP file.

    """
    if data[: len(MAGIC)] != MAGIC:
        raise RecordingError(f'{path}: the file is not an MCAP file, or its beginning is damaged')
    found = FileMap(data)
    definitions, data_end, footer, position = _walk(found)
    if not found.finished:
        found.damage.add(
            'the file ends without its index, as after a crash; it can be read up to byte '
            f'{position} of {len(data)}'
        )
    if check and footer is not None:
        start, _, crc = _FOOTER.unpack_from(data, footer)
        end = footer + _FOOTER.size - 4
        right = start <= end and zlib.crc32(memoryview(data)[start:end]) == crc
        if crc and start and not right:
            found.finished = False
            found.damage.add('the checksum of the index at the end is wrong; it is not used')
            definitions = [entry for entry in definitions if entry[1] < start]
    for opcode, begin, end in definitions:
        add_definition(found, opcode, data[begin:end])
    if (
        check
        and data_end is not None
        and found.loose
        and data_end + RECORD_HEADER + 4 <= len(data)
    ):
        (crc,) = struct.unpack_from('<I', data, data_end + RECORD_HEADER)
        if crc and zlib.crc32(memoryview(data)[:data_end]) != crc:
            found.damage.add('the checksum of the file is wrong: any of its messages may be wrong')
    return found


def _walk(found: FileMap) -> tuple[list[tuple[int, int, int]], int | None, int | None, int]:
    """Fill a file map; return definitions, and positions of data end, footer and scan end."""
    data = found.data
    definitions: list[tuple[int, int, int]] = []
    data_end = footer = None
    size, position = len(data), len(MAGIC)
    while position + RECORD_HEADER <= size:
        opcode, length = struct.unpack_from('<BQ', data, position)
        begin, end = position + RECORD_HEADER, position + RECORD_HEADER + length
        # undefined opcodes; higher opcodes are for private use
        if not opcode or 0x10 <= opcode < 0x80:
            break
        if end > size:
            if opcode == Opcode.CHUNK:
                _add_chunk(found, begin, size, complete=False)
            break
        if opcode in (Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.MESSAGE):
            _add_data(found, opcode, begin, end)
        elif opcode in _DEFINITIONS:
            definitions.append((opcode, begin, end))
        elif opcode == Opcode.DATA_END:
            data_end = position
        position = end
        if opcode == Opcode.FOOTER:
            found.finished = data[end : end + len(MAGIC)] == MAGIC
            footer = begin if length == _FOOTER.size else None
            break
    behind = size - position - len(MAGIC)
    if found.finished and behind > 0:
        found.damage.add(
            f'{behind} bytes follow the end of the MCAP file, perhaps of an appended file; '
            f'only the first {position + len(MAGIC)} bytes are read, so cut the file there'
        )
    return definitions, data_end, footer, position


def add_definition(found: FileMap, opcode: int, content: bytes) -> None:
    """Add a schema, a channel or statistics to the map of a file."""
    stream = ReadDataStream(BytesIO(content))
    try:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            found.schemas.setdefault(schema.id, schema)
            same = found.schemas[schema.id] == schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            found.channels.setdefault(channel.id, channel)
            same = found.channels[channel.id] == channel
        else:
            found.statistics, same = Statistics.read(stream), True
    except (McapError, ArithmeticError, MemoryError, ValueError, struct.error) as error:
        found.damage.add(f'a record of the file is damaged: {error}')
        return
    if not same:
        found.damage.add('the file has two definitions of one channel; the first is used')


def _add_chunk(found: FileMap, begin: int, end: int, *, complete: bool = True) -> None:
    """Add a chunk to the map of a file, unless the file ends within the header of the chunk."""
    data = found.data
    if end - begin < _CHUNK_HEADER.size:
        return
    start_time, end_time, size, crc, name = _CHUNK_HEADER.unpack_from(data, begin)
    position = begin + _CHUNK_HEADER.size
    if name > 64 or position + name + 8 > end:
        found.damage.add(f'the chunk at byte {begin} is damaged')
        return
    compression = data[position : position + name].decode('ascii', 'replace')
    content = position + name + 8
    (stored,) = struct.unpack_from('<Q', data, content - 8)
    chunk = Chunk(start_time, end_time, compression, size, crc, content, end, complete=complete)
    if complete and content + stored != end:
        found.damage.add(
            f'the chunk at byte {begin} is damaged, with the messages {found.span(chunk)}'
        )
        return
    found.chunks.append(chunk)


def _add_data(found: FileMap, opcode: int, begin: int, end: int) -> None:
    """Add a chunk, a message index of a chunk, or a message outside chunks to a file map."""
    if opcode == Opcode.CHUNK:
        _add_chunk(found, begin, end)
    elif opcode == Opcode.MESSAGE and end - begin < MESSAGE_HEADER:
        found.damage.add(f'the message at byte {begin} is shorter than the head of a message')
    elif opcode == Opcode.MESSAGE:
        found.loose.append(begin - RECORD_HEADER)
    elif end - begin >= 6 and found.chunks:
        channel, count = struct.unpack_from('<HI', found.data, begin)
        if end - begin == 6 + count:
            found.chunks[-1].indexes[channel] = (begin + 6, count // 16)  # bytes of an entry
