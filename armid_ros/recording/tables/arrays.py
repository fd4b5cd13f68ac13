# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read tables from array files: .npy and .npz of NumPy, .mat of MATLAB, HDF5."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import io
import math
from pathlib import Path
from typing import Any
import zipfile

from armid_ros.errors import RecordingError
from armid_ros.recording.source import DEFAULT
from armid_ros.recording.tables.table import imported, read_content, Table, table_of_arrays
import numpy as np
import numpy.typing as npt

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
    if b'\x89HDF' in raw[:1024]:  # first bytes of HDF5, after 512 other bytes
        return read_hdf5(path)
    for name, shape, _ in whosmat(io.BytesIO(raw)):
        _require_packed(f'{path}: {name[:40]!r}', 8 * math.prod(shape), len(raw))
    content = loadmat(io.BytesIO(raw), simplify_cells=True)
    content = {name: value for name, value in content.items() if not name.startswith('__')}
    arrays = dict(_flattened(content, ''))
    if not arrays:
        raise RecordingError(
            f'{path}: there is no array in it; tables and timeseries are objects that only '
            'MATLAB reads: save their columns as arrays'
        )
    return table_of_arrays(str(path), arrays, 'MATLAB arrays')


def read_hdf5(path: Path) -> Table:
    """Read an HDF5 file, such as a .mat file of version 7.3."""
    h5py = imported('h5py', path, 'HDF5, which MAT files of version 7.3 are,')
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
