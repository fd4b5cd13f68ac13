# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of an SQLite file, as rosbag2 of any distribution writes it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import sqlite3
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.recording.message_types import MessageType
from armid_ros.recording.qos import parse_qos
from armid_ros.recording.source import Block, RawMessage, Topic
import numpy as np

_BLOCK_MESSAGES = 4096


class SqliteSource:
    """One SQLite file."""

    def __init__(self, path: Path) -> None:
        """
        Open a file, for reading only.

        Raises
        ------
        RecordingError
            It cannot be read, or is no rosbag2 file.

        """
        self._path = path
        self._damage = ''
        try:
            path.open('rb').close()
            # A file left behind by a crash has a journal beside it that SQLite must play back;
            # 'immutable' would ignore it, and works where the folder cannot be written to.
            journal = any(path.with_name(path.name + end).exists() for end in ('-wal', '-journal'))
            mode = 'mode=ro' if journal else 'immutable=1'
            self._database = sqlite3.connect(
                f'{path.resolve().as_uri()}?{mode}', uri=True, check_same_thread=False
            )
            columns = {
                table: {row[1] for row in self._database.execute(f'PRAGMA table_info({table})')}
                for table in ('topics', 'messages', 'message_definitions')
            }
        except OSError as error:
            raise RecordingError(f'{path}: cannot be read: {error.strerror}') from error
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise RecordingError(f'{path}: not an SQLite file of rosbag2: {error}') from error
        if not columns['topics'] or not columns['messages']:
            self._database.close()
            raise RecordingError(
                f'{path}: an SQLite file, but not of rosbag2: it has no topics and messages'
            )
        self._columns = columns

    @property
    def damage(self) -> str:
        """What is wrong with the file, as far as it was read; empty for a whole one."""
        return self._damage

    def close(self) -> None:
        """Let go of the file."""
        self._database.close()

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics, in order of appearance."""
        optional = [
            name if name in self._columns['topics'] else "''"
            for name in ('offered_qos_profiles', 'type_description_hash')
        ]
        try:
            definitions = {}
            if self._columns['message_definitions']:
                definitions = {
                    name: (encoding, text)
                    for name, encoding, text in self._database.execute(
                        'SELECT topic_type, encoding, encoded_message_definition '
                        'FROM message_definitions'
                    )
                }
            rows = self._database.execute(
                f'SELECT name, type, serialization_format, {", ".join(optional)}, '
                '(SELECT count(*) FROM messages WHERE topic_id = topics.id) '
                'FROM topics ORDER BY id'
            ).fetchall()
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise RecordingError(f'{self._path}: the database is damaged: {error}') from error
        topics = []
        for name, type_name, encoding, qos, type_hash, count in rows:
            language, text = definitions.get(type_name, ('', ''))
            described = MessageType(type_name, text, language, type_hash)
            topics.append(Topic(name, described, parse_qos(qos), count, encoding))
        return tuple(topics)

    def blocks(self, topic: str) -> Iterator[Block]:
        """Yield the messages of a topic, in the order they are stored."""
        query = (
            'SELECT timestamp, data FROM messages WHERE topic_id IN '
            '(SELECT id FROM topics WHERE name = ?) ORDER BY id'
        )
        for rows in self._fetch(query, (topic,)):
            times = np.array([time for time, _ in rows], np.int64)
            length = np.array([len(data) for _, data in rows], np.int64)
            data = b''.join([data for _, data in rows])
            yield Block(data, np.cumsum(length) - length, length, times, times)

    def messages(self) -> Iterator[RawMessage]:
        """Yield all messages in the order they were logged."""
        query = (
            'SELECT name, timestamp, data FROM messages JOIN topics ON topic_id = topics.id '
            'ORDER BY timestamp, messages.id'
        )
        for rows in self._fetch(query, ()):
            for name, time, data in rows:
                yield RawMessage(name, time, time, bytes(data))

    def _fetch(self, query: str, parameters: tuple[str, ...]) -> Iterator[list[tuple[Any, ...]]]:
        """Yield rows by the thousand, up to where the database is damaged."""
        try:
            cursor = self._database.execute(query, parameters)
            while rows := cursor.fetchmany(_BLOCK_MESSAGES):
                yield rows
        except (sqlite3.Error, UnicodeDecodeError) as error:
            self._damage = f'the database is damaged: {error}'
