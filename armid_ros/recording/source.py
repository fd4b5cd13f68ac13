# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Interface of the readers of storage files: topics, and their messages as CDR bytes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
import mmap
from pathlib import Path
from typing import NamedTuple

from armid_ros.errors import RecordingError
from armid_ros.files import default_memory_limit, open_regular, size_text
from armid_ros.recording.message_types import MessageType
import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Qos

IntArray = npt.NDArray[np.int64]
#: Value of `Topic.encoding` if the messages of the topic cannot be read.
UNREADABLE = 'unreadable'
#: Number of messages per block, for storages without chunks.
BLOCK_MESSAGES = 4096


@dataclass(frozen=True)
class ReadSettings:
    """
    Memory limit and checks for reading a bag.

    Attributes
    ----------
    check_crc : bool
        Whether checksums are compared and damaged chunks are skipped. Reading then takes about a
        tenth longer.
    memory_limit : int
        Memory limit for the messages of one bag, one chunk, or one unpacked file [bytes]; by
        default a quarter of the memory.
    temperatures : bool
        Whether temperatures of the joints are read from a bag.

    """

    check_crc: bool = True
    memory_limit: int = field(default_factory=default_memory_limit)
    temperatures: bool = True

    def __post_init__(self) -> None:
        """Raise RecordingError if the memory limit is not positive."""
        if self.memory_limit <= 0:
            raise RecordingError(
                f'memory_limit is {self.memory_limit} bytes; give a positive number'
            )

    def require(self, size: int, content_name: str) -> None:
        """
        Raise RecordingError if content of the given size would exceed the memory limit.

        Parameters
        ----------
        size : int
            Size of the content in memory [bytes].
        content_name : str
            Name of the content, the beginning of the error message.

        Raises
        ------
        RecordingError
            If the size exceeds the limit.

        """
        if size > self.memory_limit:
            raise RecordingError(
                f'{content_name} needs {size_text(size)}, more than the memory limit of '
                f'{size_text(self.memory_limit)}; raise memory_limit if you trust the file'
            )


DEFAULT = ReadSettings()


@dataclass(frozen=True)
class Topic:
    """
    Topic of a bag: name, message type, QoS profiles and number of messages.

    Attributes
    ----------
    name : str
        Such as '/joint_states'.
    message_type : MessageType
        Message type, as the bag describes it.
    qos : tuple of rosbags.interfaces.Qos
        QoS profiles that the publishers offered; empty if unknown.
    count : int
        Number of messages.
    encoding : str
        Serialisation of the messages: 'cdr' in ROS 2, `UNREADABLE` if the source cannot return
        them.
    joints : tuple of str
        Joint names in the first messages of a JointState topic; set by `topics`.

    """

    name: str
    message_type: MessageType
    qos: tuple[Qos, ...] = ()
    count: int = 0
    encoding: str = 'cdr'
    joints: tuple[str, ...] = ()

    @property
    def type_name(self) -> str:
        """Return the name of the message type, such as 'sensor_msgs/msg/JointState'."""
        return self.message_type.name


def listed(topics: Sequence[Topic]) -> str:
    """Return the topics as text with types and message counts, for error messages."""
    known = (f'{one.name} ({one.type_name}, {one.count} messages)' for one in topics)
    return ', '.join(known) or 'none'


@dataclass(frozen=True)
class MessageBlock:
    """
    Serialised messages of one topic in one buffer, with their times.

    Attributes
    ----------
    data : bytes or mmap
        The buffer.
    start, length : ndarray, shape (N,)
        Begin and number of bytes of the CDR of each message.
    log_time, publish_time : ndarray, shape (N,)
        Times of recording and of sending [ns].

    """

    data: bytes | mmap.mmap
    start: IntArray
    length: IntArray
    log_time: IntArray
    publish_time: IntArray

    @classmethod
    def joined(
        cls, messages: Sequence[bytes], log_time: IntArray, publish_time: IntArray
    ) -> MessageBlock:
        """Return a block of the given messages, copied into one buffer."""
        length = np.array([len(message) for message in messages], np.int64)
        start = np.cumsum(length) - length
        return cls(b''.join(messages), start, length, log_time, publish_time)

    def __len__(self) -> int:
        """Return the number of messages N."""
        return len(self.start)

    def message(self, index: int) -> bytes:
        """Return the CDR bytes of one message."""
        start = int(self.start[index])
        return self.data[start : start + int(self.length[index])]


class RawMessage(NamedTuple):
    """One serialised message with its topic and times [ns]."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    cdr: bytes


class Damage:
    """List of problems found in a file, without repetition."""

    def __init__(self) -> None:
        self._problems: dict[str, None] = {}

    def __str__(self) -> str:
        """Return the first eight problems as text; empty if there are none."""
        shown = list(self._problems)[:8]
        more = len(self._problems) - len(shown)
        return '; '.join([*shown, *([f'and {more} more'] if more else [])])

    def add(self, problem: str) -> None:
        """Add a problem, unless the list contains it already."""
        self._problems[problem] = None


class Source(ABC):
    """Reader for the topics and messages of one storage file, or of a complete bag."""

    def __init__(self, path: Path, settings: ReadSettings = DEFAULT) -> None:
        """
        Open a storage file for reading.

        Parameters
        ----------
        path : Path
            The storage file.
        settings : ReadSettings
            Checks of the file, and the memory limit.

        Raises
        ------
        RecordingError
            If the file cannot be read, or has another format.

        """
        open_regular(path, RecordingError).close()  # opening a FIFO would block
        self._path, self._settings, self._damage = path, settings, Damage()

    @property
    def damage(self) -> str:
        """Description of the damage that was found so far; empty without damage."""
        return str(self._damage)

    @abstractmethod
    def topics(self) -> tuple[Topic, ...]:
        """Return the topics, in order of appearance."""

    @abstractmethod
    def blocks(self, topic: str) -> Iterator[MessageBlock]:
        """Yield the messages of a topic in blocks, in the order of storage."""

    @abstractmethod
    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages of all topics in the order of their log times."""

    @abstractmethod
    def close(self) -> None:
        """Close the storage files."""


def records_at(data: bytes | mmap.mmap, start: IntArray, length: int) -> npt.NDArray[np.void]:
    """
    Return pieces of equal length from a buffer, at given byte positions.

    Parameters
    ----------
    data : bytes or mmap
        The buffer; the pieces lie within it.
    start : ndarray, shape (N,)
        Position of the first byte of each piece.
    length : int
        Number of bytes of each piece.

    Returns
    -------
    ndarray, shape (N,)
        Void records, which can be viewed as structured records.

    """
    record = np.dtype((np.void, length))
    if not len(start):
        return np.empty(0, record)
    steps = np.diff(start)
    if not len(steps) or (steps == steps[0]).all():
        stride = int(steps[0]) if len(steps) else length
        return np.ndarray((len(start),), record, data, int(start[0]), (stride,))
    everywhere = np.ndarray((len(data) - length + 1,), record, data, 0, (1,))
    return everywhere[start]
