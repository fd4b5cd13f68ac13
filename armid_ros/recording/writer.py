# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Write bags of rosbag2: a directory with BAG_0.mcap and metadata.yaml, as in ROS 2 Jazzy.

Messages in a finished chunk survive a crash or a kill of the process. Chunks are therefore
finished early, at a limit of their size or age.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
import os
from pathlib import Path
import shutil
import time
from typing import Self

from armid_ros.errors import ArmidError, RecordingError
from armid_ros.files import write_file
from armid_ros.recording.mcap.records import MESSAGE, RECORD_HEADER
from armid_ros.recording.mcap.writer import Compression, McapWriter, message_record
from armid_ros.recording.message_types import message_type, MessageType, STRING, string_cdr
from armid_ros.recording.metadata import bag_information, FILE_NAME, LATCHED, VOLATILE, yaml_text
from armid_ros.recording.source import IntArray, Source, Topic, UNREADABLE
from armid_ros.version import __version__
from mcap.opcode import Opcode
import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import dump_qos_v9

# Limit of the size of a chunk [bytes]. JointState messages at 3 kHz (1 MB/s) reach the age first.
DEFAULT_CHUNK_SIZE = 512 * 1024
# Limit of the age of a chunk [s]. With the writing, a kill loses at most 0.3 s of messages.
DEFAULT_CHUNK_AGE = 0.2


@contextmanager
def atomic_bag(
    path: str | Path,
    *,
    compression: Compression = 'zstd',
    chunk_size: int = DEFAULT_CHUNK_SIZE,
) -> Iterator[BagWriter]:
    """
    Write a bag that is complete or absent: an exception removes the incomplete bag.

    An incomplete result could be mistaken for a complete result. A recorder, in contrast, keeps
    its incomplete bag.

    Parameters
    ----------
    path, compression, chunk_size
        As for `BagWriter`.

    Yields
    ------
    BagWriter

    Raises
    ------
    RecordingError
        If the directory exists, or cannot be created or written to.

    """
    writer = BagWriter(path, compression=compression, chunk_size=chunk_size)
    try:
        yield writer
        writer.close()
    except BaseException:
        with suppress(ArmidError, OSError):
            writer.close()
        shutil.rmtree(writer.path, ignore_errors=True)
        raise


def require_new(path: Path) -> None:
    """Raise RecordingError if a path of a new bag exists already."""
    if os.path.lexists(path):
        raise RecordingError(f'{path}: the bag exists already; choose another name, or remove it')


