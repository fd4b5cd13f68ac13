# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables are read from files, of which the packed ones have a limit."""

from dataclasses import replace
import gzip

from armid_ros.errors import RecordingError
from armid_ros.recording.settings import DEFAULT
from armid_ros.recording.tables import open_table, table
import pytest


def test_what_is_packed_has_a_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(table, 'DEFAULT', replace(DEFAULT, memory_limit=1_000_000))
    path = tmp_path / 'bomb.csv.gz'
    path.write_bytes(gzip.compress(b'0,' * 10_000_000))
    with pytest.raises(RecordingError, match=r'bomb.csv.gz: the decompressed content takes'):
        open_table(path)


def test_what_is_no_gzip_is_said(tmp_path):
    path = tmp_path / 'wrong.csv.gz'
    path.write_bytes(b'a,b\n1,2\n')
    with pytest.raises(RecordingError, match=r'wrong.csv.gz: cannot be unpacked'):
        open_table(path)


@pytest.mark.parametrize(
    ('content', 'said'),
    [
        (b'', 'the file is empty'),
        (b'\n \n', 'the file is empty'),
        ('t,q\n0,1\n'.encode('utf-32'), 'is no text, but binary; name the file with the ending'),
        (b'\x93NUMPY\x01\x00v\x00', 'is no text, but binary; name the file with the ending'),
        (b'\xff\xfe\x00\xd8\x00\xd8', 'is no text, but binary; name the file with the ending'),
        (b'hello\nworld\n', 'no line of numbers in 2 lines; a table has one row a line'),
    ],
)
def test_what_is_no_table_in_text_is_said_with_what_to_do(tmp_path, content, said):
    path = tmp_path / 'log.csv'
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=f'^{path}: {said}'):
        open_table(path)
