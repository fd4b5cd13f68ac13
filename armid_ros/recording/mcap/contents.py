# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decompress the chunks of an MCAP file, compare their checksums, and find their messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
import mmap
import os
import struct
from typing import NamedTuple
import zlib

from armid_ros.recording.compression import CORRUPT, decompressed, partly_decompressed
from armid_ros.recording.mcap.records import Chunk, FileMap, MESSAGE, MESSAGE_HEADER, RECORD_HEADER
from armid_ros.recording.source import IntArray, MessageBlock, ReadSettings, records_at
from mcap.opcode import Opcode
import numpy as np
import numpy.typing as npt


class Contents(NamedTuple):
    """Decompressed chunks in a common buffer, with the byte range of each chunk."""

    data: bytes | mmap.mmap
    parts: list[tuple[Chunk, int, int]]


def read_chunks(
    found: FileMap, chunks: Iterable[Chunk], settings: ReadSettings
) -> Iterator[Contents]:
    """
    Yield the decompressed content of the undamaged chunks of an MCAP file.

    Damaged chunks are left out, and added to the damage of the file.

    Raises
    ------
    RecordingError
        If a chunk needs more memory than the settings allow.

    """
    # writers add checksums to all chunks or to none
    check = settings.check_crc and any(chunk.crc for chunk in found.chunks)
    settings = replace(settings, check_crc=check)
    chunks = list(chunks)
    packed = any(chunk.compression for chunk in chunks)
    # small groups are slow in array code; large ones exceed the processor cache [bytes]
    most = 2 << 20 if packed else 4 << 20
    groups: list[list[Chunk]] = [[]]
    size = 0
    for chunk in chunks:
        if size >= most:
            groups.append([])
            size = 0
        groups[-1].append(chunk)
        size += chunk.size
    if packed:
        results = _read_ahead(found, groups, settings)
    else:  # checksums alone are faster without threads
        results = (_read_group(found, group, settings) for group in groups)
    for contents, damage in results:
        for problem in damage:
            found.damage.add(problem)
        if contents.parts:
            yield contents


def _read_ahead(
    found: FileMap, groups: Sequence[Sequence[Chunk]], settings: ReadSettings
) -> Iterator[tuple[Contents, list[str]]]:
    """Yield contents and damage of groups of chunks; threads read the next groups in advance."""
    begun: deque[tuple[int, Future[tuple[Contents, list[str]]]]] = deque()
    most = 16 << 20  # largest size of data read ahead [bytes]; a larger group is read alone
    yield _read_group(found, groups[0], settings)  # often all that is needed
    # decompression and checksums release the GIL
    with ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as threads:
        for group in groups[1:]:
            size = sum(chunk.size for chunk in group)
            while begun and sum(s for s, _ in begun) + size > most:
                yield begun.popleft()[1].result()
            begun.append((size, threads.submit(_read_group, found, group, settings)))
        while begun:
            yield begun.popleft()[1].result()


def _read_group(
    found: FileMap, group: Sequence[Chunk], settings: ReadSettings
) -> tuple[Contents, list[str]]:
    """Return the contents of undamaged chunks of a group, and messages on damaged chunks."""
    packed = any(chunk.compression for chunk in group)
    contents: list[bytes | memoryview] = []
    parts: list[tuple[Chunk, int, int]] = []
    damage: list[str] = []
    end = 0
    for chunk in group:
        try:
            content = _content(found, chunk, settings)
        except CORRUPT as error:
            damage.append(
                f'the chunk at byte {chunk.begin} is damaged ({error}), so messages '
                f'{found.span(chunk)} are left out'
            )
            continue
        if not chunk.complete:
            share = 100 * len(content) // max(chunk.size, 1)
            damage.append(
                f'{len(content)} of {chunk.size} bytes ({share} %) of the last chunk can be read'
            )
        begin = end if packed else chunk.begin
        end = begin + len(content)
        contents.append(content)
        parts.append((chunk, begin, end))
    return Contents(b''.join(contents) if packed else found.data, parts), damage


def _content(found: FileMap, chunk: Chunk, settings: ReadSettings) -> bytes | memoryview:
    """Return the decompressed content of a chunk; raise an error of CORRUPT if it is damaged."""
    stored = memoryview(found.data)[chunk.begin : chunk.end]
    if chunk.compression not in ('', 'zstd', 'lz4'):
        raise ValueError(
            f"the compression '{chunk.compression}' of the chunk is not supported; use zstd or lz4"
        )
    if not chunk.complete:
        most = min(chunk.size, settings.memory_limit)
        if chunk.compression:
            return partly_decompressed(stored, chunk.compression, most)
        return stored[:most]
    if chunk.compression:
        content: bytes | memoryview = decompressed(stored, chunk.compression, chunk.size, settings)
    elif len(stored) != chunk.size:
        raise ValueError(f'the damaged chunk has {len(stored)} bytes instead of {chunk.size}')
    else:
        content = stored
    if settings.check_crc and zlib.crc32(content) != chunk.crc:
        raise ValueError('the checksum of the chunk is wrong')
    return content


