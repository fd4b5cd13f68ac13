# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decompress chunks of an MCAP file, and compare their checksums."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
import mmap
import os
from typing import NamedTuple
import zlib

from armid_ros.errors import RecordingError
from armid_ros.recording.compression import CORRUPT, decompressed, partly_decompressed, stated_size
from armid_ros.recording.mcap.records import Chunk, FileMap
from armid_ros.recording.source import ReadSettings

_COMPRESSIONS = ('', 'zstd', 'lz4')
#: Threads that decompress chunks ahead of the reader. Decompression and checksums release the GIL.
_THREADS = 2
#: Size that a thread decompresses at a time, and limit of decompressed data ahead of the reader
#: [bytes]. A larger chunk is decompressed alone.
_AT_A_TIME, _AHEAD = 2 << 20, 16 << 20


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
        if sum(one.size for one in parts[-1]) >= _AT_A_TIME:
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
