# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Open a bag, which is a file or a directory, and read its topics and messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from dataclasses import replace
import heapq
import io
import os
from pathlib import Path
import re
import tempfile
from typing import Any, Self

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular, reading
from armid_ros.recording.compression import unpacked, ZSTD
from armid_ros.recording.mcap.source import McapSource
from armid_ros.recording.message_types import store_for
from armid_ros.recording.metadata import BagMetadata, FILE_NAME, read_metadata
from armid_ros.recording.source import (
    Damage,
    DEFAULT,
    listed,
    MessageBlock,
    RawMessage,
    ReadSettings,
    Source,
    Topic,
)
from armid_ros.recording.sqlite_source import SqliteSource

_STORAGES: dict[str, type[Source]] = {'.mcap': McapSource, '.db3': SqliteSource}
_COMPRESSED = ('.zstd', '.zst')


class Bag(Source):
    """Reader for all storage files of one bag, to be used in a `with` statement."""

    def __init__(self, path: str | Path, settings: ReadSettings = DEFAULT) -> None:
        """
        Open all storage files of a bag.

        Parameters
        ----------
        path : str or Path
            A rosbag2 directory, a file .mcap, .db3, .mcap.zstd or .db3.zstd, or a .bag of ROS 1.
        settings : ReadSettings
            Checks of the storage files, and the memory limit.

        Raises
        ------
        RecordingError
            If the path is not a readable bag.

        """
        self.path = Path(path)
        self._settings = settings
        self._stack = contextlib.ExitStack()
        self._damage = Damage()
        try:
            self._metadata = _files_of(self.path)
        except OSError as error:
            raise RecordingError(f'{self.path}: cannot be read: {error.strerror}') from error
        try:
            self._sources = [self._open(file) for file in self._metadata.files]
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self) -> Self:
        """Return the open bag."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the storage files of the bag."""
        self.close()

    @property
    def damage(self) -> str:
        """Description of the damage that was found so far; empty without damage."""
        problems = (*(source.damage for source in self._sources), str(self._damage))
        return '; '.join(dict.fromkeys(filter(None, problems)))

    def close(self) -> None:
        """Close the storage files, and delete their decompressed copies."""
        self._stack.close()

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics of the bag in order of appearance, with counts over all files."""
        merged: dict[str, Topic] = {}
        with reading(self.path, RecordingError):
            for source in self._sources:
                for topic in source.topics():
                    known = merged.get(topic.name)
                    count = topic.count + (known.count if known else 0)
                    described = known if known and known.message_type.definition else topic
                    merged[topic.name] = replace(described, count=count)
        for name, count in self._metadata.counts.items():
            if count and name not in merged:
                self._damage.add(
                    f'{FILE_NAME} states {count} messages of {name}, but the files have none'
                )
        return tuple(merged.values())

    def topic_of(
        self,
        type_name: str,
        wanted: str | None = None,
        fits: Callable[[Topic], bool] | None = None,
    ) -> Topic:
        """
        Return the topic `wanted`, or by default the only topic of a message type.

        Raises
        ------
        RecordingError
            If no topic, or more than one topic, fits.

        """
        name = None if wanted is None else '/' + wanted.lstrip('/')
        topics = self.topics()
        found = [
            topic
            for topic in topics
            if (topic.type_name == type_name if fits is None else fits(topic))
            and name in (None, '/' + topic.name.lstrip('/'))
        ]
        if len(found) == 1:
            return found[0]
        called = f' and name {wanted}' if wanted else ''
        damage = f' ({self.damage})' if self.damage else ''
        if damage and not topics:
            raise RecordingError(f'{self.path}: no message can be read; record again{damage}')
        raise RecordingError(
            f'{self.path}: the bag has {len(found)} topics of type {type_name}{called}, but one '
            f'is needed; its topics are {listed(topics)}{damage}'
        )

    def blocks(self, topic: str) -> Iterator[MessageBlock]:
        """Yield the messages of a topic in blocks, decompressed and in the order of storage."""
        count = 0
        with reading(self.path, RecordingError):
            for source in self._sources:
                for block in source.blocks(topic):
                    count += len(block)
                    if block.message(0)[:4] == ZSTD:
                        messages, size = list[bytes](), 0
                        for at in range(len(block)):
                            messages.append(self._content(block.message(at)))
                            size += len(messages[-1])
                            self._settings.require(size, 'a block of messages')
                        block = MessageBlock.joined(messages, block.log_time, block.publish_time)
                    yield block
        expected = self._metadata.counts.get(topic, count)
        if count != expected:
            self._damage.add(
                f'{FILE_NAME} states {expected} messages of {topic}, but the files have {count}'
            )

    def decoded(self, topic: Topic, cdr: bytes) -> Any:
        """Decode a CDR message of a topic; RecordingError if the message is damaged."""
        store = store_for(topic.message_type)
        try:
            return store.deserialize_cdr(cdr, topic.type_name)
        except Exception as error:  # damaged messages cause exceptions of any class
            raise RecordingError(
                f'{self.path}: {topic.name}: a message cannot be decoded: {error}'
            ) from error

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages of all topics in the order of their log times."""
        streams = [source.messages() for source in self._sources]  # few chunks are in memory
        with reading(self.path, RecordingError):
            for message in heapq.merge(*streams, key=lambda message: message.log_time_ns):
                cdr = self._content(message.cdr)
                yield message if cdr is message.cdr else message._replace(cdr=cdr)

    def _content(self, message: bytes) -> bytes:
        """Return the content of a message, decompressed if rosbag2 compressed each message."""
        if message[:4] != ZSTD:
            return message
        return b''.join(unpacked(io.BytesIO(message), self._settings, 'a compressed message'))

    def _open(self, file: Path) -> Source:
        """Open one storage file of the bag; decompress it into a temporary file if needed."""
        storage = _STORAGES.get(_storage_suffix(file))
        if storage is None:  # late import, as it takes as long as reading a bag
            from armid_ros.recording.ros1_source import Ros1Source

            storage = Ros1Source
        with reading(file, RecordingError):
            if file.suffix in _COMPRESSED:  # closing the stack deletes the temporary file
                folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix='armid-'))
                plain = Path(folder, file.stem)
                try:
                    with open_regular(file, RecordingError) as packed, plain.open('wb') as stream:
                        stream.writelines(unpacked(packed, self._settings, 'the unpacked file'))
                except OSError as error:
                    problem = f'{file}: cannot be decompressed: {error.strerror}'
                    raise RecordingError(problem) from error
            else:
                plain = file
            source: Source = storage(plain, self._settings)
        self._stack.callback(source.close)
        return source


