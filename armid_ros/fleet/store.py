# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Access to bags and results in a local folder, an object store, or any store of fsspec."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
import io
from pathlib import Path
import tempfile
from typing import Any

from armid_ros.errors import FleetError, RecordingError
from armid_ros.files import write_file
import fsspec
from fsspec.implementations.local import LocalFileSystem
import pyarrow
from pyarrow import parquet


class StoreError(Exception):
    """Failed access to a file store, or an invalid answer; the operation can be repeated."""


def opened(url: str) -> tuple[Any, str]:
    """
    Return the file system of a URL (fsspec), and the path in this file system.

    Raises
    ------
    FleetError
        If the file system is unknown, or its package is not installed.

    """
    try:
        return fsspec.core.url_to_fs(url)  # type: ignore[no-any-return]
    except (ImportError, ValueError) as error:
        raise FleetError(f'{url}: {error}') from error


@contextmanager
def fetched(url: str) -> Iterator[str]:
    """
    Yield the local path of a bag; copy a remote bag first, and delete the copy at the end.

    Raises
    ------
    RecordingError
        If there is no such bag, or the permission to read it is missing.
    StoreError
        If the store did not deliver the bag.

    """
    filesystem, path = opened(url)
    if isinstance(filesystem, LocalFileSystem):
        yield path
        return
    with tempfile.TemporaryDirectory(prefix='armid-bag-') as folder:
        here = str(Path(folder, path.rstrip('/').rsplit('/', 1)[-1]))
        try:
            filesystem.get(path, here, recursive=filesystem.isdir(path))
        except FileNotFoundError as error:
            raise RecordingError(f'{url}: the bag does not exist') from error
        except PermissionError as error:
            raise RecordingError(f'{url}: no permission to read: {error}') from error
        except Exception as error:  # stores raise different exceptions
            raise StoreError(f'{url}: {type(error).__name__}: {error}') from error
        yield here


@dataclass(frozen=True)
class Store:
    """
    Folder of results in a local or remote file system.

    Attributes
    ----------
    url : str
        URL of the folder, in the syntax of fsspec.

    """

    url: str

    @cached_property
    def _place(self) -> tuple[Any, str]:
        filesystem, path = opened(self.url)
        return filesystem, path.rstrip('/')

    @property
    def local(self) -> Path | None:
        """Path of the folder if the folder is on this machine; None for a remote folder."""
        filesystem, path = self._place
        return Path(path) if isinstance(filesystem, LocalFileSystem) else None

    def write(self, name: str, content: bytes | str) -> None:
        """
        Write a file, completely or not at all.

        A local file is written under a temporary name and then renamed. An object store shows an
        object only when its upload is complete.

        """
        filesystem, root = self._place
        data = content.encode() if isinstance(content, str) else content
        if self.local is not None:
            path = Path(root, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_file(path, data)
            return
        try:
            filesystem.pipe_file(f'{root}/{name}', data)
        except Exception as error:
            raise StoreError(f'{self.url}/{name}: {type(error).__name__}: {error}') from error

    def read(self, name: str) -> bytes | None:
        """Return the content of a file; None if the file does not exist."""
        filesystem, root = self._place
        try:
            return bytes(filesystem.cat_file(f'{root}/{name}'))
        except FileNotFoundError:
            return None
        except Exception as error:
            raise StoreError(f'{self.url}/{name}: {type(error).__name__}: {error}') from error

    def remove(self, name: str) -> None:
        """Remove a file, if the file exists."""
        filesystem, root = self._place
        with suppress(FileNotFoundError):
            filesystem.rm_file(f'{root}/{name}')

    def names(self, pattern: str) -> list[str]:
        """Return the sorted names of the files in the folder that match a pattern."""
        filesystem, root = self._place
        found = filesystem.glob(f'{root}/{pattern}')
        return sorted(path[len(root) + 1 :] for path in found)

    def write_table(self, name: str, table: pyarrow.Table) -> None:
        """Write a table as a Parquet file."""
        buffer = io.BytesIO()
        parquet.write_table(table, buffer, compression='zstd')
        self.write(name, buffer.getvalue())

    def read_table(self, name: str) -> pyarrow.Table | None:
        """Return the table in a Parquet file; None if the file does not exist."""
        data = self.read(name)
        return None if data is None else parquet.read_table(io.BytesIO(data))

    def data_set(self, name: str) -> pyarrow.Table | None:
        """Return a partitioned data set as a single table; None if it does not exist."""
        filesystem, root = self._place
        if not filesystem.isdir(f'{root}/{name}'):
            return None
        return parquet.read_table(f'{root}/{name}', filesystem=filesystem, partitioning='hive')