def heads(data: bytes | mmap.mmap, offsets: IntArray) -> npt.NDArray[np.void]:
    """Return the header fields of the messages at given byte positions."""
    return records_at(data, offsets, MESSAGE.itemsize).view(MESSAGE)


def message_block(data: bytes | mmap.mmap, offsets: IntArray) -> MessageBlock:
    """Return the messages at given byte positions of a buffer as a block."""
    rows = heads(data, offsets)
    return MessageBlock(
        data,
        offsets + MESSAGE.itemsize,
        rows['length'].astype(np.int64) - MESSAGE_HEADER,
        rows['log_time'].astype(np.int64),
        rows['publish_time'].astype(np.int64),
    )


def messages_in(found: FileMap, contents: Contents) -> tuple[IntArray, npt.NDArray[np.void]]:
    """Return byte positions and header fields of all messages in the given contents."""
    data, parts = contents  # a correct index is faster than a walk over the records
    ranges = np.array([(begin, end) for _, begin, end in parts], np.int64)
    if all(chunk.indexes and chunk.complete for chunk, _, _ in parts):
        # offsets beyond a chunk are set to its end, where no message can begin
        listed = [
            np.minimum(np.frombuffer(found.data, '<u8', 2 * count, at)[1::2], chunk.size).astype(
                np.int64
            )
            + begin
            for chunk, begin, _ in parts
            for at, count in chunk.indexes.values()
        ]
        offsets = np.concatenate(listed)
        if not (np.diff(offsets) > 0).all():
            offsets.sort(kind='stable')
        rows = _heads_by_index(data, offsets, ranges)
        if rows is not None:
            return offsets, rows
    walked = []
    for chunk, begin, end in parts:
        some, _, position = walk(data, begin, end)
        walked.append(some)
        if chunk.complete and position != end:
            found.damage.add(
                f'the chunk at byte {chunk.begin} is damaged: '
                f'some messages {found.span(chunk)} are lost'
            )
    offsets = np.concatenate(walked)
    return offsets, heads(data, offsets)


def _heads_by_index(
    data: bytes | mmap.mmap, offsets: IntArray, ranges: IntArray
) -> npt.NDArray[np.void] | None:
    """Read message headers at ascending byte positions `offsets`; None if these are wrong."""
    # It is correct if messages and definitions fill each chunk, a row of `ranges`, without gaps.
    begins, ends = ranges.T
    if not len(offsets) or offsets[0] < begins[0] or offsets[-1] + MESSAGE.itemsize > ends[-1]:
        return None
    rows = heads(data, offsets)
    lengths = rows['length'].astype(np.uint64)
    if (rows['opcode'] != Opcode.MESSAGE).any():
        return None
    if lengths.min() < MESSAGE_HEADER or lengths.max() > len(data):
        return None
    behind = offsets + RECORD_HEADER + lengths.astype(np.int64)
    gaps = np.flatnonzero(behind[:-1] != offsets[1:])
    # begins of chunks and ends of messages, begins of messages, ends of chunks, definitions
    starts = np.sort(np.concatenate([begins, behind[gaps], behind[-1:]]))
    stops = np.sort(np.concatenate([offsets[:1], offsets[gaps + 1], ends]))
    if (starts > stops).any():
        return None
    between = starts < stops
    for start, stop in zip(starts[between].tolist(), stops[between].tolist(), strict=True):
        messages, _, position = walk(data, start, stop)
        if position != stop or len(messages):
            return None
    return rows


def walk(
    content: bytes | mmap.mmap, begin: int = 0, end: int | None = None
) -> tuple[IntArray, list[tuple[int, int, int]], int]:
    """
    Find messages and definitions in an MCAP chunk; also return the end of the last record.

    Parameters
    ----------
    content : bytes or mmap
        Buffer with the content.
    begin, end : int
        Range of the content in the buffer; by default the complete buffer.

    Returns
    -------
    offsets : ndarray, shape (N,)
        Position of each message record.
    definitions : list of (int, int, int)
        Opcode, first and last position of each schema and channel record.
    position : int
        End of the last record; less than ``end`` if invalid data follow.

    """
    offsets: list[int] = []
    definitions: list[tuple[int, int, int]] = []
    head = struct.Struct('<BQ')
    position, size = begin, len(content) if end is None else end
    while position + RECORD_HEADER <= size:
        opcode, length = head.unpack_from(content, position)
        stop = position + RECORD_HEADER + length
        if stop > size:
            break
        if opcode == Opcode.MESSAGE and length >= MESSAGE_HEADER:
            offsets.append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions.append((opcode, position + RECORD_HEADER, stop))
        else:  # chunks contain only these records
            break
        position = stop
    return np.array(offsets, np.int64), definitions, position
