# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A table of samples: named columns of equal length, whatever file they came from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import re

from armid_ros.errors import RecordingError
from armid_ros.files.documents import LARGEST
from armid_ros.motion import FloatArray, read_only
import numpy as np
import numpy.typing as npt

_UNIT = re.compile(r'\s*[(\[]\s*([^()\[\]\d][^()\[\]]*)\s*[)\]]\s*$')
#: Endings of names that say a unit.
_ENDINGS = {
    'deg_per_s': 'deg/s',
    'rad_per_s': 'rad/s',
    'deg': 'deg',
    'degrees': 'deg',
    'rad': 'rad',
    'nm': 'N m',
    'mnm': 'mN m',
    'ms': 'ms',
    'us': 'us',
    'ns': 'ns',
    'nsec': 'ns',
    'sec': 's',
    's': 's',
    'ma': 'mA',
}


@dataclass(frozen=True, eq=False)
class TableColumn:
    """
    One column.

    Attributes
    ----------
    name : str
        As in the file; an element of an array is 'q[0]', or '[0]' where the array has no name.
    values : ndarray, shape (N,)
        NaN where the file has no number, or one beyond all quantities.
    array : str
        Name of the array it is an element of; empty for a column of its own.
    unit : str
        What the name, or a line below the names, says; empty where nothing does.
    filled : bool
        Whether the file has a finite number in it, be it beyond all quantities.

    """

    name: str
    values: FloatArray
    array: str = ''
    unit: str = ''
    filled: bool = field(init=False)

    def __post_init__(self) -> None:
        """Freeze the values, and take the unit from the name where none was given."""
        object.__setattr__(self, 'filled', bool(np.isfinite(self.values).any()))
        with np.errstate(invalid='ignore'):  # of rubbish that is a signalling NaN
            values = np.where(np.abs(self.values) <= LARGEST, self.values, np.nan)
        object.__setattr__(self, 'values', read_only(values))
        object.__setattr__(
            self, 'unit', normal_unit(self.unit) or unit_of(self.array or self.name)
        )

    @property
    def bare_name(self) -> str:
        """Return the name without a unit in brackets behind it."""
        return self.name if self.array else _UNIT.sub('', self.name)


