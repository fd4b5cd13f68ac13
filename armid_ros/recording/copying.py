# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Copy the messages of a damaged ROS 2 bag, or of a ROS 1 bag, into a new ROS 2 bag."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.recording.bag import Bag
from armid_ros.recording.source import DEFAULT, ReadSettings, Topic, UNREADABLE
from armid_ros.recording.writer import atomic_bag


@dataclass(frozen=True)
class Copied:
    """
    Report on the copy of a bag: paths, copied topics, and damage of the source.

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
        Topics whose message types ROS 2 does not have, each with its type.

    """

    source: Path
    bag: Path
    topics: tuple[Topic, ...]
    damage: str
    duration: float
    left_out: tuple[str, ...] = ()

    @property
    def messages(self) -> int:
        """Return the total number of copied messages."""
        return sum(topic.count for topic in self.topics)

    def describe(self) -> str:
        """Return the report as a few sentences."""
        listed = ', '.join(f'{topic.name} ({topic.count})' for topic in self.topics)
        return (
            f'{self.source}: {self.damage or "the bag is not damaged"}. {self.messages} messages '
            f'over {self.duration:.3f} s are in {self.bag}: {listed}.'
        )


def copy_bag(path: str | Path, out: str | Path, settings: ReadSettings = DEFAULT) -> Copied:
    """
    Copy the readable messages of a bag into a new bag with index and metadata.yaml.

    Complete chunks are copied if their checksum is correct. If a file ends inside a chunk, the
    messages before the end are copied.

    Parameters
    ----------
    path : str or Path
        A bag or a file of a bag of ROS 2, or the .bag of ROS 1; it is not changed.
    out : str or Path
        Bag directory to create; it must not exist.
    settings : ReadSettings
        Whether checksums are compared, and the memory limit.

    Raises
    ------
    RecordingError
        If the bag cannot be read, has no message of a type that ROS 2 has, or ``out`` exists.

    """
    with Bag(path, settings) as bag:
        topics = bag.topics()
        left_out = tuple(
            f'{one.name} ({one.type_name})' for one in topics if one.encoding == UNREADABLE
        )
        if next(bag.messages(), None) is None:
            unknown = f'ROS 2 does not have the types of {", ".join(left_out)}' if left_out else ''
            raise RecordingError(
                f'{path}: the bag has no message to copy; '
                f'{bag.damage or unknown or "the bag is not damaged"}'
            )
        with atomic_bag(out) as writer:
            writer.copy(bag)
    start, end = writer.time_range
    return Copied(bag.path, writer.path, writer.topics, bag.damage, (end - start) * 1e-9, left_out)
