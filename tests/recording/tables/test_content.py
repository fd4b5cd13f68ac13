# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables are read from files, of which the packed ones have a limit."""

from dataclasses import replace
import gzip

from armid_ros.errors import RecordingError
from armid_ros.recording.source import DEFAULT
from armid_ros.recording.tables import open_table, table
import pytest


def test_what_is_packed_has_a_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(table, 'DEFAULT', replace(DEFAULT, memory_limit=1_000_000))
    path = tmp_path / 'bomb.csv.gz'
    path.write_bytes(gzip.compress(b'0,' * 10_000_000))
    with pytest.raises(RecordingError, match=r'bomb.csv.gz: '):
        open_table(path)


@pytest.mark.parametrize(
    ('name', 'content', 'fact'),
    [
        ('log.csv', b'', 'empty'),
        ('log.csv', b'\n \n', 'empty'),
        ('log.csv', 't,q\n0,1\n'.encode('utf-32'), 'binary'),
        ('log.csv', b'\x93NUMPY\x01\x00v\x00', 'binary'),
        ('log.csv', b'\xff\xfe\x00\xd8\x00\xd8', 'binary'),
        ('log.csv', b'hello\nworld\n', '2 lines'),
        ('log.csv.gz', b'a,b\n1,2\n', 'unpacked'),
        ('log.xlsx', b'', r'\.csv'),
    ],
)
def test_what_is_no_table_is_refused_with_its_kind(tmp_path, name, content, fact):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=f'^{path}: .*{fact}'):
        open_table(path)
