# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read tables from files of arrays: NumPy, MATLAB, HDF5, Parquet, and LeRobot datasets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import io
import json
import math
from pathlib import Path
from typing import Any
import zipfile

from armid_ros.errors import RecordingError
from armid_ros.files import finite, read_text, reading
from armid_ros.recording.source import DEFAULT
from armid_ros.recording.tables.table import (
    imported,
    read_content,
    Table,
    table_of_arrays,
    TableColumn,
)
import numpy as np
import numpy.typing as npt

INFO = Path('meta', 'info.json')
Arrays = dict[str, npt.NDArray[np.generic]]


def read_numpy(path: Path) -> Table:
    """Read a .npy or .npz file, compressed by gzip or not."""
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
    """Read a .mat file: up to version 7 by scipy, version 7.3 by h5py."""
    from scipy.io import loadmat, whosmat

    raw = read_content(path)
    if b'\x89HDF' in raw[:1024]:  # signature of HDF5, after a user block of 512 bytes
        return read_hdf5(path)
    for name, shape, _ in whosmat(io.BytesIO(raw)):
        _require_packed(f'{path}: {name[:40]!r}', 8 * math.prod(shape), len(raw))
    content = loadmat(io.BytesIO(raw), simplify_cells=True)
    content = {name: value for name, value in content.items() if not name.startswith('__')}
    arrays = dict(_flattened(content, ''))
    if not arrays:
        raise RecordingError(
            f'{path}: it has no array; only MATLAB can read tables and timeseries: save their '
            f'columns as arrays'
        )
    return table_of_arrays(str(path), arrays, 'MATLAB arrays')


def read_hdf5(path: Path) -> Table:
    """Read an HDF5 file, such as a .mat file of version 7.3."""
    h5py = imported('h5py', path, 'HDF5, the format of MAT files of version 7.3,')
    arrays: Arrays = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in 'fiub' and '#' not in name[:1]:
            stored = item.id.get_storage_size()
            _require_packed(f'{path}: {name[:40]!r}', item.size * item.dtype.itemsize, stored)
            arrays[name.replace('/', '.')] = np.asarray(item)

    with h5py.File(path, 'r') as file:
        file.visititems(visit)
    return table_of_arrays(str(path), arrays, 'HDF5 arrays')


def _require_packed(what: str, size: int, stored: int) -> None:
    """Raise a RecordingError if the stated size of an array is impossible or over the limit."""
    # upper bound of the compression ratio of deflate
    if size > 1100 * stored:
        raise RecordingError(f'{what} states {size} bytes, but the file has {stored}')
    DEFAULT.require(size, what)


def _flattened(
    content: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, npt.NDArray[np.generic]]]:
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f'{prefix}{name}.')
        elif isinstance(value, np.ndarray) and value.dtype.kind in 'fiub':
            yield f'{prefix}{name}', value


def read_parquet(path: Path) -> Table:
    """Read a Parquet file; a column of lists becomes one column per element."""
    columns, words = _columns(path, {})
    return Table(str(path), columns, 'Parquet', words=words)


def read_lerobot(path: Path, episode: int | None = None) -> Table:
    """
    Read one episode of a LeRobot dataset.

    Parameters
    ----------
    path : Path
        The folder with meta/info.json.
    episode : int, optional
        Its number; the first by default.

    """
    with reading(path / INFO, RecordingError):
        info = json.loads(read_text(path / INFO, RecordingError))
        features: Mapping[str, Any] = info['features']
        names: dict[str, list[str]] = {}
        for key, feature in features.items():
            called = feature.get('names')
            if isinstance(called, Mapping):  # datasets nest the names of elements differently
                called = next(iter(called.values()), None)
            names[key] = [str(name) for name in called] if isinstance(called, list) else []
        total = int(info.get('total_episodes', 1))
        rate = finite(info['fps'], 'fps') if 'fps' in info else None
        if rate is not None and rate <= 0.0:
            raise RecordingError(f'fps is {rate:g}, and has to be positive')
    chosen = episode or 0
    files = sorted((path / 'data').glob('**/*.parquet'))
    own = [file for file in files if file.name == f'episode_{chosen:06d}.parquet']
    for file in own or [file for file in files if not file.name.startswith('episode_')]:
        columns, _ = _columns(file, names)
        index = next((c.values for c in columns if c.name == 'episode_index'), None)
        rows = np.ones(len(columns[0].values), np.bool_) if index is None else index == chosen
        if rows.any():
            kept = tuple(
                TableColumn(c.name, c.values[rows], c.array)
                for c in columns
                if not (c.name.endswith('index') or c.name.startswith('next.'))
            )
            notes = (f'episode {chosen} of 0 to {total - 1}',)
            return Table(str(path), kept, 'LeRobot dataset', rate_hz=rate, notes=notes)
    raise RecordingError(f'{path}: no episode {chosen}; the dataset has 0 to {total - 1}')


def _columns(
    path: Path, names: Mapping[str, Sequence[str]]
) -> tuple[tuple[TableColumn, ...], dict[str, Sequence[str]]]:
    """Return the columns of numbers, and the cells of text columns."""
    parquet = imported('pyarrow.parquet', path, 'Parquet')
    types = imported('pyarrow', path, 'Parquet').types
    stated = parquet.read_metadata(path)
    groups = [stated.row_group(k) for k in range(stated.num_row_groups)]
    cells = sum(g.column(k).num_values for g in groups for k in range(g.num_columns))
    DEFAULT.require(8 * max(cells, stated.num_rows), f'{path}: the stated content')
    table = parquet.read_table(path)
    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    columns: list[TableColumn] = []
    words: dict[str, Sequence[str]] = {}
    for field, chunked in zip(table.schema, table.columns, strict=True):
        column = chunked.combine_chunks()
        if types.is_timestamp(field.type):
            values = column.cast('int64').to_numpy(zero_copy_only=False)
            columns.append(TableColumn(field.name, values.astype(float), unit=field.type.unit))
        elif types.is_integer(field.type) or types.is_floating(field.type):
            values = column.to_numpy(zero_copy_only=False)
            columns.append(TableColumn(field.name, values.astype(float)))
        elif types.is_string(field.type) or types.is_large_string(field.type):
            words[field.name] = [one or '' for one in column.to_pylist()]
        elif types.is_list(field.type) or types.is_fixed_size_list(field.type):
            labels = names.get(field.name, ())
            for name, cells in _elements(path, field.name, column.to_pylist(), labels):
                if any(isinstance(cell, str) for cell in cells):
                    words[name] = [str(cell or '') for cell in cells]
                else:
                    columns.append(TableColumn(name, np.array(cells, dtype=float), field.name))
    return tuple(columns), words


def _elements(
    path: Path, name: str, cells: Sequence[Sequence[Any] | None], labels: Sequence[str]
) -> Iterator[tuple[str, list[Any]]]:
    """Yield the name and the cells of each list element; None for missing rows."""
    rows = [one or () for one in cells]
    width = max(map(len, rows), default=0)
    if any(isinstance(row[0], (list, dict)) for row in rows if row):
        return
    odd = next((k for k, row in enumerate(rows) if row and len(row) != width), None)
    if odd is not None:
        raise RecordingError(
            f'{path}: row {odd}, column {name}: a list of {len(rows[odd])}, the others have '
            f'{width}'
        )
    for k in range(width):
        label = labels[k] if len(labels) == width else k
        yield f'{name}[{label}]', [row[k] if row else None for row in rows]
