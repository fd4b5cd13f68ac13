# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read the messages of an SQLite storage file of rosbag2, of any ROS 2 distribution.

SQLite has no checksums. The structure of pages and the types of columns are checked. Changed bytes
inside a message cannot be detected.

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
import sqlite3
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.files import is_file
from armid_ros.recording.message_types import MessageType
from armid_ros.recording.metadata import parse_qos
from armid_ros.recording.source import (
    BLOCK_MESSAGES,
    DEFAULT,
    MessageBlock,
    RawMessage,
    ReadSettings,
    Source,
    Topic,
)
import numpy as np

_JOURNALS = ('-wal', '-journal')
# SQL condition for valid rows of the table of messages: an integer time and binary data.
_VALID_ROW = "typeof(timestamp) = 'integer' AND timestamp >= 0 AND typeof(data) = 'blob'"
_ERRORS = (sqlite3.Error, UnicodeDecodeError, OverflowError, MemoryError)


class SqliteSource(Source):
    """Reader of one SQLite storage file of rosbag2."""

    def __init__(self, path: Path, settings: ReadSettings = DEFAULT) -> None:
        """Open an SQLite storage file of rosbag2, and check it."""
        super().__init__(path, settings)
        # After a crash, SQLite has to replay the journal of the file, but 'immutable' ignores
        # the journal. Without a journal, 'immutable' also works in a read-only folder.
        journal = any(is_file(path.with_name(path.name + end)) for end in _JOURNALS)
        mode = 'mode=ro' if journal else 'immutable=1'
        try:
            self._database = sqlite3.connect(
                f'{path.resolve().as_uri()}?{mode}', uri=True, check_same_thread=False
            )
        except sqlite3.Error as error:
            raise RecordingError(f'{path}: cannot be opened by SQLite: {error}') from error
        try:
            self._columns = self._opened()
        except (*_ERRORS, RecordingError) as error:
            self._database.close()
            if isinstance(error, RecordingError):
                raise
            raise RecordingError(f'{path}: not an SQLite file of rosbag2: {error}') from error

    def close(self) -> None:
        self._database.close()

    def topics(self) -> tuple[Topic, ...]:
        optional = [
            name if name in self._columns['topics'] else "''"
            for name in ('offered_qos_profiles', 'type_description_hash')
        ]
        try:
            rows = self._database.execute(
                f'SELECT name, type, serialization_format, {", ".join(optional)}, '
                f'(SELECT count(*) FROM messages WHERE topic_id = topics.id AND {_VALID_ROW}) '
                'FROM topics ORDER BY id'
            ).fetchall()
            definitions: dict[str, tuple[str, str]] = {}
            wanted = ('topic_type', 'encoding', 'encoded_message_definition')
            if set(wanted) <= self._columns['message_definitions']:
                query = f'SELECT {", ".join(wanted)} FROM message_definitions'
                for texts in self._database.execute(query):
                    name, language, text = map(_text, texts)
                    definitions[name] = language, text
        except _ERRORS as error:
            raise RecordingError(f'{self._path}: the database is damaged: {error}') from error
        topics = []
        for *texts, count in rows:
            name, type_name, encoding, qos, type_hash = map(_text, texts)
            if not name:
                self._damage.add('a topic of the database has no name')
                continue
            language, text = definitions.get(type_name, ('', ''))
            described = MessageType(type_name, text, language, type_hash)
            topics.append(Topic(name, described, parse_qos(qos), count, encoding))
        return tuple(topics)

    def blocks(self, topic: str) -> Iterator[MessageBlock]:
        query = (
            'SELECT timestamp, data FROM messages WHERE topic_id IN '
            f'(SELECT id FROM topics WHERE CAST(name AS TEXT) = ?) AND {_VALID_ROW} ORDER BY id'
        )
        for rows in self._fetch(query, (topic,)):
            times = np.array([time for time, _ in rows], np.int64)
            yield MessageBlock.joined([data for _, data in rows], times, times)

    def messages(self) -> Iterator[RawMessage]:
        query = (
            'SELECT CAST(name AS TEXT), timestamp, data FROM messages JOIN topics '
            f'ON topic_id = topics.id WHERE {_VALID_ROW} ORDER BY timestamp, messages.id'
        )
        for rows in self._fetch(query, ()):
            for name, time, data in rows:
                yield RawMessage(_text(name), time, time, data)

    def _opened(self) -> dict[str, set[str]]:
        """Return the column names of the rosbag2 tables; RecordingError if a table is missing."""
        database = self._database
        database.text_factory = lambda text: text.decode('utf-8', 'replace')
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(self._settings.memory_limit, 2**31 - 1))
        with suppress(sqlite3.Error):  # old versions of SQLite lack this pragma
            database.execute('PRAGMA trusted_schema = OFF')
        # Only tables are read, as a view could run an endless computation.
        tables = {
            name
            for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        }
        columns = {
            table: {row[1] for row in database.execute(f'PRAGMA table_info({table})')}
            if table in tables
            else set()
            for table in ('topics', 'messages', 'message_definitions')
        }
        needed = (
            ('topics', {'id', 'name', 'type', 'serialization_format'}),
            ('messages', {'id', 'topic_id', 'timestamp', 'data'}),
        )
        for table, names in needed:
            if not names <= columns[table]:
                raise RecordingError(
                    f'{self._path}: the SQLite file is not of rosbag2: it has no table {table} '
                    f'with the columns {", ".join(sorted(names))}'
                )
        if self._settings.check_crc:
            self._check()
        return columns

    def _check(self) -> None:
        """Check pages and rows of the database, and report problems as damage."""
        (verdict,) = self._database.execute('PRAGMA quick_check(1)').fetchone()
        if verdict != 'ok':
            self._damage.add(f'the database is damaged: {" ".join(_text(verdict).split())}')
            return
        (odd,) = self._database.execute(
            f'SELECT count(*) FROM messages WHERE NOT ({_VALID_ROW}) OR timestamp IS NULL'
        ).fetchone()
        if odd:
            self._damage.add(f'{odd} rows of messages have no time or no bytes; they are left out')
        (lost,) = self._database.execute(
            'SELECT count(*) FROM messages WHERE topic_id IS NULL OR topic_id NOT IN '
            '(SELECT id FROM topics WHERE id IS NOT NULL)'
        ).fetchone()
        if lost:
            self._damage.add(f'{lost} rows of messages have no topic; they are left out')

    def _fetch(self, query: str, parameters: tuple[str, ...]) -> Iterator[list[tuple[Any, ...]]]:
        """Yield the rows of a query in batches, up to the first damaged row."""
        rows: list[tuple[Any, ...]] = []
        size = 0
        try:
            for row in self._database.execute(query, parameters):
                rows.append(row)
                size += len(row[-1])
                if len(rows) == BLOCK_MESSAGES or size > 8 << 20:
                    yield rows
                    rows, size = [], 0
        except _ERRORS as error:
            self._damage.add(f'the database is damaged: {error}')
        if rows:
            yield rows


def _text(value: object) -> str:
    return value if isinstance(value, str) else ''
