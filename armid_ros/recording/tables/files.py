# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the reader of a table file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.tables.arrays import read_hdf5, read_matlab, read_numpy
from armid_ros.recording.tables.messages import settled
from armid_ros.recording.tables.parquet import INFO, read_lerobot, read_parquet
from armid_ros.recording.tables.table import Table
from armid_ros.recording.tables.text import read_text

_READERS: dict[str, Callable[[Path], Table]] = {
    '.csv': read_text,
    '.tsv': read_text,
    '.txt': read_text,
    '.dat': read_text,
    '.npy': read_numpy,
    '.npz': read_numpy,
    '.mat': read_matlab,
    '.h5': read_hdf5,
    '.hdf5': read_hdf5,
    '.parquet': read_parquet,
}


def is_table(path: Path) -> bool:
    """Return whether a path is a LeRobot dataset, or has the name of a table."""
    return _suffix(path) in _READERS or (path / INFO).is_file()


def open_table(path: Path, *, episode: int | None = None) -> Table:
    """
    Read a table.

    Parameters
    ----------
    path : Path
        CSV (also with semicolons, tabs, blanks; .gz too), NPY, NPZ, MAT, HDF5, Parquet, or the
        folder of a LeRobot dataset.
    episode : int, optional
        Episode of a LeRobot dataset; the first by default.

    Raises
    ------
    RecordingError
        If the file does not exist, has no reader, or is not a table.

    """
    if not path.exists():
        raise RecordingError(f'{path}: there is no such file')
    lerobot = (path / INFO).is_file()
    if not lerobot and _suffix(path) not in _READERS:
        known = ', '.join(_READERS)
        raise RecordingError(f'{path}: no table; tables are {known} and LeRobot datasets')
    if not lerobot:
        with open_regular(path, RecordingError):  # opening a FIFO would block
            pass
    try:
        return settled(read_lerobot(path, episode) if lerobot else _READERS[_suffix(path)](path))
    except RecordingError:
        raise
    except Exception as problem:  # the libraries raise arbitrary exceptions
        said = ' '.join(str(problem).split())[:500]
        raise RecordingError(
            f'{path}: cannot be read, it may be damaged: {type(problem).__name__}: {said}'
        ) from problem


def _suffix(path: Path) -> str:
    return Path(path.stem).suffix.lower() if path.suffix == '.gz' else path.suffix.lower()
