# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read the messages of a ROS 1 bag, converted to ROS 2."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from itertools import islice
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.recording.message_types import message_type, MessageType
from armid_ros.recording.source import (
    BLOCK_MESSAGES,
    DEFAULT,
    MessageBlock,
    RawMessage,
    ReadSettings,
    Source,
    Topic,
    UNREADABLE,
)
import numpy as np
from rosbags.convert.converter import is_same_wireformat, migrate_bytes
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.serde import SerdeError
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.base import TypesysError


class Ros1Source(Source):
    """Reader of a ROS 1 bag file; messages of types that ROS 2 does not have are skipped."""

    def __init__(self, path: Path, settings: ReadSettings = DEFAULT) -> None:
        """Open a ROS 1 bag; checksums are not compared, and one chunk at a time is in memory."""
        super().__init__(path, settings)
        self._old = get_typestore(Stores.ROS1_NOETIC)
        self._new = get_typestore(Stores.ROS2_JAZZY)
        self._converter = cache(self._make_converter)
        try:
            self._reader = Reader(path)
            self._reader.open()
        except (ReaderError, OSError) as error:
            raise RecordingError(f'{path}: the file is not a ROS 1 bag: {error}') from error
        for one in self._reader.connections:
            if one.msgtype not in self._old.fielddefs:
                with suppress(TypesysError):
                    self._old.register(get_types_from_msg(one.msgdef.data, one.msgtype))

    def close(self) -> None:
        self._reader.close()

    def topics(self) -> tuple[Topic, ...]:
        found: dict[str, Topic] = {}
        for one in self._reader.connections:
            known = self._is_known(one)
            described = message_type(one.msgtype) if known else MessageType(one.msgtype)
            count = one.msgcount + (found[one.topic].count if one.topic in found else 0)
            encoding = 'cdr' if known else UNREADABLE
            found[one.topic] = Topic(one.topic, described, (), count, encoding)
        return tuple(found.values())

    def blocks(self, topic: str) -> Iterator[MessageBlock]:
        wanted = [one for one in self._reader.connections if one.topic == topic]
        stream = self._read(wanted)
        while messages := list(islice(stream, BLOCK_MESSAGES)):
            times = np.array([message.log_time_ns for message in messages], np.int64)
            yield MessageBlock.joined([message.cdr for message in messages], times, times)

    def messages(self) -> Iterator[RawMessage]:
        return self._read(self._reader.connections)

    def _read(self, connections: list[Connection]) -> Iterator[RawMessage]:
        usable = [one for one in connections if self._is_known(one)]
        if not usable:
            return
        try:
            for one, stamp, raw in self._reader.messages(usable):
                try:
                    cdr = bytes(self._converter(one.msgtype)(raw))
                except (SerdeError, KeyError, ValueError) as error:
                    self._damage.add(f'messages of {one.topic} cannot be converted: {error}')
                else:
                    yield RawMessage(one.topic, stamp, stamp, cdr)
        except ReaderError as error:
            self._damage.add(f'the bag is damaged: {error}')

    def _is_known(self, one: Connection) -> bool:
        """Return whether ROS 1 and ROS 2 both have the message type of a connection."""
        return one.msgtype in self._new.fielddefs and one.msgtype in self._old.fielddefs

    def _make_converter(self, kind: str) -> Callable[[bytes | memoryview], memoryview]:
        """Return a function that converts messages of one type from ROS 1 to ROS 2."""
        old, new = self._old, self._new
        if is_same_wireformat(old, new, kind, kind):
            return partial(new.ros1_to_cdr, typename=kind)
        return partial(migrate_bytes, old, new, kind, kind, {}, src_is2=False, dst_is2=True)
