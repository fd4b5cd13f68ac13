# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the messages of an MCAP file, with or without index, chunks and compression.

Checksums, indexes and counts are compared with the messages. All messages of a damaged chunk are
left out, because its undamaged messages cannot be recognised.

"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
import mmap
from operator import attrgetter
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.mcap.contents import heads, message_block, messages_in, read_chunks, walk
from armid_ros.recording.mcap.records import add_definition, Chunk, FileMap, map_file
from armid_ros.recording.message_types import MessageType
from armid_ros.recording.metadata import parse_qos
from armid_ros.recording.source import (
    BLOCK_MESSAGES,
    DEFAULT,
    IntArray,
    MessageBlock,
    RawMessage,
    ReadSettings,
    Source,
    Topic,
)
import numpy as np
import numpy.typing as npt

_Rows = npt.NDArray[np.void]


class McapSource(Source):
    """Reader of one MCAP file."""

    def __init__(self, path: Path, settings: ReadSettings = DEFAULT) -> None:
        """Open an MCAP file, and locate its chunks."""
        super().__init__(path, settings)
        with open_regular(path, RecordingError) as stream:
            if not stream.seek(0, 2):
                raise RecordingError(f'{path}: the file is empty; record again')
            try:
                data = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
            except OSError as error:
                raise RecordingError(f'{path}: cannot be read: {error.strerror}') from error
        self._found = map_file(data, path, check=settings.check_crc)
        self._damage = self._found.damage
        self._counts: dict[int, int] | None = None

    def close(self) -> None:
        self._found = FileMap(b'')

    def topics(self) -> tuple[Topic, ...]:
        message_counts = self._survey()
        described: dict[str, Topic] = {}
        counts: dict[str, int] = {}
        for channel in self._found.channels.values():
            schema = self._found.schemas.get(channel.schema_id)
            name = schema.name if schema else ''
            package, _, rest = name.partition('/')
            if rest and '/' not in rest:  # some writers omit the namespace
                name = f'{package}/msg/{rest}'
            kind = MessageType(
                name=name,
                definition=schema.data.decode('utf-8', 'replace') if schema else '',
                encoding=schema.encoding if schema else '',
                type_hash=channel.metadata.get('topic_type_hash', ''),
            )
            topic, encoding = channel.topic, channel.message_encoding
            counts[topic] = counts.get(topic, 0) + message_counts.get(channel.id, 0)
            qos = parse_qos(channel.metadata.get('offered_qos_profiles'))
            described[topic] = Topic(topic, kind, qos, counts[topic], encoding)
        return tuple(described.values())

    def blocks(self, topic: str) -> Iterator[MessageBlock]:
        self._survey()
        found = self._found
        wanted = sorted(c.id for c in found.channels.values() if c.topic == topic)
        # The message count reveals a damaged index; incomplete files have no count.
        counted = found.finished and found.statistics
        chunks = [
            chunk
            for chunk in found.chunks
            if not (counted and chunk.complete and chunk.indexes)
            or any(channel in chunk.indexes for channel in wanted)
        ]
        count = 0
        for _, data, offsets in self._pieces(chunks, wanted):
            count += len(offsets)
            yield message_block(data, offsets)
        self._compare_count(topic, wanted, count)

    def messages(self) -> Iterator[RawMessage]:
        self._survey()
        names = {channel.id: channel.topic for channel in self._found.channels.values()}
        # Messages of chunks that overlap in time are kept in memory until they are sorted.
        pending: list[RawMessage] = []
        count = 0
        in_order = sorted(self._found.chunks, key=lambda chunk: chunk.start_time)
        for start_time, data, offsets in self._pieces(in_order, sorted(names)):
            ready = bisect_left(pending, start_time, key=attrgetter('log_time_ns'))
            yield from pending[:ready]
            del pending[:ready]
            block, rows = message_block(data, offsets), heads(data, offsets)
            count += len(block)
            pending += [
                RawMessage(names[channel], log_time, publish_time, block.message(at))
                for at, (channel, log_time, publish_time) in enumerate(
                    rows[['channel', 'log_time', 'publish_time']].tolist()
                )
            ]
            pending.sort(key=attrgetter('log_time_ns'))
            overhead = 400  # bytes of a message object
            size = sum(len(one.cdr) + overhead for one in pending)
            self._settings.require(size, 'the messages to sort by time')
        yield from pending
        self._compare_count('all topics', list(names), count)

    def _pieces(
        self, chunks: Sequence[Chunk], channels: Sequence[int]
    ) -> Iterator[tuple[int, bytes | mmap.mmap, IntArray]]:
        """Yield messages of `channels` in groups: first log time [ns], buffer, byte positions."""
        data, loose = self._found.data, np.array(self._found.loose, np.int64)
        for contents in read_chunks(self._found, chunks, self._settings):
            offsets = self._possible(*messages_in(self._found, contents), channels)
            if len(offsets):
                yield contents.parts[0][0].start_time, contents.data, offsets
        loose = self._possible(loose, heads(data, loose), channels)
        for at in range(0, len(loose), BLOCK_MESSAGES):
            first = int(heads(data, loose[at:])['log_time'].min())
            yield first, data, loose[at : at + BLOCK_MESSAGES]

    def _survey(self) -> dict[int, int]:
        """Find all channels of the file; return the number of messages in each channel."""
        if self._counts is not None:
            return self._counts
        found, summary = self._found, self._found.statistics
        if found.finished and summary and summary.channel_count == len(found.channels):
            self._counts = dict(summary.channel_message_counts)
            return self._counts
        counts: Counter[int] = Counter(
            heads(found.data, np.array(found.loose, np.int64))['channel'].tolist()
        )
        for data, parts in read_chunks(found, found.chunks, self._settings):
            for _, begin, end in parts:
                offsets, definitions, _ = walk(data, begin, end)
                for opcode, start, stop in definitions:
                    add_definition(found, opcode, data[start:stop])
                counts.update(heads(data, offsets)['channel'].tolist())
        self._counts = dict(counts)
        return self._counts

    def _possible(self, offsets: IntArray, rows: _Rows, wanted: Sequence[int]) -> IntArray:
        """Return the byte positions of messages in channels `wanted` with times before 2262."""
        channels = rows['channel']
        chosen = np.isin(channels, wanted) if len(wanted) != 1 else channels == wanted[0]
        late = (rows['log_time'] < 0) | (rows['publish_time'] < 0)
        if late.any():
            self._found.damage.add(
                f'{int((late & chosen).sum())} messages are left out, as their time is after '
                'the year 2262'
            )
            chosen &= ~late
        return offsets if chosen.all() else offsets[chosen]

    def _compare_count(self, topic: str, channels: Collection[int], count: int) -> None:
        """Report damage if the number of messages read differs from the count of the writer."""
        summary = self._found.statistics
        if not (self._found.finished and summary and summary.channel_message_counts):
            return
        expected = sum(summary.channel_message_counts.get(channel, 0) for channel in channels)
        if count != expected:
            self._found.damage.add(
                f'{count} messages of {topic} can be read, but the writer counted {expected}'
            )
