# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Copy bags of ROS 1 to ROS 2, and recover damaged bags."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.recording.bag import Bag
from armid_ros.recording.source import DEFAULT, ReadSettings, Topic, UNREADABLE
from armid_ros.recording.writer import whole_bag


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

    """

    source: Path
    bag: Path
    topics: tuple[Topic, ...]
    damage: str
    duration: float
    left_out: tuple[str, ...] = ()

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
    with Bag(path, settings) as bag:
        if next(bag.messages(), None) is None:
            raise RecordingError(
                f'{path}: there is no message to recover; {bag.damage or "the file is whole"}'
            )
        return _copied(bag, out)


def copy_bag(path: Path, out: Path, settings: ReadSettings = DEFAULT) -> Copied:
    """
    Copy a bag message by message.

    Parameters
    ----------
    path : Path
        The .bag of ROS 1, or a bag of ROS 2.
    out : Path
        Bag directory to create; it must not exist.
    settings : ReadSettings
        Which checks are made when the bag is read, and the memory limit.

    Raises
    ------
    RecordingError
        If the bag cannot be read, or has no type that ROS 2 has.

    """
    with Bag(path, settings) as bag:
        return _copied(bag, out)


def _copied(bag: Bag, out: str | Path) -> Copied:
    """Write the topics and messages of a bag to a new bag."""
    topics = bag.topics()
    left_out = tuple(
        f'{one.name} ({one.type_name})' for one in topics if one.encoding == UNREADABLE
    )
    if len(left_out) == len(topics):
        raise RecordingError(
            f'{bag.path}: no topic has a message type of ROS 2; left out: '
            f'{"; ".join(left_out) or "the bag is empty"}'
        )
    with whole_bag(out) as writer:
        writer.copy(bag)
    start, end = writer.time_range
    return Copied(bag.path, writer.path, writer.topics, bag.damage, (end - start) * 1e-9, left_out)
