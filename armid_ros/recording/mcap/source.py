# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read messages of an MCAP file, with or without index, chunks and compression.

Checksums, indexes and counts are compared with the messages. A damaged chunk is skipped
completely, since its undamaged messages cannot be recognised.

"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
import heapq
import mmap
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.mcap.contents import (
    Content,
    contents,
    Gathered,
    heads,
    message_block,
    tiled,
    walk,
)
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
    """Source for one MCAP file."""

    def __init__(self, path: Path, settings: ReadSettings = DEFAULT) -> None:
        """Open an MCAP file."""
        super().__init__(path, settings)
        with open_regular(path, RecordingError) as stream:
            if not stream.seek(0, 2):
                raise RecordingError(f'{path}: the file is empty')
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
        gathered, count = Gathered(found.data), 0
        # The message count reveals a damaged index; unfinished files have no count.
        counted = found.finished and found.statistics
        read = [
            chunk
            for chunk in found.chunks
            if not (counted and chunk.whole and chunk.indexes)
            or any(channel in chunk.indexes for channel in wanted)
        ]
        for _, content, offsets in self._pieces(read, wanted):
            count += len(offsets)
            yield from gathered.add(content, offsets)
        yield from gathered.flush()
        self._compare_count(topic, wanted, count)

    def messages(self) -> Iterator[RawMessage]:
        self._survey()
        names = {channel.id: channel.topic for channel in self._found.channels.values()}
        pending: list[tuple[int, int, RawMessage]] = []
        number = size = 0
        in_order = sorted(self._found.chunks, key=lambda chunk: chunk.start_time)
        overhead = 400  # bytes of a message object
        for start_time, content, offsets in self._pieces(in_order, sorted(names), by_time=True):
            while pending and pending[0][0] < start_time:
                raw = heapq.heappop(pending)[2]
                size -= len(raw.cdr) + overhead
                yield raw
            block, channels = message_block(content, offsets), heads(content, offsets)['channel']
            times = zip(
                channels.tolist(),
                block.log_time.tolist(),
                block.publish_time.tolist(),
                strict=True,
            )
            for at, (channel, log_time, publish_time) in enumerate(times):
                raw = RawMessage(names[channel], log_time, publish_time, block.message(at))
                heapq.heappush(pending, (log_time, number, raw))
                number += 1
                size += len(raw.cdr) + overhead
            # Chunks that overlap in time are kept in memory until their messages are sorted.
            self._settings.require(size, 'the messages to sort by time')
        while pending:
            yield heapq.heappop(pending)[2]
        self._compare_count('all topics', list(names), number)

    def _pieces(
        self, chunks: Sequence[Chunk], channels: Sequence[int], *, by_time: bool = False
    ) -> Iterator[tuple[int, bytes | mmap.mmap, IntArray]]:
        """Yield first log time, content, and begin of the messages of some channels."""
        data = self._found.data
        for chunk, unpacked in contents(self._found, chunks, self._settings):
            content, offsets, rows = self._messages_in(chunk, unpacked)
            yield chunk.start_time, content, self._possible(offsets, rows, channels)
        loose = np.array(self._found.loose, np.int64)
        loose = self._possible(loose, heads(data, loose), channels)
        if by_time:
            loose = loose[np.argsort(heads(data, loose)['log_time'], kind='stable')]
        for at in range(0, len(loose), BLOCK_MESSAGES):
            some = loose[at : at + BLOCK_MESSAGES]
            yield int(heads(data, some)['log_time'][0]), data, some

    def _survey(self) -> dict[int, int]:
        """Find all channels, and return the number of messages of each."""
        if self._counts is not None:
            return self._counts
        found, summary = self._found, self._found.statistics
        if found.finished and summary and summary.channel_count == len(found.channels):
            self._counts = dict(summary.channel_message_counts)
            return self._counts
        counts: dict[int, int] = {}
        channels = [heads(found.data, np.array(found.loose, np.int64))['channel']]
        for _, (content, begin, end) in contents(found, found.chunks, self._settings):
            offsets, definitions, _ = walk(content, begin, end)
            for opcode, start, stop in definitions:
                add_definition(found, opcode, content[start:stop])
            channels.append(heads(content, offsets)['channel'].copy())
        for rows in channels:
            for channel, count in zip(*np.unique(rows, return_counts=True), strict=True):
                counts[int(channel)] = counts.get(int(channel), 0) + int(count)
        self._counts = counts
        return self._counts

    def _messages_in(
        self, chunk: Chunk, unpacked: Content
    ) -> tuple[bytes | mmap.mmap, IntArray, _Rows]:
        """Return the content of a chunk, and begin and heads of its messages."""
        content, begin, end = unpacked
        if chunk.indexes and chunk.whole and end > begin:
            # Offsets beyond the content are set to its end, where no message can begin.
            parts = [
                np.minimum(
                    np.frombuffer(self._found.data, '<u8', 2 * count, at)[1::2], chunk.size
                ).astype(np.int64)
                for at, count in chunk.indexes.values()
            ]
            offsets = parts[0] if len(parts) == 1 else np.concatenate(parts)
            if len(parts) > 1 or not (np.diff(offsets) > 0).all():
                offsets = np.sort(offsets, kind='stable')
            offsets += begin
            rows = tiled(content, offsets, begin, end)
            if rows is not None:
                return content, offsets, rows
        offsets, _, position = walk(content, begin, end)
        if chunk.whole and position != end:
            self._found.damage.add(
                f'the chunk at byte {chunk.begin} is damaged: '
                f'some messages {self._found.span(chunk)} are lost'
            )
        return content, offsets, heads(content, offsets)

    def _possible(self, offsets: IntArray, rows: _Rows, wanted: Sequence[int]) -> IntArray:
        """Return the messages that are of some channels and have a valid time."""
        channels = rows['channel']
        chosen = np.isin(channels, wanted) if len(wanted) != 1 else channels == wanted[0]
        late = (rows['log_time'] < 0) | (rows['publish_time'] < 0)
        if late.any():
            self._found.damage.add(
                f'{int((late & chosen).sum())} messages are left out, for their time is after the '
                'year 2262'
            )
            chosen &= ~late
        return offsets if chosen.all() else offsets[chosen]

    def _compare_count(self, what: str, channels: Collection[int], count: int) -> None:
        """Compare the number of messages with the count of the writer."""
        summary = self._found.statistics
        if not (self._found.finished and summary and summary.channel_message_counts):
            return
        expected = sum(summary.channel_message_counts.get(channel, 0) for channel in channels)
        if count != expected:
            self._found.damage.add(
                f'{count} messages of {what}, but the writer counted {expected}'
            )
