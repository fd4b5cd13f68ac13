# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find messages in MCAP chunks, and gather them into blocks."""

from __future__ import annotations

from collections.abc import Iterator
import mmap
import struct

from armid_ros.recording.mcap.records import MESSAGE, MESSAGE_HEADER, RECORD_HEADER
from armid_ros.recording.source import BLOCK_MESSAGES, IntArray, MessageBlock, records_at
from mcap.opcode import Opcode
import numpy as np
import numpy.typing as npt


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
