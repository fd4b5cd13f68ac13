# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Choose the reader for a table file."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
import re

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.recording.tables.arrays import (
    INFO,
    read_hdf5,
    read_lerobot,
    read_matlab,
    read_numpy,
    read_parquet,
)
from armid_ros.recording.tables.families import TIMES, words_of
from armid_ros.recording.tables.table import Table, TableColumn
from armid_ros.recording.tables.text import read_text
import numpy as np
import numpy.typing as npt

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
_NAME = re.compile(r'(.*?)(?:joint_)?names?[\[_.]?(\d+)\]?', re.IGNORECASE)
_NUMBERED = re.compile(r'(.*?)[\[_.]?(\d+)\]?')
_SECONDS = re.compile(r'(.*?)(?:s|secs?|seconds)', re.IGNORECASE)
_NANOSECONDS = re.compile(r'(.*?)(?:ns|nsecs?|nanosecs?|nanoseconds)', re.IGNORECASE)


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
        table = read_lerobot(path, episode) if lerobot else _READERS[_suffix(path)](path)
        return _with_stamps(_with_dates(_with_names(table)))
    except RecordingError:
        raise
    except Exception as problem:  # libraries may raise any exception
        said = ' '.join(str(problem).split())[:500]
        raise RecordingError(
            f'{path}: cannot be read, it may be damaged: {type(problem).__name__}: {said}'
        ) from problem


def _suffix(path: Path) -> str:
    return Path(path.stem).suffix.lower() if path.suffix == '.gz' else path.suffix.lower()


def _with_names(table: Table) -> Table:
    """Name columns by the joints in cells; their order may change between rows."""
    names: dict[str, dict[str, npt.NDArray[np.str_]]] = {}  # by what precedes 'name', and number
    for name, cells in table.words.items():
        match = _NAME.fullmatch(name)
        if match and len(cells):
            names.setdefault(match[1], {})[match[2]] = np.array(cells)
    for prefix, named in names.items():
        values: dict[str, dict[str, TableColumn]] = {}
        for column in table.columns:
            match = _NUMBERED.fullmatch(column.name)
            if match and match[1].startswith(prefix) and match[2] in named:
                values.setdefault(match[1], {})[match[2]] = column
        said = np.array(list(named.values()))
        joints = [joint for joint in dict.fromkeys([*said[:, 0], *np.unique(said)]) if joint]
        apart: list[TableColumn] = []
        taken: list[TableColumn] = []
        for key, columns in values.items():
            if columns.keys() != named.keys():
                continue
            taken += columns.values()
            numbers = np.array([columns[number].values for number in named])
            for joint in joints:
                own = said == joint
                of_joint = np.where(own, numbers, 0.0).sum(axis=0)
                of_joint[~own.any(axis=0)] = np.nan
                apart.append(TableColumn(f'{key}[{joint}]', of_joint, key))
        rest = [column for column in table.columns if column not in taken]
        table = replace(table, columns=(*rest, *apart))
    return table


def _with_dates(table: Table) -> Table:
    """Read columns of dates as seconds since 1970."""
    dates: dict[str, TableColumn] = {}
    for name, cells in table.words.items():
        if len(cells) and cells[0][:4].isdigit():
            with suppress(ValueError):
                seconds = [datetime.fromisoformat(cell).timestamp() for cell in cells]
                dates[name] = TableColumn(name, np.array(seconds), unit='s')
    words = {name: cells for name, cells in table.words.items() if name not in dates}
    return replace(table, columns=(*table.columns, *dates.values()), words=words)


def _with_stamps(table: Table) -> Table:
    """Merge seconds and nanoseconds of a stamp into one column."""
    arrays: dict[str, list[TableColumn]] = {}
    for column in table.columns:
        if column.array and any(word in TIMES for word in words_of(column.array)):
            arrays.setdefault(column.array, []).append(column)
    pairs = [(two[0], two[1], name) for name, two in arrays.items() if len(two) == 2]
    starts = {
        match[1]: column for column in table.columns if (match := _SECONDS.fullmatch(column.name))
    }
    for column in table.columns:
        match = _NANOSECONDS.fullmatch(column.name)
        if match and match[1] in starts:
            pairs.append((starts[match[1]], column, match[1].strip(' ._/') or 'time'))
    for seconds, nanoseconds, name in pairs:
        finite = nanoseconds.values[np.isfinite(nanoseconds.values)]
        whole = np.all(finite == np.rint(finite)) and np.all((finite >= 0.0) & (finite < 1e9))
        if not whole or not np.any(finite):
            continue
        stamp = TableColumn(name, seconds.values + 1e-9 * nanoseconds.values, unit='s')
        rest = [one for one in table.columns if one not in (seconds, nanoseconds)]
        table = replace(table, columns=(stamp, *rest))
    return table
