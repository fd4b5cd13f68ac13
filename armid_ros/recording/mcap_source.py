# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of an MCAP file, with or without its index, chunked or not, compressed or not."""

from __future__ import annotations

from collections.abc import Iterator
import heapq
import mmap
from pathlib import Path
import zlib

from armid_ros.errors import RecordingError
from armid_ros.recording.mcap_content import (
    are_messages,
    BLOCK_MESSAGES,
    Gathered,
    message_block,
    walk,
)
from armid_ros.recording.mcap_records import (
    add_definition,
    Chunk,
    chunk_content,
    FileMap,
    map_file,
    MESSAGE,
    RECORD_HEADER,
)
from armid_ros.recording.message_types import MessageType
from armid_ros.recording.qos import parse_qos
from armid_ros.recording.source import Block, IntArray, RawMessage, records_at, Topic
from mcap.records import Channel
import numpy as np
import numpy.typing as npt


class McapSource:
    """One MCAP file."""

    def __init__(self, path: Path, *, check: bool = False) -> None:
        """
        Open a file.

        Parameters
        ----------
        path : Path
            The file.
        check : bool
            Whether to compare the checksums of chunks, which takes as long again as reading.

        Raises
        ------
        RecordingError
            It cannot be read, or is no MCAP file.

        """
        self._check = check
        self._found = map_file(_map(path), path)
        self._counts: dict[int, int] | None = None

    @property
    def damage(self) -> str:
        """What is wrong with the file, as far as it was read; empty for a whole one."""
        return self._found.damage

    def close(self) -> None:
        """Let go of the file."""
        self._found = FileMap(b'')

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics, in order of appearance."""
        message_counts = self._survey()
        described: dict[str, Topic] = {}
        counts: dict[str, int] = {}
        for channel in self._found.channels.values():
            name = channel.topic
            counts[name] = counts.get(name, 0) + message_counts.get(channel.id, 0)
            described[name] = self._describe(channel, counts[name])
        return tuple(described.values())

    def blocks(self, topic: str) -> Iterator[Block]:
        """Yield the messages of a topic, in the order they are stored."""
        self._survey()
        wanted = sorted(c.id for c in self._found.channels.values() if c.topic == topic)
        gathered = Gathered(self._found.data)
        for chunk in self._found.chunks:
            if chunk.indexes and chunk.whole and not any(c in chunk.indexes for c in wanted):
                continue
            if chunk.whole and not chunk.compression and not self._check:
                data = self._found.data
                yield from gathered.add_in_place(self._offsets(data, chunk, wanted, chunk.begin))
            else:
                content = self._content(chunk)
                yield from gathered.add(content, self._offsets(content, chunk, wanted, 0))
        loose = self._loose()
        if len(loose):
            channels = records_at(self._found.data, loose, MESSAGE.itemsize).view(MESSAGE)
            loose = loose[np.isin(channels['channel'], wanted)]
            for at in range(0, len(loose), BLOCK_MESSAGES):
                yield from gathered.add_in_place(loose[at : at + BLOCK_MESSAGES])
        yield from gathered.flush()

    def messages(self) -> Iterator[RawMessage]:
        """Yield all messages in the order they were logged."""
        self._survey()
        names = {channel.id: channel.topic for channel in self._found.channels.values()}
        pending: list[tuple[int, int, RawMessage]] = []
        number = 0
        for start_time, block, channels in self._pieces():
            while pending and pending[0][0] < start_time:
                yield heapq.heappop(pending)[2]
            times = zip(
                channels.tolist(),
                block.log_time.tolist(),
                block.publish_time.tolist(),
                strict=True,
            )
            for at, (channel, log_time, publish_time) in enumerate(times):
                if channel not in names:
                    continue
                raw = RawMessage(names[channel], log_time, publish_time, block.message(at))
                heapq.heappush(pending, (log_time, number, raw))
                number += 1
        while pending:
            yield heapq.heappop(pending)[2]

    def _pieces(self) -> Iterator[tuple[int, Block, npt.NDArray[np.uint16]]]:
        """Yield messages of all channels by chunk, chunks by their first log time."""
        for chunk in sorted(self._found.chunks, key=lambda chunk: chunk.start_time):
            content = self._content(chunk)
            offsets = walk(content)[0]
            rows = records_at(content, offsets, MESSAGE.itemsize).view(MESSAGE)
            # In a damaged chunk a time can be anything; one beyond the year 2262 is not played.
            possible = (rows['log_time'] >= 0) & (rows['publish_time'] >= 0)
            if possible.any():
                block = message_block(content, offsets[possible])
                yield chunk.start_time, block, rows['channel'][possible]
        loose = self._loose()
        if len(loose):
            data = self._found.data
            rows = records_at(data, loose, MESSAGE.itemsize).view(MESSAGE)
            loose = loose[np.argsort(rows['log_time'], kind='stable')]
            for at in range(0, len(loose), BLOCK_MESSAGES):
                block = message_block(data, loose[at : at + BLOCK_MESSAGES])
                rows = records_at(data, loose[at : at + BLOCK_MESSAGES], MESSAGE.itemsize)
                yield int(block.log_time[0]), block, rows.view(MESSAGE)['channel']

    def _survey(self) -> dict[int, int]:
        """Make sure all channels are known, and return the number of messages of each."""
        if self._counts is not None:
            return self._counts
        found, summary = self._found, self._found.statistics
        if found.finished and summary and summary.channel_count == len(found.channels):
            self._counts = dict(summary.channel_message_counts)
            return self._counts
        ids = [int(channel) for channel in self._loose_channels()]
        for chunk in found.chunks:
            content = self._content(chunk)
            offsets, definitions = walk(content)
            for opcode, begin, end in definitions:
                add_definition(found, opcode, content[begin:end])
            rows = records_at(content, offsets, MESSAGE.itemsize).view(MESSAGE)
            ids += rows['channel'].tolist()
        channels, counts = np.unique(np.array(ids, np.int64), return_counts=True)
        self._counts = dict(zip(channels.tolist(), counts.tolist(), strict=True))
        return self._counts

    def _describe(self, channel: Channel, count: int) -> Topic:
        """Describe the topic of a channel."""
        schema = self._found.schemas.get(channel.schema_id)
        described = MessageType(
            name=_full_name(schema.name) if schema else '',
            definition=schema.data.decode('utf-8', 'replace') if schema else '',
            encoding=schema.encoding if schema else '',
            type_hash=channel.metadata.get('topic_type_hash', ''),
        )
        qos = parse_qos(channel.metadata.get('offered_qos_profiles'))
        return Topic(channel.topic, described, qos, count, channel.message_encoding)

    def _content(self, chunk: Chunk) -> bytes:
        """Return the content of a chunk, empty and the damage noted if it is not to be had."""
        try:
            content = chunk_content(self._found, chunk)
        except RecordingError as problem:
            self._found.damage = str(problem)
            return b''
        if self._check and chunk.whole and chunk.crc and zlib.crc32(content) != chunk.crc:
            self._found.damage = f'the checksum of the chunk at byte {chunk.begin} is wrong'
            return b''
        return content

    def _offsets(
        self, data: bytes | mmap.mmap, chunk: Chunk, wanted: list[int], begin: int
    ) -> IntArray:
        """Return where the messages of channels begin in a chunk whose content begins there."""
        end = begin + chunk.size
        if chunk.indexes and chunk.whole and len(data) >= end:
            parts = []
            for channel in wanted:
                at, count = chunk.indexes.get(channel, (0, 0))
                entries = np.frombuffer(self._found.data, '<i8', 2 * count, at)
                parts.append(entries[1::2] + begin)
            offsets = np.concatenate(parts)
            if len(wanted) > 1 or (len(offsets) > 1 and (np.diff(offsets) <= 0).any()):
                offsets.sort()
            if are_messages(data, offsets, wanted, begin, end):
                return offsets
        if begin:
            offsets = walk(bytes(memoryview(data)[begin:end]))[0] + begin
        else:
            offsets = walk(data)[0]
        rows = records_at(data, offsets, MESSAGE.itemsize).view(MESSAGE)
        return offsets[np.isin(rows['channel'], wanted)]

    def _loose(self) -> IntArray:
        """Return where messages outside chunks begin."""
        return np.array([begin - RECORD_HEADER for begin, _ in self._found.loose], np.int64)

    def _loose_channels(self) -> npt.NDArray[np.uint16]:
        rows = records_at(self._found.data, self._loose(), MESSAGE.itemsize).view(MESSAGE)
        return np.asarray(rows['channel'])


def _full_name(name: str) -> str:
    """Return a type name with its namespace, which some writers leave out."""
    package, _, rest = name.partition('/')
    return f'{package}/msg/{rest}' if rest and '/' not in rest else name


def _map(path: Path) -> bytes | mmap.mmap:
    """Return the bytes of a file without reading them."""
    try:
        with path.open('rb') as stream:
            if not stream.seek(0, 2):
                raise RecordingError(f'{path}: the file is empty')
            return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise RecordingError(f'{path}: cannot be read: {error.strerror}') from error
