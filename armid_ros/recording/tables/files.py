# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read table files: NumPy, MATLAB, HDF5, Parquet and LeRobot datasets; `text` reads CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
import io
import json
import math
from pathlib import Path
import re
from typing import Any
import zipfile

from armid_ros.errors import RecordingError
from armid_ros.files import finite, open_regular, reading
from armid_ros.files import read_text as read_document
from armid_ros.recording.source import DEFAULT
from armid_ros.recording.tables.table import (
    imported,
    read_content,
    Table,
    table_of_arrays,
    TableColumn,
)
from armid_ros.recording.tables.text import read_text
import numpy as np
import numpy.typing as npt

INFO = Path('meta', 'info.json')
Arrays = dict[str, npt.NDArray[np.generic]]
_NAME = re.compile(r'(.*?)(?:joint_)?names?[\[_.]?(\d+)\]?', re.IGNORECASE)
_NUMBERED = re.compile(r'(.*?)[\[_.]?(\d+)\]?')
_SECONDS = re.compile(r'(.*?)(?:s|secs?|seconds)', re.IGNORECASE)
_NANOSECONDS = re.compile(r'(.*?)(?:ns|nsecs?|nanosecs?|nanoseconds)', re.IGNORECASE)


def is_table(path: Path) -> bool:
    """Return whether a path is a LeRobot dataset or has the suffix of a table file."""
    return _suffix(path) in _READERS or (path / INFO).is_file()


def open_table(path: Path, *, episode: int | None = None) -> Table:
    """
    Read the columns of a table file or of a LeRobot dataset.

    Parameters
    ----------
    path : Path
        CSV (also with semicolons, tabs or blanks, and compressed as .gz), NPY, NPZ, MAT, HDF5,
        Parquet, or the folder of a LeRobot dataset.
    episode : int, optional
        Episode of a LeRobot dataset; the first by default.

    Raises
    ------
    RecordingError
        If the file does not exist, has another format, or is damaged.

    """
    if not path.exists():
        raise RecordingError(f'{path}: there is no file at this path')
    lerobot = (path / INFO).is_file()
    if not lerobot and _suffix(path) not in _READERS:
        known = ', '.join(_READERS)
        raise RecordingError(f'{path}: not a table; tables are {known} and LeRobot datasets')
    if not lerobot:
        with open_regular(path, RecordingError):  # opening a FIFO would block
            pass
    try:
        table = _read_lerobot(path, episode) if lerobot else _READERS[_suffix(path)](path)
        return _with_stamps(_with_dates(_with_names(table)))
    except RecordingError:
        raise
    except Exception as problem:  # libraries may raise any exception
        reason = ' '.join(str(problem).split())[:500]
        raise RecordingError(
            f'{path}: the table cannot be read, perhaps because it is damaged: '
            f'{type(problem).__name__}: {reason}'
        ) from problem


def _suffix(path: Path) -> str:
    """Return the suffix of a file in lower case, without a final .gz."""
    return Path(path.stem).suffix.lower() if path.suffix == '.gz' else path.suffix.lower()


def _with_names(table: Table) -> Table:
    """Replace numbered columns by one column per joint, with joint names from text columns."""
    names: dict[str, dict[str, npt.NDArray[np.str_]]] = {}  # by the text before 'name', and number
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
        in_rows = np.array(list(named.values()))
        joints = [joint for joint in dict.fromkeys([*in_rows[:, 0], *np.unique(in_rows)]) if joint]
        apart: list[TableColumn] = []
        taken: list[TableColumn] = []
        for key, columns in values.items():
            if columns.keys() != named.keys():
                continue
            taken += columns.values()
            numbers = np.array([columns[number].values for number in named])
            for joint in joints:
                own = in_rows == joint
                of_joint = np.where(own, numbers, 0.0).sum(axis=0)
                of_joint[~own.any(axis=0)] = np.nan
                apart.append(TableColumn(f'{key}[{joint}]', of_joint, key))
        rest = [column for column in table.columns if column not in taken]
        table = replace(table, columns=(*rest, *apart))
    return table


