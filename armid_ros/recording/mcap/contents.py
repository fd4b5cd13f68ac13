# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decompress chunks of an MCAP file, compare their checksums, and find messages in them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
import mmap
import os
import struct
from typing import NamedTuple
import zlib

from armid_ros.errors import RecordingError
from armid_ros.recording.compression import CORRUPT, decompressed, partly_decompressed, stated_size
from armid_ros.recording.mcap.records import Chunk, FileMap, MESSAGE, MESSAGE_HEADER, RECORD_HEADER
from armid_ros.recording.source import (
    BLOCK_MESSAGES,
    IntArray,
    MessageBlock,
    ReadSettings,
    records_at,
)
from mcap.opcode import Opcode
import numpy as np
import numpy.typing as npt

_COMPRESSIONS = ('', 'zstd', 'lz4')
#: Threads that decompress chunks ahead of the reader. Decompression and checksums release the GIL.
_THREADS = 2
#: Limit of decompressed data ahead of the reader [bytes]. A larger chunk is decompressed alone.
_AHEAD = 16 << 20


class Content(NamedTuple):
    """Content of a chunk: a buffer, and the range in it."""

    data: bytes | mmap.mmap
    begin: int
    end: int


def contents(
    found: FileMap, chunks: Iterable[Chunk], settings: ReadSettings
) -> Iterator[tuple[Chunk, Content]]:
    """
    Yield the contents of some chunks of a file in their order, without damaged chunks.

    Damaged chunks are noted in the damage of the file.

    Raises
    ------
    RecordingError
        A chunk takes more memory than the settings allow.

    """
    chunks = list(chunks)
    # Either all chunks of a writer have checksums, or none.
    check = settings.check_crc and any(chunk.crc for chunk in found.chunks)
    if any(chunk.compression for chunk in chunks):
        pieces = _unpacked_ahead(found, chunks, settings, check)
    else:  # checksums of small chunks are faster without threads
        pieces = ((chunk, _checked(found, chunk, settings, check)) for chunk in chunks)
    for chunk, content in pieces:
        if isinstance(content, Content):
            yield chunk, content
        else:
            found.damage.add(f'{content}: messages {found.span(chunk)} are left out')


def _unpacked_ahead(
    found: FileMap, chunks: Sequence[Chunk], settings: ReadSettings, check: bool
) -> Iterator[tuple[Chunk, Content | str]]:
    """Yield contents that threads decompress ahead of the reader."""

    def unpack(part: Sequence[Chunk]) -> list[tuple[Chunk, Content | str]]:
        return [(chunk, _checked(found, chunk, settings, check)) for chunk in part]

    parts: list[list[Chunk]] = [[]]
    for chunk in chunks:
        if sum(one.size for one in parts[-1]) >= 2 << 20:  # bytes at a time
            parts.append([])
        parts[-1].append(chunk)
    begun: deque[tuple[int, Future[list[tuple[Chunk, Content | str]]]]] = deque()
    with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1)) as threads:
        for part in parts:
            size = sum(chunk.size for chunk in part)
            while begun and (sum(s for s, _ in begun) + size > _AHEAD or len(begun) > _THREADS):
                yield from begun.popleft()[1].result()
            begun.append((size, threads.submit(unpack, part)))
        while begun:
            yield from begun.popleft()[1].result()


def _checked(found: FileMap, chunk: Chunk, settings: ReadSettings, check: bool) -> Content | str:
    """Return the content of a chunk, or its error as a text."""
    where = f'{chunk.compression} chunk' if chunk.compression else 'chunk'
    where = f'the {where} at byte {chunk.begin}'
    if chunk.compression not in _COMPRESSIONS:
        return f"{where} is compressed with '{chunk.compression}'; zstd and lz4 can be read"
    stored = memoryview(found.data)[chunk.begin : chunk.end]
    if not chunk.whole:
        if chunk.compression:
            most = min(chunk.size, settings.memory_limit)
            part = partly_decompressed(stored, chunk.compression, most)
            content = Content(part, 0, len(part))
        else:
            end = min(chunk.end, chunk.begin + chunk.size)
            content = Content(found.data, chunk.begin, end)
        read = content.end - content.begin
        share = 100 * read // max(chunk.size, 1)
        found.damage.add(
            f'of the chunk that begins there {read} of {chunk.size} bytes ({share} %) are read'
        )
        return content
    if not chunk.compression:
        if len(stored) != chunk.size:
            return f'{where} is damaged'
        content = Content(found.data, chunk.begin, chunk.end)
    else:
        try:
            stated = stated_size(stored, chunk.compression)
            if stated is None or stated == chunk.size:
                settings.require(chunk.size, where)
        except CORRUPT as error:
            return f'{where} is damaged: {error}'
        try:
            whole = decompressed(stored, chunk.compression, chunk.size)
        except RecordingError as error:
            return f'{where} is damaged: {error}'
        content = Content(whole, 0, len(whole))
    data = memoryview(content.data)[content.begin : content.end]
    if check and zlib.crc32(data) != chunk.crc:
        return f'the checksum of the chunk at byte {chunk.begin} is wrong'
    return content


