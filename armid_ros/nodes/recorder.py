# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recorder node: writes topics to a bag that stays readable if the process is killed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from functools import partial
import os
from pathlib import Path
import shutil
import time
from typing import Any, NoReturn

from armid_ros.errors import ArmidError, RecordingEnded, RecordingError
from armid_ros.files import size_text
from armid_ros.nodes.base import ArmidNode, LOOK_PERIOD
from armid_ros.nodes.messages.classes import message_class
from armid_ros.nodes.parameters.table import NodeParameter, setting
from armid_ros.nodes.qos import MatchedSubscription, recorded
from armid_ros.nodes.running.process import run
from armid_ros.recording import BagWriter
from armid_ros.recording.message_types import header_stamp


class RecorderNode(ArmidNode):
    """
    Node that records topics, undecoded, as a rosbag2 folder with an MCAP file.

    Attributes
    ----------
    message_count : int
        Messages in the open bag, or in the last one.
    last_stamps : dict of str to int
        Header stamp of the last message of each topic [ns]; 0 without a header.

    """

    table = (
        setting(
            'bag',
            '',
            'Directory to write; empty: armid_<date>_<time> in the current directory. A '
            'name set while a bag is open applies to the next bag.',
        ),
        setting('topics', [''], 'Topics to record; if empty, all published topics.'),
        NodeParameter('record', True, 'Record from the start, without waiting for ~/start.'),
        setting(
            'compression',
            'zstd',
            'Compression of the chunks; a change applies to the next bag.',
            choices=('zstd', 'lz4', 'none'),
        ),
        setting(
            'min_free',
            50.0,
            'Free disk space below which the bag is completed and the node ends.',
            'MB',
            limits=(0.0, 1e6),
        ),
        setting(
            'chunk_age', 0.1, 'Age at which a chunk is written out.', 's', limits=(0.01, 60.0)
        ),
    )

    def __init__(self, **kwargs: Any) -> None:
        """Create the node; start recording if the parameter `record` is true."""
        super().__init__('recorder', **kwargs)
        self._wanted = self._topics_wanted()
        self._writer: BagWriter | None = None
        self._subscriptions_by_topic: dict[str, MatchedSubscription] = {}
        self._refused: dict[str, Sequence[str]] = {}  # rejected topics and their types
        self._held: list[tuple[str, bool, bytes]] = []  # topic, whether it has stamps, message
        self._bags = 0
        self.message_count = 0
        self._begun = 0.0
        self._simulated = bool(self.value('use_sim_time'))
        self.last_stamps: dict[str, int] = {}
        self.offer('~/start', self.start)
        self.offer('~/stop', self.stop)
        self.create_steady_timer(LOOK_PERIOD, self.poll)
        self.create_steady_timer(0.1, self._flush)  # limits the loss after a kill
        self.create_steady_timer(1.0, self.watch)
        if self.value('record'):
            self.start()

    @property
    def recording(self) -> bool:
        """Whether a bag is being recorded."""
        return self._writer is not None

    @property
    def missing(self) -> tuple[str, ...]:
        """Full names of the topics to record that have no publisher."""
        heard = {t for t, s in self._subscriptions_by_topic.items() if s.publishers}
        return tuple(sorted(self._wanted - heard))

    def start(self) -> str:
        """Start a new bag; RecordingError if a bag is open or cannot be created."""
        if self._writer is not None:
            raise RecordingError(f'{self._writer.path} is being recorded; call ~/stop first')
        name = self.value('bag') or f'armid_{datetime.now():%Y_%m_%d-%H_%M_%S}'
        # The path of the first bag must not exist; bags of later ~/start calls get a number.
        path = Path(name).expanduser()
        number = self._bags
        while number and path.exists():
            path = path.with_name(f'{Path(name).name}_{number}')
            number += 1
        self._writer = BagWriter(
            path, chunk_age=self.value('chunk_age'), compression=self.value('compression')
        )
        self._bags += 1
        self.message_count = 0
        self._begun = time.monotonic()
        self.watch()
        self.poll()
        return self.log(f'recording into {self._writer.path}')

    def stop(self) -> str:
        """Close the bag; return a message with the path and the number of messages."""
        if self._writer is None:
            raise RecordingError('no recording is running; call ~/start to begin one')
        for subscription in self._subscriptions_by_topic.values():
            subscription.close()
        self._subscriptions_by_topic.clear()
        writer = self._writer
        self._write_held(writer, 0)
        try:
            writer.close()
        except ArmidError as error:
            self._abort(str(error))
        self._writer = None
        return self.log(f'{writer.path}: {self.message_count} messages')

    def poll(self) -> None:
        """Subscribe to topics that now have publishers, with the QoS of the publishers."""
        if self._writer is None:
            return
        for topic in list(self._subscriptions_by_topic):
            if self._is_wanted(topic):
                self._subscriptions_by_topic[topic].match()
            else:
                self._subscriptions_by_topic.pop(topic).close()
        for topic, types in self.get_topic_names_and_types():
            if self._is_wanted(topic) and topic not in self._subscriptions_by_topic:
                self._record(self._writer, topic, types)

    def watch(self) -> None:
        """
        Check that the bag still exists and that the disk is not full.

        Raises
        ------
        RecordingError
            If the bag was deleted or moved, or the disk is almost full. The bag is closed before.

        """
        writer = self._writer
        if writer is None:
            return
        if not writer.in_place:
            self._abort(f'{writer.file} was deleted or moved during the recording')
        try:
            free = shutil.disk_usage(writer.path).free
        except OSError as error:
            self._abort(f'{writer.path}: {error.strerror}')
        least = self.value('min_free') * 1e6
        if free < least:
            self._abort(f'only {size_text(free)} are free on the disk of {writer.path}')
        rate = writer.size / max(time.monotonic() - self._begun, 1.0)  # [B/s]
        if free - least < 60.0 * rate:
            text = f'the disk of {writer.path} will be full in less than 60 s'
            self.complaints.add('disk', text)

    def changed(self, names: frozenset[str]) -> None:
        """Apply changed parameters: topics, bag name and chunk age."""
        if 'topics' in names:
            self._wanted = self._topics_wanted()
            self.poll()
        if 'bag' in names:
            self._bags = 0
        if 'chunk_age' in names and self._writer is not None:
            self._writer.chunk_age = self.value('chunk_age')

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return a message on topics that are not recorded, and values on the open bag."""
        refused = sorted(filter(self._is_wanted, self._refused))
        absent = sorted(set(self.missing) - set(refused))
        trouble = '; '.join(
            [f'no node publishes {", ".join(absent)}'] * bool(absent)
            + [f'not recorded: {", ".join(refused)}'] * bool(refused)
        )
        values: dict[str, object] = {
            'recording': int(self.recording),
            'messages': self.message_count,
            'topics': len(self._subscriptions_by_topic),
        }
        if self._writer is not None:
            values['bag'] = self._writer.path
        return (trouble if self.recording else ''), values

    def close(self) -> None:
        """Close the open bag, if any."""
        if self._writer is not None:
            self.stop()

    def _topics_wanted(self) -> set[str]:
        return {self.resolve_topic_name(name) for name in self.value('topics')}

    def _is_wanted(self, topic: str) -> bool:
        """Return whether to record a topic; hidden topics have to be named in `topics`."""
        return topic in self._wanted if self._wanted else '/_' not in topic

    def _record(self, writer: BagWriter, topic: str, types: Sequence[str]) -> None:
        publishers = self.get_publishers_info_by_topic(topic)
        if not publishers or self._refused.get(topic) == types:
            return
        try:
            if len(types) > 1:
                raise RecordingError(f'publishers use several types: {", ".join(types)}')
            message_type = message_class(types[0])
            writer.add_topic(topic, types[0], qos=recorded(publishers))
        except ArmidError as error:
            self.complaints.add('topic', f'{topic} is not recorded: {error}')
            self._refused[topic] = types
            return
        self._refused.pop(topic, None)
        fields = message_type.get_fields_and_field_types()
        stamped = next(iter(fields.items()), None) == ('header', 'std_msgs/Header')
        take = partial(self._on_message, topic, stamped)
        self._subscriptions_by_topic[topic] = MatchedSubscription(
            self, message_type, topic, take, raw=True
        )

    def _on_message(self, topic: str, stamped: bool, data: bytes) -> None:
        writer = self._writer
        if writer is None:
            return
        now = self.get_clock().now().nanoseconds
        if now == 0:  # before the first message on /clock
            if len(self._held) < 1000:
                self._held.append((topic, stamped, data))
            else:
                self.complaints.add('message', 'messages are lost: /clock has no time so far')
            return
        if self._held:
            self._write_held(writer, now)
        self._write(writer, topic, stamped, data, now)

    def _write_held(self, writer: BagWriter, now: int) -> None:
        held, self._held = self._held, []
        for topic, stamped, data in held:
            self._write(writer, topic, stamped, data, now)

    def _write(self, writer: BagWriter, topic: str, stamped: bool, data: bytes, now: int) -> None:
        sent = header_stamp(data) if stamped else 0
        # /clock has coarse steps, but no message is received before it is sent
        if self._simulated:
            now = max(now, sent)
        try:
            writer.write(topic, data, now, sent or now)
        except RecordingError as error:
            self._abort(str(error))
        self.message_count += 1
        self.last_stamps[topic] = sent

    def _flush(self) -> None:
        if self._writer is not None:
            try:
                self._writer.flush()
            except RecordingError as error:
                self._abort(str(error))

    def _abort(self, reason: str) -> NoReturn:
        """Close the bag; raise an error with the reason and the number of saved messages."""
        writer, self._writer = self._writer, None
        assert writer is not None
        index_error = ''
        try:
            writer.close()
        except ArmidError:
            index_error = writer.save()
        count = sum(topic.count for topic in writer.topics)
        kept = f'{count} messages are in {writer.file}'
        if not os.path.lexists(writer.file):
            kept = f'its {count} messages are lost'
        elif index_error:
            kept += f', without an index ({index_error}): `armid recover` restores the index'
        raise RecordingEnded(f'{reason}; the recording ends: {kept}')


main = partial(run, RecorderNode)
