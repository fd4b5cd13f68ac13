# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of ROS 1, and bags whose joints get other names: both are copied message by message."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.conversion import is_plain
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.settings import DEFAULT, ReadSettings
from armid_ros.recording.source import Topic
from armid_ros.recording.tables.settings import renamed
from armid_ros.recording.writer import whole_bag
from rosbags.convert.converter import is_same_wireformat, migrate_bytes
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.serde import SerdeError
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

SUFFIX = '.bag'


@dataclass(frozen=True)
class Copied:
    """
    What was copied.

    Attributes
    ----------
    topics : tuple of (str, str, int)
        Name, type and messages of each.
    left_out : tuple of str
        Topics that ROS 2 has no type for, and why.
    renamed : tuple of (str, str)
        Joints that got another name.
    damage : str
        What is wrong with the bag; empty for a whole one.

    """

    topics: tuple[tuple[str, str, int], ...]
    left_out: tuple[str, ...] = ()
    renamed: tuple[tuple[str, str], ...] = ()
    damage: str = ''


def is_ros1(path: Path) -> bool:
    """Whether a path is a bag of ROS 1 by its name."""
    return path.suffix.lower() == SUFFIX


def convert_ros1(path: Path, out: Path, rename: Sequence[tuple[str, str]] = ()) -> Copied:
    """
    Write a bag of ROS 1 as one of ROS 2.

    Parameters
    ----------
    path : Path
        The .bag file.
    out : Path
        The bag directory to be made; it must not exist.
    rename : sequence of (str, str)
        From beginnings of joint names, or whole names, to what they become.

    Raises
    ------
    RecordingError
        It is no such bag, or nothing in it has a type that ROS 2 has.

    """
    with open_regular(path, RecordingError):  # a FIFO would be waited for
        pass
    try:
        with Reader(path) as reader:
            return _copy_ros1(path, reader, out, rename)
    except (ReaderError, OSError) as error:
        raise RecordingError(f'{path}: cannot be read as a bag of ROS 1: {error}') from error


def copy_renamed(
    path: Path,
    out: Path,
    rename: Sequence[tuple[str, str]],
    settings: ReadSettings = DEFAULT,
) -> Copied:
    """
    Copy a bag, giving the joints of its JointState messages other names.

    Parameters are those of ``convert_ros1``.

    """
    store = get_typestore(Stores.ROS2_JAZZY)
    names: dict[str, str] = {}

    def change(topic: Topic, cdr: bytes) -> bytes:
        if topic.type_name != JOINT_STATE:
            return cdr
        return _with_names(store, store.deserialize_cdr(cdr, JOINT_STATE), rename, names)

    with Bag(path, settings) as bag, whole_bag(out) as writer:
        for topic in bag.topics():
            if topic.type_name == JOINT_STATE and not is_plain(topic):
                raise RecordingError(
                    f'{path}: {topic.name} is no {JOINT_STATE} of ROS 2, whose names can be '
                    'changed; give --rename to the command that reads the bag'
                )
        writer.copy(bag, change)
        damage = bag.damage
    topics = tuple((topic.name, topic.type_name, topic.count) for topic in writer.topics)
    return Copied(topics, renamed=_changed(names), damage=damage)


def _copy_ros1(path: Path, reader: Reader, out: Path, rename: Sequence[tuple[str, str]]) -> Copied:
    old, new = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_JAZZY)
    left_out: dict[str, str] = {}
    counts: dict[str, tuple[str, int]] = {}
    names: dict[str, str] = {}
    converters: dict[str, Callable[[bytes | memoryview], memoryview]] = {}
    usable = []
    for connection in reader.connections:
        if connection.msgtype not in new.fielddefs:
            left_out[connection.topic] = f'{connection.topic} ({connection.msgtype}): no such type'
            continue
        if connection.msgtype not in old.fielddefs:
            try:
                old.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            except TypesysError as error:
                left_out[connection.topic] = f'{connection.topic}: {error}'
                continue
        usable.append(connection)
    if not usable:
        raise RecordingError(
            f'{path}: nothing in it has a type that ROS 2 has; left out: '
            f'{"; ".join(left_out.values()) or "it is empty"}'
        )
    with whole_bag(out) as writer:
        for connection, stamp, raw in reader.messages(usable):
            topic, kind = connection.topic, connection.msgtype
            try:
                if kind not in converters:
                    converters[kind] = _converter(old, new, kind)
                cdr = bytes(converters[kind](raw))
                if kind == JOINT_STATE and rename:
                    cdr = _with_names(new, new.deserialize_cdr(cdr, kind), rename, names)
            except (SerdeError, KeyError, ValueError) as error:
                left_out[topic] = f'{topic} ({kind}): {error}'
                continue
            writer.add_topic(topic, kind)
            writer.write(topic, cdr, stamp)
            counts[topic] = kind, counts.get(topic, (kind, 0))[1] + 1
    return Copied(
        tuple((topic, kind, count) for topic, (kind, count) in counts.items()),
        tuple(left_out.values()),
        _changed(names),
    )


def _converter(
    old: Typestore, new: Typestore, kind: str
) -> Callable[[bytes | memoryview], memoryview]:
    """Return what makes a message of ROS 2 of one of ROS 1."""
    if is_same_wireformat(old, new, kind, kind):
        return partial(new.ros1_to_cdr, typename=kind)
    return partial(migrate_bytes, old, new, kind, kind, {}, src_is2=False, dst_is2=True)


def _with_names(
    store: Typestore, message: Any, rename: Sequence[tuple[str, str]], names: dict[str, str]
) -> bytes:
    """Return a JointState with other names, serialised."""
    for name in message.name:
        names.setdefault(name, renamed(name, rename))
    message.name = [names[name] for name in message.name]
    return bytes(store.serialize_cdr(message, JOINT_STATE))


def _changed(names: dict[str, str]) -> tuple[tuple[str, str], ...]:
    return tuple((old, new) for old, new in names.items() if old != new)