class BagWriter:
    """
    Writer for one bag with MCAP storage, to be used in a `with` statement.

    The end of the context completes the bag, also after an exception. Messages recorded before
    the exception are kept.

    """

    def __init__(
        self,
        path: str | Path,
        *,
        chunk_size: int = DEFAULT_CHUNK_SIZE,
        chunk_age: float = DEFAULT_CHUNK_AGE,
        compression: Compression = 'zstd',
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """
        Create the directory of the bag and begin its storage file.

        Parameters
        ----------
        path : str or Path
            Directory to create; it must not exist.
        chunk_size : int
            Size of the messages at which a chunk is written [bytes].
        chunk_age : float
            Age at which a chunk is written when the next message arrives [s].
        compression : {'zstd', 'lz4', 'none'}
            Compression of the chunks.
        clock : callable
            Returns the time for the age of chunks [s].

        Raises
        ------
        RecordingError
            If the directory exists, or cannot be created.

        """
        self.path = Path(path)
        require_new(self.path)
        try:
            self.path.mkdir(parents=True)
        except OSError as error:
            raise RecordingError(f'{self.path}: cannot be created: {error.strerror}') from error
        self.file = self.path / f'{self.path.resolve().name}_0.mcap'
        self._chunk_size = chunk_size
        self.chunk_age = chunk_age
        self._clock = clock
        library = f'armid_ros {__version__}'
        self._mcap = McapWriter(self.file, compression=compression, library=library)
        self._topics: dict[str, Topic] = {}
        self._schemas: dict[MessageType, int] = {}
        self._channels: dict[str, int] = {}
        self._open = 0, list[bytes]()  # number and records of the chunk that is not written yet
        self._size = 0
        self._opened = clock()
        self._closed = False
        self._write_information(None)

    def __enter__(self) -> Self:
        """Return the open writer."""
        return self

    def __exit__(self, *error: object) -> None:
        """Complete the bag."""
        self.close()

    @property
    def topics(self) -> tuple[Topic, ...]:
        """Return the topics of the bag with the numbers of written messages."""
        counts = self._mcap.committed.counts
        return tuple(
            replace(topic, count=counts.get(self._channels[name], 0))
            for name, topic in self._topics.items()
        )

    @property
    def size(self) -> int:
        """Return the size of the storage file [bytes]."""
        return self._mcap.committed.position

    @property
    def in_place(self) -> bool:
        """Whether the storage file is still at the path where it was created."""
        return self._mcap.in_place

    @property
    def time_range(self) -> tuple[int, int]:
        """Return the log times of the first and the last message in the file [ns]."""
        return self._mcap.committed.time_range

    def add_topic(
        self,
        name: str,
        type_name: str,
        *,
        qos: Sequence[Qos] = (),
        definition: str | None = None,
        type_hash: str | None = None,
        encoding: str = 'ros2msg',
    ) -> None:
        """
        Add a topic to the bag; no effect if the bag has this topic with the same type.

        Parameters
        ----------
        name : str
            Such as '/joint_states'.
        type_name : str
            Such as 'sensor_msgs/msg/JointState'.
        qos : sequence of rosbags.interfaces.Qos
            QoS profiles that the publishers offer; by default a reliable, volatile publisher.
        definition : str, optional
            Text of the type's .msg file, with or without its dependencies; needed for types that
            are neither standard nor installed.
        type_hash : str, optional
            RIHS01 hash. With a definition and a hash, both are written unchanged.
        encoding : {'ros2msg', 'ros2idl'}
            Language of the definition.

        Raises
        ------
        RecordingError
            If the topic exists with another type, or the type is not known.

        """
        self._check_open()
        known = self._topics.get(name)
        if known is not None:
            if known.type_name != type_name:
                raise RecordingError(
                    f'{self.path}: the topic {name} was added with type {known.type_name}, so it '
                    f'cannot have type {type_name}'
                )
            return
        if definition is not None and type_hash is not None:
            described = MessageType(type_name, definition, encoding, type_hash)
        else:
            described = message_type(type_name, definition)
        topic = Topic(name, described, tuple(qos) or (VOLATILE,))
        if described not in self._schemas:
            number, record = self._mcap.add_schema(
                described.name,
                described.encoding if described.definition else '',
                described.definition.encode(),
            )
            self._open_records().append(record)
            self._schemas[described] = number
        channel, record = self._mcap.add_channel(
            name,
            self._schemas[described],
            {
                'offered_qos_profiles': yaml_text(dump_qos_v9(list(topic.qos))).strip(),
                'topic_type_hash': described.type_hash,
            },
        )
        self._open_records().append(record)
        self._topics[name] = topic
        self._channels[name] = channel

    def write(
        self,
        topic: str,
        cdr: bytes | memoryview,
        log_time_ns: int,
        publish_time_ns: int | None = None,
    ) -> None:
        """
        Write one serialised message.

        Parameters
        ----------
        topic : str
            Topic that was added before.
        cdr : bytes
            The message, serialised.
        log_time_ns : int
            Time of reception [ns].
        publish_time_ns : int, optional
            Time of sending [ns]; by default the time of reception.

        Raises
        ------
        RecordingError
            If the topic was not added, or the bag is closed.

        """
        channel = self._channel(topic)
        published = log_time_ns if publish_time_ns is None else publish_time_ns
        record = message_record(channel, cdr, log_time_ns, published)
        now = self._clock()
        records = self._open_records()
        if not records:
            self._opened, self._size = now, 0
        records.append(record)
        self._size += len(record)
        if self._size >= self._chunk_size or now - self._opened >= self.chunk_age:
            self.flush()

    def write_description(self, urdf: str, log_time_ns: int) -> None:
        """Write a URDF to the topic /robot_description, latched for late subscribers."""
        self.add_topic('/robot_description', STRING, qos=[LATCHED])
        self.write('/robot_description', string_cdr(urdf), log_time_ns)

    def write_many(
        self, topic: str, messages: npt.NDArray[np.void], log_times_ns: IntArray
    ) -> None:
        """
        Write an array of serialised messages of equal length.

        Parameters
        ----------
        topic : str
            Topic that was added before.
        messages : ndarray of void, shape (N,)
            The messages, serialised.
        log_times_ns : ndarray, shape (N,)
            Times of reception, also written as times of sending [ns].

        Raises
        ------
        RecordingError
            If the topic was not added, or the bag is closed.

        """
        channel = self._channel(topic)
        length = messages.dtype.itemsize
        record = np.dtype([('head', MESSAGE), ('cdr', np.void, length)])
        at_once = max(1, self._chunk_size // record.itemsize)
        for at in range(0, len(messages), at_once):
            some = messages[at : at + at_once]
            # The sequence number is between these fields and is zero.
            records = np.zeros(len(some), record)
            head = records['head']
            head['opcode'] = Opcode.MESSAGE
            head['length'] = record.itemsize - RECORD_HEADER
            head['channel'] = channel
            head['log_time'] = head['publish_time'] = log_times_ns[at : at + at_once]
            records['cdr'] = some
            waiting, offsets = _joined(self._open_records())
            more = len(waiting) + np.arange(len(some), dtype=np.int64) * record.itemsize
            self._mcap.write_chunk(waiting + records.tobytes(), np.concatenate([offsets, more]))

    def copy(self, source: Source) -> None:
        """
        Copy all topics and messages of a bag, with unchanged types, QoS profiles and times.

        Topics whose messages the source cannot return are skipped.

        Parameters
        ----------
        source : Source
            A bag, or one of its files.

        """
        for topic in source.topics():
            if topic.encoding == UNREADABLE:
                continue
            kept = topic.message_type
            add = partial(
                self.add_topic, topic.name, kept.name, qos=topic.qos, encoding=kept.encoding
            )
            text, digest = kept.definition, kept.type_hash
            try:  # find a definition or hash that the source lacks
                add(definition=text or None, type_hash=digest or None)
            except RecordingError:
                add(definition=text, type_hash=digest)
        for message in source.messages():
            self.write(message.topic, message.cdr, message.log_time_ns, message.publish_time_ns)

    def flush(self) -> None:
        """Write the messages in memory to the file as a chunk; recorders call this regularly."""
        self._check_open()
        content, offsets = _joined(self._open_records())
        # A chunk without messages need not be written.
        if len(offsets):
            self._mcap.write_chunk(content, offsets)

    def close(self) -> None:
        """Complete the storage file and write metadata.yaml; no effect on a closed bag."""
        if self._closed:
            return
        if not self._mcap.finished:
            self.flush()
            self._write_information(self.file.name)
        self._complete()
        self._closed = True

    def save(self) -> str:
        """
        Complete the bag after a write error; messages in memory are lost.

        Returns
        -------
        str
            Error message; empty if the bag is complete. In both cases every written chunk can be
            read.

        """
        if self._closed:
            return ''
        self._closed = True
        try:
            self._complete()
        except ArmidError as error:
            self._mcap.give_up()
            return str(error)
        return ''

    def _open_records(self) -> list[bytes]:
        """Return the list of records for the next chunk."""
        # flush() does not empty the list, because it may be interrupted after writing. Records
        # have the number of their chunk, and are removed when that chunk is in the file.
        if self._open[0] != self._mcap.committed.chunks:
            self._open = self._mcap.committed.chunks, []
        return self._open[1]

    def _complete(self) -> None:
        """Write the summary of the storage file, and metadata.yaml."""
        self._mcap.finish()
        information = bag_information(self.topics, self.file.name, *self.time_range)
        text = yaml_text({'rosbag2_bagfile_information': information})
        write_file(self.path / FILE_NAME, text)  # complete or absent after an interruption

    def _write_information(self, file_name: str | None) -> None:
        """Write the metadata record that rosbag2 has at the start and end of an MCAP file."""
        text = yaml_text(bag_information(self.topics, file_name, *self.time_range))
        self._mcap.write_metadata('rosbag2', {'serialized_metadata': text})

    def _check_open(self) -> None:
        if self._closed:
            raise RecordingError(f'{self.path}: the bag is closed and cannot be written to')

    def _channel(self, topic: str) -> int:
        """Return the MCAP channel of a topic; RecordingError if the topic was not added."""
        channel = self._channels.get(topic)
        if channel is None or self._closed:
            self._check_open()
            known = ', '.join(self._topics) or 'none'
            raise RecordingError(
                f"{self.path}: the topic '{topic}' was not added to the bag, whose topics are "
                f'{known}'
            )
        return channel


def _joined(records: list[bytes]) -> tuple[bytes, IntArray]:
    """Join MCAP records; return bytes, and the byte position of each message record."""
    lengths = np.array([len(record) for record in records], np.int64)
    is_message = np.array([record[0] == Opcode.MESSAGE for record in records], np.bool_)
    return b''.join(records), (np.cumsum(lengths) - lengths)[is_message]
