# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags and results where they lie: a folder, an object store, or what else fsspec opens."""

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
    """A store did not answer, or not as it should: to be tried again."""


def opened(url: str) -> tuple[Any, str]:
    """
    Return the file system of a URL, and the path in it.

    Raises
    ------
    FleetError
        No file system goes by that name, or what opens it is not installed.

    """
    try:
        return fsspec.core.url_to_fs(url)  # type: ignore[no-any-return]
    except (ImportError, ValueError) as error:
        raise FleetError(f'{url}: {error}') from error


@contextmanager
def fetched(url: str) -> Iterator[str]:
    """
    Hold a bag as a path on this machine; a copy that is removed afterwards if it lies elsewhere.

    Raises
    ------
    RecordingError
        There is no such bag, or it must not be read.
    StoreError
        The store failed to deliver it.

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
            raise RecordingError(f'{url}: there is no such bag') from error
        except PermissionError as error:
            raise RecordingError(f'{url}: must not be read: {error}') from error
        except Exception as error:  # every store has errors of its own
            raise StoreError(f'{url}: {type(error).__name__}: {error}') from error
        yield here


@dataclass(frozen=True)
class Store:
    """
    A folder of results.

    Attributes
    ----------
    url : str
        As fsspec takes it.

    """

    url: str

    @cached_property
    def _place(self) -> tuple[Any, str]:
        filesystem, path = opened(self.url)
        return filesystem, path.rstrip('/')

    @property
    def local(self) -> Path | None:
        """Return the folder, where it is one of this machine."""
        filesystem, path = self._place
        return Path(path) if isinstance(filesystem, LocalFileSystem) else None

    def write(self, name: str, content: bytes | str) -> None:
        """
        Put a file in its place, whole or not at all.

        A local file is written next to its place and moved there; an object store shows an object
        when all of it has arrived.

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
        """Return a file; None if there is none."""
        filesystem, root = self._place
        try:
            return bytes(filesystem.cat_file(f'{root}/{name}'))
        except FileNotFoundError:
            return None
        except Exception as error:
            raise StoreError(f'{self.url}/{name}: {type(error).__name__}: {error}') from error

    def remove(self, name: str) -> None:
        """Remove a file, if there is one."""
        filesystem, root = self._place
        with suppress(FileNotFoundError):
            filesystem.rm_file(f'{root}/{name}')

    def names(self, pattern: str) -> list[str]:
        """Return the files below the folder that a pattern fits, sorted."""
        filesystem, root = self._place
        found = filesystem.glob(f'{root}/{pattern}')
        return sorted(path[len(root) + 1 :] for path in found)

    def write_table(self, name: str, table: pyarrow.Table) -> None:
        """Write a table as Parquet."""
        buffer = io.BytesIO()
        parquet.write_table(table, buffer, compression='zstd')
        self.write(name, buffer.getvalue())

    def read_table(self, name: str) -> pyarrow.Table | None:
        """Return a table; None if there is none."""
        data = self.read(name)
        return None if data is None else parquet.read_table(io.BytesIO(data))

    def data_set(self, name: str) -> pyarrow.Table | None:
        """Return all parts of a partitioned data set as one table; None if there are none."""
        filesystem, root = self._place
        if not filesystem.isdir(f'{root}/{name}'):
            return None
        return parquet.read_table(f'{root}/{name}', filesystem=filesystem, partitioning='hive')