def _with_dates(table: Table) -> Table:
    """Convert columns of ISO 8601 dates to seconds since 1970."""
    dates: dict[str, TableColumn] = {}
    for name, cells in table.words.items():
        if len(cells) and cells[0][:4].isdigit():
            with suppress(ValueError):
                seconds = [datetime.fromisoformat(cell).timestamp() for cell in cells]
                dates[name] = TableColumn(name, np.array(seconds), unit='s')
    words = {name: cells for name, cells in table.words.items() if name not in dates}
    return replace(table, columns=(*table.columns, *dates.values()), words=words)


def _with_stamps(table: Table) -> Table:
    """Combine separate columns of seconds and nanoseconds into one time column [s]."""
    pairs = []
    starts = {
        match[1]: column for column in table.columns if (match := _SECONDS.fullmatch(column.name))
    }
    for column in table.columns:
        match = _NANOSECONDS.fullmatch(column.name)
        if match and match[1] in starts:
            pairs.append((starts[match[1]], column, match[1].strip(' ._/') or 'time'))
    for seconds, nanoseconds, name in pairs:
        finite = nanoseconds.values[np.isfinite(nanoseconds.values)]
        integers = np.all(finite == np.rint(finite)) and np.all((finite >= 0.0) & (finite < 1e9))
        if not integers or not np.any(finite):
            continue
        stamp = TableColumn(name, seconds.values + 1e-9 * nanoseconds.values, unit='s')
        rest = [one for one in table.columns if one not in (seconds, nanoseconds)]
        table = replace(table, columns=(stamp, *rest))
    return table


def read_numpy(path: Path) -> Table:
    """Read the arrays of a .npy or .npz file, which gzip may have compressed."""
    raw = read_content(path)
    if zipfile.is_zipfile(io.BytesIO(raw)):
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
        DEFAULT.require(unpacked, f'{path}: the decompressed content')
    loaded = np.load(io.BytesIO(raw), allow_pickle=False)
    arrays = {'': loaded} if isinstance(loaded, np.ndarray) else dict(loaded)
    described = 'one NumPy array' if '' in arrays else 'NumPy arrays'
    # split structured arrays into their fields
    apart: Arrays = {}
    for name, values in arrays.items():
        if values.dtype.names:
            dot = f'{name}.' if name else ''
            apart.update({f'{dot}{field}': values[field] for field in values.dtype.names})
        else:
            apart[name] = values
    return table_of_arrays(str(path), apart, described)


def read_matlab(path: Path) -> Table:
    """Read the arrays of a .mat file: up to version 7 by scipy, version 7.3 by h5py."""
    from scipy.io import loadmat, whosmat

    raw = read_content(path)
    if b'\x89HDF' in raw[:1024]:  # signature of HDF5, after a user block of 512 bytes
        return read_hdf5(path)
    for name, shape, _ in whosmat(io.BytesIO(raw)):
        _require_possible(f'{path}: {name[:40]!r}', 8 * math.prod(shape), len(raw))
    content = loadmat(io.BytesIO(raw), simplify_cells=True)
    content = {name: value for name, value in content.items() if not name.startswith('__')}
    arrays = dict(_flattened(content, ''))
    if not arrays:
        raise RecordingError(
            f'{path}: the file has no array; save the columns of a MATLAB table or timeseries as '
            'arrays, since only MATLAB can read these objects'
        )
    return table_of_arrays(str(path), arrays, 'MATLAB arrays')


def read_hdf5(path: Path) -> Table:
    """Read the arrays of an HDF5 file, such as a .mat file of version 7.3."""
    h5py = imported('h5py', path, 'HDF5, the format of MAT files of version 7.3,')
    arrays: Arrays = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in 'fiub' and '#' not in name[:1]:
            stored = item.id.get_storage_size()
            _require_possible(f'{path}: {name[:40]!r}', item.size * item.dtype.itemsize, stored)
            arrays[name.replace('/', '.')] = np.asarray(item)

    with h5py.File(path, 'r') as file:
        file.visititems(visit)
    return table_of_arrays(str(path), arrays, 'HDF5 arrays')


def _require_possible(array: str, size: int, stored: int) -> None:
    """Raise RecordingError if the stated size of an array is impossible or too large."""
    # deflate compresses by 1:1032 at most
    if size > 1100 * stored:
        raise RecordingError(
            f'{array}: the file states {size} bytes for this array, but stores only {stored} '
            'bytes; the file is damaged'
        )
    DEFAULT.require(size, array)