@dataclass(frozen=True, eq=False)
class Table:
    """
    Columns of one file.

    Attributes
    ----------
    source : str
        The file.
    columns : tuple of TableColumn
        Those with numbers in them.
    described : str
        What kind of file it is, for a person.
    first_line : int or None
        Line of the first row, in a text file.
    rate_hz : float or None
        Samples per second, where the file says so and not each row.
    notes : tuple of str
        What reading it met.
    words : mapping of str to sequence of str
        Columns of words, and those without anything in them.

    """

    source: str
    columns: tuple[TableColumn, ...]
    described: str = ''
    first_line: int | None = None
    rate_hz: float | None = None
    notes: tuple[str, ...] = ()
    words: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Set columns without numbers apart; refuse tables that are empty or ragged."""
        there = tuple(one for one in self.columns if one.filled)
        empty = {one.name: () for one in self.columns if one not in there}
        object.__setattr__(self, 'columns', there)
        object.__setattr__(self, 'words', {**empty, **self.words})
        lengths = {len(column.values) for column in self.columns}
        if not lengths or lengths == {0}:
            raise RecordingError(f'{self.source}: there is no column of numbers in it')
        if len(lengths) > 1:
            counts = ', '.join(f'{c.name} {len(c.values)}' for c in self.columns)
            raise RecordingError(f'{self.source}: columns differ in length: {counts}')

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.columns[0].values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(column.name for column in self.columns)

    def column(self, name: str) -> TableColumn | None:
        """
        Return the column of a name, with or without the unit in brackets; None if none has.

        Raises
        ------
        RecordingError
            Several have it, with different values.

        """
        named = [column for column in self.columns if column.name == name]
        named = named or [column for column in self.columns if column.bare_name == name]
        for other in named[1:]:
            if not np.array_equal(other.values, named[0].values, equal_nan=True):
                row = int(np.argmax(other.values != named[0].values))
                raise RecordingError(
                    f"{self.source}: {len(named)} columns are called '{name}', with different "
                    f'values, first in {self.where(row)}: {named[0].values[row]:g} and '
                    f'{other.values[row]:g}; give each a name of its own'
                )
        return named[0] if named else None

    def where(self, row: int) -> str:
        """Return where a row is, for a message."""
        return f'row {row}' if self.first_line is None else f'line {self.first_line + row}'

    def listed(self) -> str:
        """Return the names of the columns, elements of arrays in short, for a message."""
        names: dict[str, int] = {}
        for column in self.columns:
            key = f'{column.array.removeprefix("[]")}[..]' if column.array else column.name
            names[key] = names.get(key, 0) + 1
        shown = [
            f'{key[:-4]}[0..{count - 1}]' if key.endswith('[..]') else key
            for key, count in names.items()
        ]
        shown = [' '.join(name.split())[:80] for name in shown]
        more = f' and {len(shown) - 40} more' if len(shown) > 40 else ''
        words = [
            f"{name[:80]} ('{said[0][:40]}')" if len(said) and said[0] else name[:80]
            for name, said in self.words.items()
        ]
        empty = f'; without a number: {", ".join(words[:40])}' if words else ''
        bare = self.first_line is not None and any(c.array == '[]' for c in self.columns)
        header = (
            f'; a header line with names is missing above line {self.first_line}' if bare else ''
        )
        return ', '.join(shown[:40]) + more + empty + header


def normal_unit(text: str) -> str:
    """Return a unit as it is written here: 'deg', 'rad/s', 'N m', 'ms'."""
    text = text.strip().strip('[]()').replace('°', 'deg').replace('\u00b5', 'u')
    known = {
        'nm': 'N m', 'n*m': 'N m', 'n.m': 'N m', 'n·m': 'N m', 'newton meter': 'N m',
        'mnm': 'mN m', 'nmm': 'N mm', 'degree': 'deg', 'degrees': 'deg', 'deg/sec': 'deg/s',
        'dps': 'deg/s', 'rad/sec': 'rad/s', 'sec': 's', 'seconds': 's', 'radian': 'rad',
        'radians': 'rad', 'amps': 'A', 'amp': 'A',
    }  # fmt: skip
    return known.get(text.lower(), text)


def unit_of(name: str) -> str:
    """Return the unit that a name says: 'deg' of 'q1 [deg]' and of 'act_pos_deg[3]'."""
    bracket = _UNIT.search(name)
    if bracket:
        return normal_unit(bracket[1])
    plain = re.sub(r'\[\d+\]$', '', name).rstrip('0123456789_').lower()
    for ending, unit in _ENDINGS.items():
        if plain.endswith('_' + ending):
            return unit
    return ''


def table_of_arrays(
    source: str, arrays: Mapping[str, npt.NDArray[np.generic]], described: str
) -> Table:
    """
    Make a table of named arrays, of which samples run along the axis that most have in common.

    Parameters
    ----------
    source : str
        The file.
    arrays : mapping of str to ndarray
        Numeric ones; scalars and those of other lengths are passed over.
    described : str
        What kind of file it is.

    """
    usable = {
        name: np.squeeze(values) if values.ndim > 2 else values
        for name, values in arrays.items()
        if values.dtype.kind in 'fiub' and values.size > 1
    }
    length = _common_length(source, list(usable.values()))
    columns: list[TableColumn] = []
    for name, values in usable.items():
        columns += _columns_of(name, values.astype(np.float64), length)
    return Table(source, tuple(columns), described)


def _common_length(source: str, arrays: Sequence[npt.NDArray[np.generic]]) -> int:
    """Return how many samples most arrays have; of equally many, the larger number."""
    counts: dict[int, int] = {}
    for values in arrays:
        for length in {size for size in values.shape if size > 1}:
            counts[length] = counts.get(length, 0) + 1
    if not counts:
        raise RecordingError(f'{source}: there is no array of numbers in it')
    return max(counts, key=lambda length: (counts[length] if length > 50 else 0, length))


def _columns_of(name: str, values: FloatArray, length: int) -> list[TableColumn]:
    if values.ndim == 1 or 1 in values.shape:
        flat = values.ravel()
        return [TableColumn(name or '[0]', flat)] if len(flat) == length else []
    if values.ndim != 2 or length not in values.shape:
        return []
    rows = values if values.shape[0] == length else values.T
    return [TableColumn(f'{name}[{k}]', rows[:, k], name) for k in range(rows.shape[1])]
