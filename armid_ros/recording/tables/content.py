# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The bytes of a table, unpacked where it is a .gz, and the libraries that some formats need."""

from __future__ import annotations

import gzip
from importlib import import_module
import os
from pathlib import Path
from typing import Any
import zlib

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.settings import DEFAULT


def read_content(path: Path) -> bytes:
    """
    Return the content of a file.

    Raises
    ------
    RecordingError
        It is no regular file, takes too much memory, or is no gzip where its name says so.

    """
    limit = DEFAULT.memory_limit
    with open_regular(path, RecordingError) as stream:
        DEFAULT.require(os.fstat(stream.fileno()).st_size, f'{path}: the file')
        if path.suffix != '.gz':
            return stream.read()
        try:
            with gzip.GzipFile(fileobj=stream) as packed:
                content = packed.read(limit + 1)
        except (OSError, EOFError, zlib.error) as error:
            raise RecordingError(f'{path}: cannot be unpacked: {error}') from error
    DEFAULT.require(len(content), f'{path}: what is packed in it')
    return content


def imported(library: str, path: Path, format_name: str) -> Any:
    """Import a library; RecordingError says how to install it."""
    try:
        return import_module(library)
    except ImportError:
        raise RecordingError(
            f'{path}: {format_name} is read by {library.split(".")[0]}, which is not installed: '
            "pip install 'armid_ros[convert]'"
        ) from None
