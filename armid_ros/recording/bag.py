# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A bag as one source of messages: a directory of files with or without metadata, or a bare file.

Files may be MCAP or SQLite, several of them, and compressed by rosbag2 as a whole or message by
message.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from dataclasses import dataclass, replace
import heapq
from pathlib import Path
import re
import shutil
import tempfile
from types import TracebackType
from typing import Self

from armid_ros.errors import RecordingError
from armid_ros.recording.mcap_source import McapSource
from armid_ros.recording.metadata import FILE_NAME, read_metadata
from armid_ros.recording.source import Block, RawMessage, Source, Topic
from armid_ros.recording.sqlite_source import SqliteSource
import numpy as np
import zstandard

_STORAGES: dict[str, Callable[[Path], Source]] = {'.mcap': McapSource, '.db3': SqliteSource}
_COMPRESSED = '.zstd'


def topics(path: str | Path) -> tuple[Topic, ...]:
    """
    Return the topics of a bag, with types, definitions, QoS and counts.

    Raises
    ------
    RecordingError
        There is no bag that can be read.

    """
    with Bag(path) as bag:
        return bag.topics()


def iter_raw(path: str | Path) -> Iterator[RawMessage]:
    """
    Yield all messages of a bag in the order they were logged, as raw CDR.

    Only a few chunks are in memory at a time.

    Raises
    ------
    RecordingError
        There is no bag that can be read.

    """
    with Bag(path) as bag:
        yield from bag.messages()


class Bag:
    """All files of a bag, as one source; a context manager."""

    def __init__(self, path: str | Path) -> None:
        """
        Open a bag.

        Parameters
        ----------
        path : str or Path
            A rosbag2 directory, or a file .mcap, .db3, .mcap.zstd or .db3.zstd.

        Raises
        ------
        RecordingError
            There is no bag that can be read.

        """
        self.path = Path(path)
        self._stack = contextlib.ExitStack()
        files, mode = _files_of(self.path)
        self._by_message = mode == 'message'
        try:
            self._sources = [self._open(file) for file in files]
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self) -> Self:
        """Return the bag."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the files."""
        self.close()

    @property
    def damage(self) -> str:
        """What is wrong with the files, as far as they were read; empty for a whole bag."""
        return '; '.join(dict.fromkeys(s.damage for s in self._sources if s.damage))

    def close(self) -> None:
        """Let go of the files."""
        self._stack.close()

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics, in order of appearance."""
        merged: dict[str, Topic] = {}
        for source in self._sources:
            for topic in source.topics():
                known = merged.get(topic.name)
                count = topic.count + (known.count if known else 0)
                described = known if known and known.message_type.definition else topic
                merged[topic.name] = replace(described, count=count)
        return tuple(merged.values())

    def blocks(self, topic: str) -> Iterator[Block]:
        """Yield the messages of a topic, in the order they are stored."""
        for source in self._sources:
            for block in source.blocks(topic):
                yield _decompressed(block, self.path) if self._by_message else block

    def messages(self) -> Iterator[RawMessage]:
        """Yield all messages in the order they were logged."""
        streams = [source.messages() for source in self._sources]
        for message in heapq.merge(*streams, key=lambda message: message.log_time_ns):
            if self._by_message:
                yield message._replace(cdr=_decompress(message.cdr, self.path))
            else:
                yield message

    def _open(self, file: Path) -> Source:
        """Open one file."""
        storage = _STORAGES[_storage_suffix(file)]
        source: Source = storage(self._unpacked(file) if file.suffix == _COMPRESSED else file)
        self._stack.callback(source.close)
        return source

    def _unpacked(self, file: Path) -> Path:
        """Decompress a file to a temporary one, which is removed when the bag is closed."""
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix='armid-'))
        unpacked = Path(folder, file.stem)
        try:
            with file.open('rb') as packed, unpacked.open('wb') as stream:
                with zstandard.ZstdDecompressor().stream_reader(packed) as content:
                    shutil.copyfileobj(content, stream, 1 << 20)
        except OSError as error:
            raise RecordingError(f'{file}: cannot be decompressed: {error.strerror}') from error
        except zstandard.ZstdError as error:
            raise RecordingError(f'{file}: the compressed file is damaged: {error}') from error
        return unpacked


@dataclass(frozen=True)
class _Part:
    """Sorts BAG_2.mcap before BAG_10.mcap."""

    file: Path

    def key(self) -> tuple[tuple[int, str], ...]:
        pieces = re.split(r'(\d+)', self.file.name)
        return tuple((int(p), '') if p.isdigit() else (-1, p) for p in pieces)


def _storage_suffix(file: Path) -> str:
    """Return '.mcap', '.db3', or what else a file is called."""
    return Path(file.stem).suffix if file.suffix == _COMPRESSED else file.suffix


def _files_of(path: Path) -> tuple[list[Path], str]:
    """Return the files of a bag and how rosbag2 compressed them."""
    if not path.exists():
        raise RecordingError(f'{path}: there is no such bag')
    if not path.is_dir():
        if _storage_suffix(path) not in _STORAGES:
            raise RecordingError(
                f'{path}: not a bag; give a rosbag2 directory, or a file .mcap or .db3'
            )
        return [path], ''
    if (path / FILE_NAME).exists():
        metadata = read_metadata(path)
        files = list(metadata.files)
        odd = [file.name for file in files if _storage_suffix(file) not in _STORAGES]
        if odd or not files:
            raise RecordingError(
                f'{path / FILE_NAME}: names {", ".join(odd) or "no file"}; '
                'a bag consists of .mcap or .db3 files'
            )
        return files, metadata.compression_mode
    found = [file for file in path.iterdir() if _storage_suffix(file) in _STORAGES]
    if not found:
        below = sorted({str(f.parent) for s in _STORAGES for f in path.glob(f'*/*{s}*')})
        hint = f'; there are bags in {", ".join(below)}' if below else ''
        raise RecordingError(f'{path}: a directory without {FILE_NAME}, .mcap or .db3{hint}')
    if len({_storage_suffix(file) for file in found}) > 1:
        raise RecordingError(
            f'{path}: holds both .mcap and .db3 files and no {FILE_NAME} that says which are the '
            f'bag; give one of {", ".join(sorted(file.name for file in found))}'
        )
    return sorted(found, key=lambda file: _Part(file).key()), ''


def _decompress(data: bytes, path: Path) -> bytes:
    """Decompress one message."""
    try:
        # Not every writer puts the size of the content into the frame.
        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    except zstandard.ZstdError as error:
        raise RecordingError(f'{path}: a compressed message is damaged: {error}') from error


def _decompressed(block: Block, path: Path) -> Block:
    """Return a block with its messages decompressed."""
    messages = [_decompress(block.message(at), path) for at in range(len(block))]
    length = np.array([len(message) for message in messages], np.int64)
    return Block(
        b''.join(messages), np.cumsum(length) - length, length, block.log_time, block.publish_time
    )
