# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Writes rosbag2 directories: BAG/BAG_0.mcap and BAG/metadata.yaml, as rosbag2 of Jazzy does.

What is in a finished chunk survives the end of the process however it comes; chunks are therefore
closed early, by size or by age.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
import time
from types import TracebackType
from typing import Literal, Self

from armid_ros import __version__
from armid_ros.errors import RecordingError
from armid_ros.recording.message_types import message_type, MessageType
from armid_ros.recording.metadata import bag_information, dump, write_metadata
from armid_ros.recording.qos import dump_qos_text, QosProfile
from armid_ros.recording.source import Topic
from mcap.writer import CompressionType, IndexType, Writer

Compression = Literal['zstd', 'lz4', 'none']

_COMPRESSIONS = {
    'zstd': CompressionType.ZSTD,
    'lz4': CompressionType.LZ4,
    'none': CompressionType.NONE,
}
# At 3 kHz of JointState, 1 MB/s, the age of a chunk closes it, not its size.
DEFAULT_CHUNK_SIZE = 512 * 1024
# Together with the time to write it out this keeps what a kill can lose below 0.3 s.
DEFAULT_CHUNK_AGE = 0.2
# An index of attachments would be empty, and mcap's checkers call that an error.
_INDEXES = IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA


class BagWriter:
    """
    Writes a bag; a context manager.

    The bag is complete, also on an exception, when the context ends: what was recorded before
    something went wrong is worth keeping.

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
        Create the directory and begin the file.

        Parameters
        ----------
        path : str or Path
            The directory to be made; it must not exist.
        chunk_size : int
            Bytes of messages after which a chunk is written out.
        chunk_age : float
            Time after which a chunk is written out when the next message comes [s].
        compression : {'zstd', 'lz4', 'none'}
            Of the chunks.
        clock : callable
            Time that ages chunks [s].

        Raises
        ------
        RecordingError
            The directory exists, or cannot be made.

        """
        self.path = Path(path)
        if compression not in _COMPRESSIONS:
            raise RecordingError(
                f"compression '{compression}' is not known; there are {', '.join(_COMPRESSIONS)}"
            )
        try:
            self.path.mkdir(parents=True)
        except FileExistsError as error:
            raise RecordingError(
                f'{self.path}: exists already; choose another name, or remove it'
            ) from error
        except OSError as error:
            raise RecordingError(f'{self.path}: cannot be made: {error.strerror}') from error
        self.file = self.path / f'{self.path.resolve().name}_0.mcap'
        self._chunk_size = chunk_size
        self._chunk_age = chunk_age
        self._clock = clock
        # Chunks are closed here, by flush(); mcap's own limit only guards against a huge message.
        self._stream = self.file.open('wb')
        self._mcap = Writer(
            self._stream,
            chunk_size=1 << 31,
            compression=_COMPRESSIONS[compression],
            index_types=_INDEXES,
        )
        self._mcap.start(profile='ros2', library=f'armid_ros {__version__}')
        self._topics: dict[str, Topic] = {}
        self._schemas: dict[MessageType, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._pending = 0
        self._opened = clock()
        self._start_ns, self._end_ns = 2**63 - 1, 0
        self._closed = False
        self._write_information(None)
        self.flush()

    def __enter__(self) -> Self:
        """Return the writer."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Complete the bag."""
        self.close()

    @property
    def message_count(self) -> int:
        """Number of messages written."""
        return sum(self._counts.values())

    def add_topic(
        self,
        name: str,
        type_name: str,
        *,
        qos: Sequence[QosProfile] = (),
        definition: str | None = None,
        type_hash: str | None = None,
        encoding: str = 'ros2msg',
    ) -> None:
        """
        Announce a topic; doing so again for the same type changes nothing.

        Parameters
        ----------
        name : str
            Such as '/joint_states'.
        type_name : str
            Such as 'sensor_msgs/msg/JointState'.
        qos : sequence of QosProfile
            What its publishers offer; by default one reliable, volatile publisher.
        definition : str, optional
            Text of the type's .msg file, with or without its dependencies; needed for types that
            are neither standard nor installed.
        type_hash : str, optional
            RIHS01 hash; given together with a definition, both are written as they are.
        encoding : {'ros2msg', 'ros2idl'}
            Language of such a definition.

        Raises
        ------
        RecordingError
            The topic has another type already, or its type is not known.

        """
        self._check_open()
        known = self._topics.get(name)
        if known is not None:
            if known.type_name != type_name:
                raise RecordingError(
                    f'{self.path}: {name} is a topic of {known.type_name} already, '
                    f'and cannot also be one of {type_name}'
                )
            return
        if definition is not None and type_hash is not None:
            described = MessageType(type_name, definition, encoding, type_hash)
        else:
            described = message_type(type_name, definition)
        topic = Topic(name, described, tuple(qos) or (QosProfile(),))
        if described not in self._schemas:
            self._schemas[described] = self._mcap.register_schema(
                described.name,
                described.encoding if described.definition else '',
                described.definition.encode(),
            )
        channel = self._mcap.register_channel(
            name,
            'cdr',
            self._schemas[described],
            {
                'offered_qos_profiles': dump_qos_text(topic.qos),
                'topic_type_hash': described.type_hash,
            },
        )
        self._topics[name] = topic
        self._channels[name] = channel
        self._counts[channel] = 0

    def write(
        self,
        topic: str,
        cdr: bytes | memoryview,
        log_time_ns: int,
        publish_time_ns: int | None = None,
    ) -> None:
        """
        Write one message.

        Parameters
        ----------
        topic : str
            A topic announced before.
        cdr : bytes
            The message, serialised.
        log_time_ns : int
            When it was received [ns].
        publish_time_ns : int, optional
            When it was sent [ns]; by default when it was received.

        Raises
        ------
        RecordingError
            The topic was not announced, or the bag is closed.

        """
        channel = self._channels.get(topic)
        if channel is None or self._closed:
            self._refuse(topic)
            return
        published = log_time_ns if publish_time_ns is None else publish_time_ns
        self._mcap.add_message(channel, log_time_ns, cdr, published)  # type: ignore[arg-type]
        self._counts[channel] += 1
        if log_time_ns < self._start_ns:
            self._start_ns = log_time_ns
        if log_time_ns > self._end_ns:
            self._end_ns = log_time_ns
        now = self._clock()
        if not self._pending:
            self._opened = now
        self._pending += len(cdr) + 31
        if self._pending >= self._chunk_size or now - self._opened >= self._chunk_age:
            self.flush()

    def flush(self) -> None:
        """Write out what is in memory; for a timer, should messages stop coming."""
        self._check_open()
        self._mcap.flush()
        self._pending = 0

    def close(self) -> None:
        """Complete the file, and write metadata.yaml; a closed bag stays as it is."""
        if self._closed:
            return
        self._mcap.flush()
        self._write_information(self.file.name)
        self._mcap.finish()
        self._stream.close()
        self._closed = True
        write_metadata(self.path, self._information(self.file.name))

    def _information(self, file_name: str | None) -> dict[str, object]:
        counted = [
            replace(topic, count=self._counts[self._channels[topic.name]])
            for topic in self._topics.values()
        ]
        return bag_information(counted, file_name, self._start_ns, self._end_ns)

    def _write_information(self, file_name: str | None) -> None:
        """Put into the file what rosbag2 puts there at its beginning and end."""
        text = dump(self._information(file_name))
        self._mcap.add_metadata('rosbag2', {'serialized_metadata': text})

    def _check_open(self) -> None:
        if self._closed:
            raise RecordingError(f'{self.path}: the bag is closed')

    def _refuse(self, topic: str) -> None:
        self._check_open()
        known = ', '.join(self._topics) or 'none'
        raise RecordingError(f"{self.path}: topic '{topic}' was not announced; there are {known}")
