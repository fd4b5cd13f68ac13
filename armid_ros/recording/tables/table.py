# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables of samples: named columns of equal length."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import gzip
from importlib import import_module
import os
from pathlib import Path
import re
from types import MappingProxyType
from typing import Any
import zlib

from armid_ros.errors import RecordingError
from armid_ros.files import open_regular
from armid_ros.files.documents import LARGEST
from armid_ros.motion import FloatArray, read_only
from armid_ros.recording.source import DEFAULT
import numpy as np
import numpy.typing as npt

_BRACKETS = re.compile(r'\s*[(\[]\s*([^()\[\]\d][^()\[\]]*)\s*[)\]]\s*$')
#: Units by their common spellings.
_UNITS = dict.fromkeys(('nm', 'n*m', 'n.m', 'n·m', 'newton meter'), 'N m')
_UNITS |= dict.fromkeys(('deg', 'degree', 'degrees'), 'deg')
_UNITS |= dict.fromkeys(('deg/sec', 'dps', 'deg_per_s'), 'deg/s')
_UNITS |= dict.fromkeys(('rad', 'radian', 'radians'), 'rad')
_UNITS |= dict.fromkeys(('rad/sec', 'rad_per_s'), 'rad/s')
_UNITS |= dict.fromkeys(('s', 'sec', 'seconds'), 's')
_UNITS |= dict.fromkeys(('amp', 'amps'), 'A') | {'ma': 'mA', 'mnm': 'mN m', 'nmm': 'N mm'}
_UNITS |= {'ms': 'ms', 'us': 'us', 'ns': 'ns', 'nsec': 'ns'}
#: Units at the end of names without brackets, such as 'angle_deg'.
_ENDINGS: tuple[str, ...] = ('deg_per_s', 'rad_per_s', 'deg', 'degrees', 'rad', 'nm', 'mnm', 'ma')
_ENDINGS += ('ms', 'us', 'ns', 'nsec', 'sec', 's')


@dataclass(frozen=True, eq=False)
class TableColumn:
    """
    One column of a table: name, values and unit.

    Attributes
    ----------
    name : str
        Name in the file; an element of an array is 'q[0]', or '[0]' if the array has no name.
    values : ndarray, shape (N,)
        Values; NaN for cells without a number or with an impossibly large number.
    array : str
        Name of the array that contains the column; empty for a single column.
    unit : str
        Unit in the name, or in a line below the names; empty if none is given.

    """

    name: str
    values: FloatArray
    array: str = ''
    unit: str = ''

    def __post_init__(self) -> None:
        """Make the values read-only; take a missing unit from the column name."""
        with np.errstate(invalid='ignore'):  # ignore warnings for signalling NaN
            values = np.where(np.abs(self.values) <= LARGEST, self.values, np.nan)
        object.__setattr__(self, 'values', read_only(values))
        name = self.array or self.name
        unit, bracket = _normal_unit(self.unit), _BRACKETS.search(name)
        if bracket and not unit:
            unit = _normal_unit(bracket[1])
        elif not unit:  # name such as act_pos_deg[3]
            plain = re.sub(r'\[\d+\]$', '', name).rstrip('0123456789_').lower()
            unit = next((_UNITS[end] for end in _ENDINGS if plain.endswith(f'_{end}')), '')
        object.__setattr__(self, 'unit', unit)

    @property
    def bare_name(self) -> str:
        """Return the name without a unit in brackets at its end."""
        return self.name if self.array else _BRACKETS.sub('', self.name)

    @property
    def finite(self) -> FloatArray:
        """Return the finite values of the column."""
        return self.values[np.isfinite(self.values)]