def _storage_suffix(file: Path) -> str:
    """Return the suffix of a storage file, such as '.mcap' for BAG_0.mcap.zstd."""
    return Path(file.stem).suffix if file.suffix in _COMPRESSED else file.suffix


def is_bag_file(path: Path) -> bool:
    """Return whether a path has the suffix of a storage file of a ROS 2 or ROS 1 bag."""
    return _storage_suffix(path) in _STORAGES or path.suffix.lower() == '.bag'


def _files_of(path: Path) -> BagMetadata:
    """Return the metadata of a bag; without metadata.yaml, only the list of its storage files."""
    if not os.path.lexists(path):
        raise RecordingError(f'{path}: there is no bag or file at this path')
    if not path.is_dir():
        if not is_bag_file(path):
            raise RecordingError(
                f'{path}: the file is not a recording; give a rosbag2 directory, a file .mcap, '
                '.db3 or .bag, or a table .csv, .tsv, .txt, .dat, .npy, .npz, .mat, .h5, .hdf5 or '
                '.parquet'
            )
        return BagMetadata((path,))
    if os.path.lexists(path / FILE_NAME):
        metadata = read_metadata(path)
        files = list(metadata.files)
        foreign = [file.name for file in files if _storage_suffix(file) not in _STORAGES]
        if foreign or not files:
            raise RecordingError(
                f'{path / FILE_NAME}: lists {", ".join(foreign) or "no file"}, but only .mcap and '
                '.db3 files can be read'
            )
        return metadata
    found = [file for file in path.iterdir() if _storage_suffix(file) in _STORAGES]
    if not found:
        below = sorted({str(f.parent) for s in _STORAGES for f in path.glob(f'*/*{s}*')})
        hint = f'; there are bags in {", ".join(below)}' if below else ''
        raise RecordingError(
            f'{path}: the directory is not a bag: it has no {FILE_NAME} and no .mcap or .db3 '
            f'file{hint}'
        )
    if len({_storage_suffix(file) for file in found}) > 1:
        raise RecordingError(
            f'{path}: the directory has .mcap and .db3 files, but no {FILE_NAME} that lists the '
            f'files of one bag; give one of {", ".join(sorted(file.name for file in found))}'
        )
    # numeric order: BAG_2.mcap comes before BAG_10.mcap
    found.sort(key=lambda file: re.sub(r'\d+', lambda number: number[0].zfill(20), file.name))
    return BagMetadata(tuple(found))
