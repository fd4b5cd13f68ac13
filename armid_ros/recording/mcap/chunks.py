# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The content of the chunks of an MCAP file: unpacked, and compared with its checksum."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
import mmap
import os
from typing import NamedTuple
import zlib

from armid_ros.errors import RecordingError
from armid_ros.recording.compression import CORRUPT, decompressed, partly_decompressed, stated_size
from armid_ros.recording.mcap.records import Chunk, FileMap
from armid_ros.recording.settings import ReadSettings

_COMPRESSIONS = ('', 'zstd', 'lz4')
#: Threads that unpack ahead of what is read. Decompression and checksums let others run meanwhile.
_THREADS = 2
#: What a thread unpacks at a time, as handing over takes a tenth of what a chunk takes, and what
#: may lie unpacked ahead [bytes]; a larger chunk is unpacked when nothing else is.
_AT_A_TIME, _AHEAD = 2 << 20, 16 << 20


class Content(NamedTuple):
    """What holds the content of a chunk, and where in it."""

    data: bytes | mmap.mmap
    begin: int
    end: int


class Contents:
    """The contents of the chunks of a file; what is wrong with them is noted there."""

    def __init__(self, found: FileMap, settings: ReadSettings) -> None:
        self._found = found
        self._settings = settings
        # A writer makes checksums or does not.
        self._has_crc = settings.check_crc and any(chunk.crc for chunk in found.chunks)

    def of(self, chunks: Iterable[Chunk]) -> Iterator[tuple[Chunk, Content]]:
        """
        Yield the contents of some chunks, in their order, without damaged ones.

        Raises
        ------
        RecordingError
            A chunk takes more memory than the settings allow.

        """
        chunks = list(chunks)
        if not any(chunk.compression for chunk in chunks):
            for chunk in chunks:  # their checksums are quicker than to hand them over
                yield from self._whole(self._all_checked([chunk]))
            return
        begun: deque[tuple[int, Future[list[_Unpacked]]]] = deque()
        size = 0
        with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1)) as threads:
            for part in _parts(chunks):
                more = sum(chunk.size for chunk in part)
                while begun and (size + more > _AHEAD or len(begun) > _THREADS):
                    yield from self._whole(begun[0][1].result())
                    size -= begun.popleft()[0]
                begun.append((more, threads.submit(self._all_checked, part)))
                size += more
            while begun:
                yield from self._whole(begun.popleft()[1].result())

    def _whole(self, unpacked: Iterable[_Unpacked]) -> Iterator[tuple[Chunk, Content]]:
        """Yield the contents that are whole, and note the others."""
        for chunk, content in unpacked:
            if isinstance(content, Content):
                yield chunk, content
            else:
                span = self._found.span(chunk)
                self._found.damage.add(f'{content}: messages {span} are left out')

    def _all_checked(self, chunks: Iterable[Chunk]) -> list[_Unpacked]:
        """Return contents whose checksums are right, and what is wrong with the others."""
        found: list[_Unpacked] = []
        for chunk in chunks:
            try:
                found.append((chunk, self._checked(chunk)))
            except _DamagedChunk as problem:
                found.append((chunk, problem))
        return found

    def _checked(self, chunk: Chunk) -> Content:
        """Return a content whose checksum is right."""
        content = self._unpacked(chunk)
        if chunk.whole and self._has_crc:
            if zlib.crc32(memoryview(content.data)[content.begin : content.end]) != chunk.crc:
                raise _DamagedChunk(f'the checksum of the chunk at byte {chunk.begin} is wrong')
        return content

    def _unpacked(self, chunk: Chunk) -> Content:
        where = f'{chunk.compression} chunk' if chunk.compression else 'chunk'
        where = f'the {where} at byte {chunk.begin}'
        if chunk.compression not in _COMPRESSIONS:
            raise _DamagedChunk(
                f"{where} is compressed with '{chunk.compression}'; zstd and lz4 can be read"
            )
        stored = memoryview(self._found.data)[chunk.begin : chunk.end]
        if not chunk.compression:
            if chunk.whole and len(stored) != chunk.size:
                raise _DamagedChunk(f'{where} is damaged')
            size = min(len(stored), chunk.size)
            self._note_cut(chunk, size)
            return Content(self._found.data, chunk.begin, chunk.begin + size)
        if not chunk.whole:
            size = min(chunk.size, self._settings.memory_limit)
            content = partly_decompressed(stored, chunk.compression, size)
            self._note_cut(chunk, len(content))
            return Content(content, 0, len(content))
        try:
            said = stated_size(stored, chunk.compression)
        except CORRUPT as error:
            raise _DamagedChunk(f'{where} is damaged: {error}') from error
        if said is None or said == chunk.size:
            self._settings.require(chunk.size, where)
        try:
            content = decompressed(stored, chunk.compression, chunk.size)
        except RecordingError as error:
            raise _DamagedChunk(f'{where} is damaged: {error}') from error
        return Content(content, 0, len(content))

    def _note_cut(self, chunk: Chunk, read: int) -> None:
        """Say how much is had of a chunk that the file ends within."""
        if not chunk.whole:
            share = 100 * read // max(chunk.size, 1)
            self._found.damage.add(
                f'of the chunk that begins there {read} of {chunk.size} bytes ({share} %) are read'
            )


def _parts(chunks: Iterable[Chunk]) -> Iterator[list[Chunk]]:
    """Yield chunks in groups that are worth a thread's while."""
    part: list[Chunk] = []
    for chunk in chunks:
        part.append(chunk)
        if sum(one.size for one in part) >= _AT_A_TIME:
            yield part
            part = []
    if part:
        yield part


class _DamagedChunk(Exception):
    """A chunk whose content is not to be had."""


_Unpacked = tuple[Chunk, Content | _DamagedChunk]