@dataclass(frozen=True, eq=False)
class Table:
    """
    Table of samples from a file: named columns of numbers, and notes for the user.

    Attributes
    ----------
    source : str
        Path of the file.
    columns : tuple of TableColumn
        Columns with numbers.
    described : str
        Format of the file, such as 'text with commas'.
    first_line : int or None
        Line number of the first row in a text file; None for other formats.
    rate_hz : float or None
        Samples per second, if the file states a rate instead of times.
    notes, damage : tuple of str
        Notes on the content and on the damage of the file.
    words : mapping of str to sequence of str
        Columns with texts, and empty columns.

    """

    source: str
    columns: tuple[TableColumn, ...]
    described: str = ''
    first_line: int | None = None
    rate_hz: float | None = None
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    words: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Move columns of text to ``words``; RecordingError if columns differ in length."""
        there = tuple(one for one in self.columns if len(one.finite))
        empty = {one.name: () for one in self.columns if one not in there}
        object.__setattr__(self, 'columns', there)
        object.__setattr__(self, 'words', {**empty, **self.words})
        if not there:
            raise RecordingError(f'{self.source}: the table has no column of numbers')
        if len({len(column.values) for column in there}) > 1:
            counts = ', '.join(f'{c.name} {len(c.values)}' for c in there)
            raise RecordingError(f'{self.source}: columns have different lengths: {counts}')

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.columns[0].values)

    def column(self, name: str) -> TableColumn | None:
        """
        Return the column with this name, with or without unit; None if missing.

        Raises
        ------
        RecordingError
            If several columns of this name have different values.

        """
        named = [column for column in self.columns if column.name == name]
        named = named or [column for column in self.columns if column.bare_name == name]
        for other in named[1:]:
            if not np.array_equal(other.values, named[0].values, equal_nan=True):
                row = int(np.argmax(other.values != named[0].values))
                raise RecordingError(
                    f"{self.source}: {len(named)} columns have the name '{name}' and different "
                    f'values, first in {self.where(row)}: {named[0].values[row]:g} and '
                    f'{other.values[row]:g}; give them different names'
                )
        return named[0] if named else None

    def where(self, row: int) -> str:
        """Return the place of a row as text, 'row 3' or 'line 5', for error messages."""
        return f'row {row}' if self.first_line is None else f'line {self.first_line + row}'

    def listed(self) -> str:
        """Return all column names as text, arrays abbreviated, for error messages."""
        arrays = Counter(column.array for column in self.columns)
        shown = dict.fromkeys(
            f'{c.array.removeprefix("[]")}[0..{arrays[c.array] - 1}]' if c.array else c.name
            for c in self.columns
        )
        names = [' '.join(name.split())[:80] for name in shown]
        words = [
            f"{name[:80]} ('{cells[0][:40]}')" if len(cells) and cells[0] else name[:80]
            for name, cells in self.words.items()
        ]
        text = _at_most(names)
        if words:
            text += f'; without a number: {_at_most(words)}'
        if self.first_line is not None and '[]' in arrays:
            text += f'; a header line with names is missing above line {self.first_line}'
        return text


def _at_most(names: Sequence[str]) -> str:
    """Return the first forty names and the number of further names as text."""
    most = 40
    more = f' and {len(names) - most} more' if len(names) > most else ''
    return ', '.join(names[:most]) + more


def _normal_unit(text: str) -> str:
    """Return the standard spelling of a unit, such as 'deg', 'rad/s', 'N m' or 'ms'."""
    text = text.strip().strip('[]()').replace('°', 'deg').replace('\u00b5', 'u')
    return _UNITS.get(text.lower(), text)


def table_of_arrays(
    source: str,
    arrays: Mapping[str, npt.NDArray[np.generic]],
    described: str,
    labels: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Table:
    """
    Build a table from named arrays; the most frequent length is the number of rows.

    Parameters
    ----------
    source : str
        Path of the file.
    arrays : mapping of str to ndarray
        Numeric arrays; scalars and arrays of other lengths are skipped.
    described : str
        Format of the file, for the user.
    labels : mapping of str to sequence of str
        Names of the elements of an array; by default their numbers.

    """
    usable = {
        name: np.squeeze(values)
        for name, values in arrays.items()
        if values.dtype.kind in 'fiub' and values.size > 1
    }
    counts = Counter(size for values in usable.values() for size in set(values.shape) if size > 1)
    if not counts:
        raise RecordingError(f'{source}: the file has no array of numbers')
    length = max(counts, key=lambda size: (counts[size] if size > 50 else 0, size))
    columns: list[TableColumn] = []
    for name, values in usable.items():
        if values.ndim > 2 or length not in values.shape:
            continue
        numbers = values.astype(np.float64)
        if numbers.ndim == 1:
            columns.append(TableColumn(name or '[0]', numbers))
        else:
            rows = numbers if len(numbers) == length else numbers.T
            own = labels.get(name, ())
            if len(own) != rows.shape[1]:
                own = [str(k) for k in range(rows.shape[1])]
            columns += [
                TableColumn(f'{name}[{label}]', row, name)
                for label, row in zip(own, rows.T, strict=True)
            ]
    return Table(source, tuple(columns), described)


def side_by_side(tables: Sequence[Table]) -> Table:
    """
    Join the columns of several tables with the same rows.

    Column names that occur in several files get the file name as a prefix: 'currents:Joint_1'.

    Raises
    ------
    RecordingError
        If the tables differ in length.

    """
    if len(tables) == 1:
        return tables[0]
    if len({len(table) for table in tables}) > 1:
        lengths = ', '.join(f'{table.source} has {len(table)} rows' for table in tables)
        raise RecordingError(
            f'tables that are read together need equal numbers of rows, but {lengths}'
        )
    shared = Counter(name for table in tables for name in {c.name for c in table.columns})
    columns: list[TableColumn] = []
    for table in tables:
        stem = table.source.rpartition('/')[2].split('.')[0]
        for one in table.columns:
            name = one.name if shared[one.name] == 1 else f'{stem}:{one.name}'
            array = one.array and f'{stem}:{one.array}'
            columns.append(TableColumn(name, one.values, array, one.unit))
    return Table(
        ' + '.join(table.source for table in tables),
        tuple(columns),
        tables[0].described,
        tables[0].first_line,
        next((table.rate_hz for table in tables if table.rate_hz), None),
        tuple(note for table in tables for note in table.notes),
        tuple(note for table in tables for note in table.damage),
    )


def read_content(path: Path) -> bytes:
    """
    Return the bytes of a file, decompressed if its suffix is .gz.

    Raises
    ------
    RecordingError
        If the path is not a regular file, the content is too large, or a .gz file is damaged.

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
            raise RecordingError(f'{path}: the file cannot be decompressed: {error}') from error
    DEFAULT.require(len(content), f'{path}: the decompressed content')
    return content


def imported(library: str, path: Path, format_name: str) -> Any:
    """Import a library that reads a format; RecordingError if it is not installed."""
    try:
        return import_module(library)
    except ImportError:
        raise RecordingError(
            f'{path}: {format_name} needs the package {library.split(".")[0]}, which is not '
            "installed; install it with pip install 'armid_ros[convert]'"
        ) from None
