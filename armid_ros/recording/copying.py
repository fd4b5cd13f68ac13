# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Copy bags of ROS 1 and ROS 2, rename their joints, and recover damaged bags."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
import os
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.files import reading
from armid_ros.recording.bag import Bag
from armid_ros.recording.columns import renamed
from armid_ros.recording.joint_state.conversion import require_standard
from armid_ros.recording.mcap.source import McapSource
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.source import DEFAULT, ReadSettings, Source, Topic, UNREADABLE
from armid_ros.recording.writer import whole_bag
from rosbags.typesys import get_typestore, Stores


@dataclass(frozen=True)
class Copied:
    """
    Result of copying a bag.

    Attributes
    ----------
    source, bag : Path
        The bag that was read, and the bag that was written. The source is not changed.
    topics : tuple of Topic
        Topics of the new bag, with the number of messages.
    damage : str
        Damage of the source; empty if it is undamaged.
    duration : float
        Time from the first to the last message [s].
    left_out : tuple of str
        Topics that ROS 2 has no type for, with their types.
    renamed : tuple of (str, str)
        Old and new names of the renamed joints.

    """

    source: Path
    bag: Path
    topics: tuple[Topic, ...]
    damage: str
    duration: float
    left_out: tuple[str, ...] = ()
    renamed: tuple[tuple[str, str], ...] = ()

    @property
    def messages(self) -> int:
        """Return the number of messages copied."""
        return sum(topic.count for topic in self.topics)

    def describe(self) -> str:
        """Return the report in a few sentences."""
        listed = ', '.join(f'{topic.name} ({topic.count})' for topic in self.topics)
        return (
            f'{self.source}: {self.damage or "the file is whole"}. {self.messages} messages over '
            f'{self.duration:.3f} s are in {self.bag}: {listed}.'
        )


def recover(file: str | Path, out: str | Path, settings: ReadSettings = DEFAULT) -> Copied:
    """
    Copy the readable part of an MCAP file into a complete bag, with index and metadata.yaml.

    Complete chunks are copied if their checksum is correct. If the file ends inside a chunk, the
    messages before the end are copied.

    Parameters
    ----------
    file : str or Path
        The file, which is not changed. A directory with a single .mcap file may be given instead.
    out : str or Path
        Bag directory to create; it must not exist.
    settings : ReadSettings
        Whether checksums are compared, and the memory limit.

    Raises
    ------
    RecordingError
        If the file is not an MCAP file, has no message, or ``out`` exists.

    """
    path = Path(file)
    if path.is_dir():
        files = sorted(path.glob('*.mcap'))
        if len(files) != 1:
            listed = ', '.join(file.name for file in files) or 'none'
            raise RecordingError(
                f'{path}: a directory stands for its only .mcap file, but it has {listed}; '
                'recover files one by one'
            )
        path = files[0]
    if not os.path.lexists(path):
        raise RecordingError(f'{path}: there is no such file')
    with reading(path, RecordingError), closing(McapSource(path, settings)) as source:
        if next(source.messages(), None) is None:
            raise RecordingError(
                f'{path}: there is no message to recover; {source.damage or "the file is whole"}'
            )
        return _copied(path, source, out)


def copy_bag(
    path: Path,
    out: Path,
    rename: Sequence[tuple[str, str]] = (),
    settings: ReadSettings = DEFAULT,
) -> Copied:
    """
    Copy a bag message by message.

    Parameters
    ----------
    path : Path
        A bag of ROS 2, or the .bag of ROS 1.
    out : Path
        Bag directory to create; it must not exist.
    rename : sequence of (str, str)
        Pairs of an old and a new name, or of an old and a new beginning of names.
    settings : ReadSettings
        Which checks are made when the bag is read, and the memory limit.

    Raises
    ------
    RecordingError
        If the bag cannot be read, has no type that ROS 2 has, or its joints cannot be renamed.

    """
    store = get_typestore(Stores.ROS2_JAZZY)
    names: dict[str, str] = {}

    def change(topic: Topic, cdr: bytes) -> bytes:
        if topic.type_name != JOINT_STATE or not rename:
            return cdr
        message: Any = store.deserialize_cdr(cdr, JOINT_STATE)
        for name in message.name:
            names.setdefault(name, renamed(name, rename))
        message.name = [names[name] for name in message.name]
        return bytes(store.serialize_cdr(message, JOINT_STATE))

    with Bag(path, settings) as bag:
        topics = bag.topics()
        left_out = [
            f'{one.name} ({one.type_name})' for one in topics if one.encoding == UNREADABLE
        ]
        if len(left_out) == len(topics):
            raise RecordingError(
                f'{path}: no topic has a message type of ROS 2; left out: '
                f'{"; ".join(left_out) or "the bag is empty"}'
            )
        for topic in topics:
            if rename and topic.type_name == JOINT_STATE:
                require_standard(bag, topic)
        copied = _copied(path, bag, out, change)
    changed = tuple((old, new) for old, new in names.items() if old != new)
    return replace(copied, left_out=tuple(left_out), renamed=changed)


def _copied(
    path: Path,
    source: Source,
    out: str | Path,
    change: Callable[[Topic, bytes], bytes] | None = None,
) -> Copied:
    """Write the topics and messages of a source to a new bag, and report it."""
    with whole_bag(out) as writer:
        writer.copy(source, change)
    start, end = writer.time_range
    return Copied(path, writer.path, writer.topics, source.damage, (end - start) * 1e-9)