class Gathered:
    """Collects messages of chunks for a block."""

    def __init__(self, data: bytes | mmap.mmap) -> None:
        self._file = data
        self._parts: list[bytes] = []
        self._offsets: list[IntArray] = []
        self._size = self._count = 0

    def add(self, content: bytes | mmap.mmap, offsets: IntArray) -> Iterator[MessageBlock]:
        """Add messages of a decompressed content, or of the file itself."""
        own = isinstance(content, bytes) and content is not self._file
        if own != bool(self._parts):
            yield from self.flush()
        if own:
            self._parts.append(bytes(content))
            self._offsets.append(offsets + self._size)
            self._size += len(content)
        else:
            self._offsets.append(offsets)
        self._count += len(offsets)
        # small blocks are slow in array code, and large blocks exceed the processor cache
        if self._size > (1 << 20) or (not own and self._count > BLOCK_MESSAGES):
            yield from self.flush()

    def flush(self) -> Iterator[MessageBlock]:
        """Yield the added messages, if any."""
        data = self._parts[0] if len(self._parts) == 1 else b''.join(self._parts)
        if self._count:
            yield message_block(data if self._parts else self._file, np.concatenate(self._offsets))
        self._parts, self._offsets, self._size, self._count = [], [], 0, 0


def heads(data: bytes | mmap.mmap, offsets: IntArray) -> npt.NDArray[np.void]:
    """Return the heads of the messages at given record positions, as `MESSAGE`."""
    return records_at(data, offsets, MESSAGE.itemsize).view(MESSAGE)


def message_block(data: bytes | mmap.mmap, offsets: IntArray) -> MessageBlock:
    """Return the messages at given record positions."""
    rows = heads(data, offsets)
    return MessageBlock(
        data,
        offsets + MESSAGE.itemsize,
        rows['length'].astype(np.int64) - MESSAGE_HEADER,
        rows['log_time'].astype(np.int64),
        rows['publish_time'].astype(np.int64),
    )


def tiled(
    data: bytes | mmap.mmap, offsets: IntArray, begin: int, end: int
) -> npt.NDArray[np.void] | None:
    """
    Return the heads of messages if the index of the chunk is complete and correct.

    The index is correct if messages and definitions fill the chunk without gaps: each record
    begins at the end of the previous one.

    Parameters
    ----------
    data : bytes or mmap
        Buffer with the content.
    offsets : ndarray, shape (N,)
        Begin of each message by the index, in ascending order.
    begin, end : int
        Range of the content in the buffer.

    Returns
    -------
    ndarray of `MESSAGE`, shape (N,), or None
        None if the index is wrong.

    """
    if not len(offsets) or offsets[0] < begin or offsets[-1] + MESSAGE.itemsize > end:
        return None
    rows = heads(data, offsets)
    lengths = rows['length'].astype(np.uint64)
    if (rows['opcode'] != Opcode.MESSAGE).any():
        return None
    if lengths.min() < MESSAGE_HEADER or lengths.max() > end - begin:
        return None
    ends = offsets + RECORD_HEADER + lengths.astype(np.int64)
    gaps = np.flatnonzero(ends[:-1] != offsets[1:])
    around = [(begin, int(offsets[0])), (int(ends[-1]), end)]
    between = zip(ends[gaps].tolist(), offsets[gaps + 1].tolist(), strict=True)
    for start, stop in (*around, *between):
        if start > stop:
            return None
        if start < stop:  # only schemas and channels may lie between messages
            messages, _, position = walk(data, start, stop)
            if position != stop or len(messages):
                return None
    return rows


def walk(
    content: bytes | mmap.mmap, begin: int = 0, end: int | None = None
) -> tuple[IntArray, list[tuple[int, int, int]], int]:
    """
    Find the records in the content of a chunk, one by one.

    Parameters
    ----------
    content : bytes or mmap
        Buffer with the content.
    begin, end : int
        Range of the content in the buffer; the whole buffer by default.

    Returns
    -------
    offsets : ndarray, shape (N,)
        Begin of each message.
    definitions : list of (int, int, int)
        Opcode, beginning and end of schemas and channels.
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
