# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What every storage of messages offers: its topics, and their messages as raw CDR."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import mmap
from pathlib import Path
from typing import NamedTuple

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.message_types import MessageType
from armid_ros.recording.settings import DEFAULT, ReadSettings
import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Qos

IntArray = npt.NDArray[np.int64]
#: Encoding of topics that are listed, and whose messages a source cannot give.
UNREADABLE = 'unreadable'
#: Problems said one by one; a file that is damaged all over is not described byte by byte.
_SAID = 8


@dataclass(frozen=True)
class Topic:
    """
    A topic of a bag.

    Attributes
    ----------
    name : str
        Such as '/joint_states'.
    message_type : MessageType
        Its type, as the bag describes it.
    qos : tuple of rosbags.interfaces.Qos
        What its publishers offered; empty when unknown.
    count : int
        Number of messages.
    encoding : str
        How messages are serialised: 'cdr' in ROS 2, `UNREADABLE` where the source has none.
    joints : tuple of str
        Joints that its first messages name, as far as `bag_contents` has looked.

    """

    name: str
    message_type: MessageType
    qos: tuple[Qos, ...] = ()
    count: int = 0
    encoding: str = 'cdr'
    joints: tuple[str, ...] = ()

    @property
    def type_name(self) -> str:
        """Name of the message type."""
        return self.message_type.name


@dataclass(frozen=True)
class MessageBlock:
    """
    Many messages of one topic, in one buffer.

    Attributes
    ----------
    data : bytes or mmap
        The buffer.
    start, length : ndarray, shape (N,)
        Where the CDR of each message begins, and its number of bytes.
    log_time, publish_time : ndarray, shape (N,)
        When it was recorded, and when sent [ns].

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
        """Return messages in a buffer of their own."""
        length = np.array([len(message) for message in messages], np.int64)
        start = np.cumsum(length) - length
        return cls(b''.join(messages), start, length, log_time, publish_time)

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.start)

    def message(self, index: int) -> bytes:
        """Return the CDR of one message."""
        start = int(self.start[index])
        return self.data[start : start + int(self.length[index])]


class RawMessage(NamedTuple):
    """One message as recorded; times in ns."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    cdr: bytes


class Damage:
    """A list of what is wrong; the same is said once."""

    def __init__(self) -> None:
        self._problems: dict[str, None] = {}

    def __str__(self) -> str:
        """Return what is wrong; empty when nothing is."""
        said = list(self._problems)[:_SAID]
        more = len(self._problems) - len(said)
        return '; '.join([*said, *([f'and {more} more'] if more else [])])

    def add(self, problem: str) -> None:
        """Note a problem."""
        self._problems[problem] = None


class Source(ABC):
    """A storage of messages: one file, or the files of one bag."""

    def __init__(self, path: Path, settings: ReadSettings = DEFAULT) -> None:
        """
        Open a storage, for reading only.

        Parameters
        ----------
        path : Path
            Its file.
        settings : ReadSettings
            What to check, and how much memory to take.

        Raises
        ------
        RecordingError
            It cannot be read, or is none of the kind.

        """
        open_regular(path, RecordingError).close()  # a FIFO would be waited for
        self._path, self._settings, self._damage = path, settings, Damage()

    @property
    def damage(self) -> str:
        """Return what is wrong with it, as far as it was read; empty for a whole one."""
        return str(self._damage)

    @abstractmethod
    def topics(self) -> tuple[Topic, ...]:
        """Return the topics, in order of appearance."""

    @abstractmethod
    def blocks(self, topic: str) -> Iterator[MessageBlock]:
        """Yield the messages of a topic, in the order they are stored."""

    @abstractmethod
    def messages(self) -> Iterator[RawMessage]:
        """Yield all messages in the order they were logged."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the files."""


def records_at(data: bytes | mmap.mmap, start: IntArray, length: int) -> npt.NDArray[np.void]:
    """
    Return pieces of a buffer, without a copy where they are evenly spaced.

    Parameters
    ----------
    data : bytes or mmap
        The buffer; the pieces lie within it.
    start : ndarray, shape (N,)
        Where they begin.
    length : int
        Number of bytes of each.

    Returns
    -------
    ndarray, shape (N,)
        Void records, to be viewed as structured ones.

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