def _flattened(
    content: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, npt.NDArray[np.generic]]]:
    """Yield the numeric arrays in nested MATLAB structures, with names such as 'log.arm.q'."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f'{prefix}{name}.')
        elif isinstance(value, np.ndarray) and value.dtype.kind in 'fiub':
            yield f'{prefix}{name}', value


def read_parquet(path: Path) -> Table:
    """Read the columns of a Parquet file; a column of k-element lists becomes k columns."""
    arrays, words = _columns(path)
    return replace(table_of_arrays(str(path), arrays, 'Parquet'), words=words)


def _read_lerobot(path: Path, episode: int | None = None) -> Table:
    """Read one episode, the first by default, of the LeRobot dataset in a folder."""
    with reading(path / INFO, RecordingError):
        info = json.loads(read_document(path / INFO, RecordingError))
        names: dict[str, list[str]] = {}
        for key, feature in info['features'].items():
            called = feature.get('names')
            if isinstance(called, Mapping):  # some datasets have the names inside a mapping
                called = next(iter(called.values()), None)
            names[key] = [str(name) for name in called] if isinstance(called, list) else []
        total = int(info.get('total_episodes', 1))
        rate = finite(info['fps'], 'fps') if 'fps' in info else None
        if rate is not None and rate <= 0.0:
            raise RecordingError(f'fps (samples per second) is {rate:g}; it has to be positive')
    chosen = episode or 0
    files = sorted((path / 'data').glob('**/*.parquet'))
    own = [file for file in files if file.name == f'episode_{chosen:06d}.parquet']
    for file in own or [file for file in files if not file.name.startswith('episode_')]:
        arrays, _ = _columns(file)
        if 'episode_index' in arrays:
            rows = arrays['episode_index'] == chosen
            arrays = {name: values[rows] for name, values in arrays.items()}
        arrays = {
            name: values
            for name, values in arrays.items()
            if len(values) and not name.endswith('index') and not name.startswith('next.')
        }
        if arrays:
            table = table_of_arrays(str(path), arrays, 'LeRobot dataset', names)
            notes = (f'episode {chosen} of 0 to {total - 1}',)
            return replace(table, rate_hz=rate, notes=notes)
    raise RecordingError(f'{path}: the dataset has no episode {chosen}, only 0 to {total - 1}')


def _columns(path: Path) -> tuple[Arrays, dict[str, Sequence[str]]]:
    """Return the numeric columns of a Parquet file, (N,) or (N, k), and its text columns."""
    parquet = imported('pyarrow.parquet', path, 'Parquet')
    types = imported('pyarrow', path, 'Parquet').types
    stated = parquet.read_metadata(path)
    groups = [stated.row_group(k) for k in range(stated.num_row_groups)]
    cells = sum(g.column(k).num_values for g in groups for k in range(g.num_columns))
    DEFAULT.require(8 * max(cells, stated.num_rows), f'{path}: the stated content')
    table = parquet.read_table(path)
    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    arrays: Arrays = {}
    words: dict[str, Sequence[str]] = {}
    for field, chunked in zip(table.schema, table.columns, strict=True):
        column, name = chunked.combine_chunks(), field.name
        if types.is_timestamp(field.type):
            values = column.cast('int64').to_numpy(zero_copy_only=False)
            arrays[f'{name} [{field.type.unit}]'] = values.astype(float)
        elif types.is_integer(field.type) or types.is_floating(field.type):
            arrays[name] = column.to_numpy(zero_copy_only=False).astype(float)
        elif types.is_string(field.type) or types.is_large_string(field.type):
            words[name] = [one or '' for one in column.to_pylist()]
        elif types.is_list(field.type) or types.is_fixed_size_list(field.type):
            try:
                lists = np.array(column.to_pylist())
            except ValueError:
                raise RecordingError(
                    f'{path}: column {name}: the lists differ in length, or lists are missing; '
                    'write lists of equal length'
                ) from None
            if lists.dtype.kind == 'U':
                words |= {f'{name}[{k}]': one.tolist() for k, one in enumerate(lists.T)}
            else:
                arrays[name] = lists
    return arrays, words


#: Readers of table files, by suffix.
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
