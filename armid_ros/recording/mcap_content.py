# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The messages in the content of MCAP chunks, and their way to blocks for array code."""

from __future__ import annotations

from collections.abc import Iterator
import mmap
import struct

from armid_ros.recording.mcap_records import MESSAGE, RECORD_HEADER
from armid_ros.recording.source import Block, IntArray, records_at
from mcap.opcode import Opcode
import numpy as np

# Chunks are put together to blocks of about this size, for small chunks would leave array code
# little to do at a time, and large blocks fall out of the processor's cache.
_BLOCK_BYTES = 1 << 20
BLOCK_MESSAGES = 4096

_MESSAGE_HEADER = MESSAGE.itemsize - RECORD_HEADER


class Gathered:
    """Messages of chunks on the way to a block."""

    def __init__(self, data: bytes | mmap.mmap) -> None:
        self._file = data
        self._parts: list[bytes] = []
        self._offsets: list[IntArray] = []
        self._size = self._count = 0

    def add(self, content: bytes, offsets: IntArray) -> Iterator[Block]:
        """Add messages of a content of their own."""
        if not self._parts:
            yield from self.flush()
        self._parts.append(content)
        self._offsets.append(offsets + self._size)
        self._size += len(content)
        self._count += len(offsets)
        if self._size > _BLOCK_BYTES:
            yield from self.flush()

    def add_in_place(self, offsets: IntArray) -> Iterator[Block]:
        """Add messages that lie in the file as they are."""
        if self._parts:
            yield from self.flush()
        self._offsets.append(offsets)
        self._count += len(offsets)
        if self._count > BLOCK_MESSAGES:
            yield from self.flush()

    def flush(self) -> Iterator[Block]:
        """Yield what was added, if it is something."""
        data = self._parts[0] if len(self._parts) == 1 else b''.join(self._parts)
        if self._count:
            yield message_block(data if self._parts else self._file, np.concatenate(self._offsets))
        self._parts, self._offsets, self._size, self._count = [], [], 0, 0


def message_block(data: bytes | mmap.mmap, offsets: IntArray) -> Block:
    """Return the messages whose records begin there."""
    rows = records_at(data, offsets, MESSAGE.itemsize).view(MESSAGE)
    return Block(
        data,
        offsets + MESSAGE.itemsize,
        rows['length'].astype(np.int64) - _MESSAGE_HEADER,
        rows['log_time'].astype(np.int64),
        rows['publish_time'].astype(np.int64),
    )


def are_messages(
    data: bytes | mmap.mmap, offsets: IntArray, channels: list[int], begin: int, end: int
) -> bool:
    """Tell whether the index of a chunk is to be trusted."""
    if not len(offsets):
        return True
    if offsets[0] < begin or offsets[-1] + MESSAGE.itemsize > end:
        return False
    rows = records_at(data, offsets, MESSAGE.itemsize).view(MESSAGE)
    lengths = rows['length'].astype(np.int64)
    ends = offsets + RECORD_HEADER + lengths
    if len(channels) == 1:
        known = rows['channel'] == channels[0]
    else:
        known = np.isin(rows['channel'], channels)
    return bool(
        (rows['opcode'] == Opcode.MESSAGE).all()
        and known.all()
        and (lengths >= _MESSAGE_HEADER).all()
        and (ends <= end).all()
    )


def walk(content: bytes | mmap.mmap) -> tuple[IntArray, list[tuple[int, int, int]]]:
    """Return where messages begin in a chunk, and its schemas and channels."""
    offsets: list[int] = []
    definitions: list[tuple[int, int, int]] = []
    head = struct.Struct('<BQ')
    position, size = 0, len(content)
    while position + RECORD_HEADER <= size:
        opcode, length = head.unpack_from(content, position)
        end = position + RECORD_HEADER + length
        if end > size:
            break
        if opcode == Opcode.MESSAGE and length >= _MESSAGE_HEADER:
            offsets.append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions.append((opcode, position + RECORD_HEADER, end))
        position = end
    return np.array(offsets, np.int64), definitions
