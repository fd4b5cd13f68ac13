# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables in text: values with commas, semicolons, tabs or blanks between them."""

from __future__ import annotations

import csv
import io
from pathlib import Path
import re

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.tables.content import read_content
from armid_ros.recording.tables.table import Table, TableColumn
import numpy as np

_SEPARATORS = {',': 'commas', ';': 'semicolons', '\t': 'tabs', ' ': 'blanks'}
_COMMENTS = ('#', '%')
#: How text begins whose characters take two or four bytes.
_WIDE = {
    b'\xff\xfe\0\0': 'UTF-32',
    b'\0\0\xfe\xff': 'UTF-32',
    b'\xff\xfe': 'UTF-16',
    b'\xfe\xff': 'UTF-16',
}
_EMPTY = ('', 'nan', 'na', 'n/a', 'null', 'none', '-')
_DECIMAL_COMMA = re.compile(r'[-+]?\d+,\d+([eE][-+]?\d+)?')
#: A column with fewer numbers than this share is one of words.
_NUMERIC = 0.5


def read_text(path: Path) -> Table:
    """
    Read a text file, compressed or not.

    Raises
    ------
    RecordingError
        Naming the line and the column of what is no number.

    """
    lines = _lines(path)
    first, header, units = _heading(path, lines)
    separator = _separator(lines[first : first + 20])
    rows = lines[first:]
    cells = _split(lines[first], separator)
    names = _names(header, separator, len(cells), path, first)
    unit_cells = _split(units, separator) if units else [''] * len(names)
    unit_cells += [''] * (len(names) - len(unit_cells))
    values, notes = _numbers(path, rows, separator, names, first + 1)
    columns = tuple(
        TableColumn(name, column, '' if header else '[]', unit)
        for name, column, unit in zip(names, values.T, unit_cells, strict=True)
        if np.isfinite(column).any()
    )
    there = {column.name for column in columns}
    empty = tuple(name for name in names if name not in there)
    described = f'text with {_SEPARATORS[separator]}'
    return Table(str(path), columns, described, first_line=first + 1, notes=notes, empty=empty)


def _lines(path: Path) -> list[str]:
    raw = read_content(path)
    if not raw.strip():
        raise RecordingError(f'{path}: the file is empty; record again, or name another file')
    for start, coding in _WIDE.items():
        if raw.startswith(start) and _decodes(raw, coding):
            raise RecordingError(
                f'{path}: text in {coding}, not in UTF-8; save it as CSV in UTF-8, or: '
                f'iconv --from-code {coding} --to-code UTF-8 {path} > utf8.csv'
            )
    if b'\0' in raw:
        raise RecordingError(
            f'{path}: is no text, but binary; name the file with the ending of its kind '
            '(.npz, .mat, .parquet, .mcap), or save it as CSV in UTF-8'
        )
    try:
        text = raw.decode('utf-8-sig')
    except UnicodeDecodeError:
        text = raw.decode('latin-1')
    return text.rstrip().splitlines()


def _decodes(raw: bytes, coding: str) -> bool:
    try:
        raw.decode(coding)
    except UnicodeDecodeError:
        return False
    return True


def _heading(path: Path, lines: list[str]) -> tuple[int, str, str]:
    """Return where the rows begin, the line of names, and one of units; empty for none."""
    words: list[str] = []
    comment = ''
    for number, line in enumerate(lines):
        bare = line.strip()
        if not bare:
            continue
        if bare.startswith(_COMMENTS):
            comment = bare.lstrip('#% ')
        elif _has_numbers(bare):
            if not words and _as_many(comment, bare):
                words = [comment]
            header = words[-2] if len(words) > 1 and _as_many(words[-2], words[-1]) else ''
            return (number, header, words[-1]) if header else (number, (words or [''])[-1], '')
        else:
            words.append(line)
    raise RecordingError(
        f'{path}: no line of numbers in {len(lines)} lines; a table has one row a line, values '
        'with commas, semicolons, tabs or blanks between them'
    )


def _has_numbers(line: str) -> bool:
    """Whether more of a line is numbers than not."""
    cells = [cell for cell in _split(line, _separator([line])) if cell.lower() not in _EMPTY]
    return sum(_is_number(cell) for cell in cells) > len(cells) / 2


def _as_many(header: str, row: str) -> bool:
    if not header:
        return False
    separator = _separator([row])
    return len(_split(header, separator)) == len(_split(row, separator))


def _is_number(cell: str) -> bool:
    if _DECIMAL_COMMA.fullmatch(cell):
        return True
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _separator(lines: list[str]) -> str:
    """Return what stands between values: the first kind that every line has."""
    for separator in (';', '\t', ','):
        if lines and all(separator in line for line in lines if line.strip()):
            return separator
    return ' '


def _split(line: str, separator: str) -> list[str]:
    if separator == ' ':
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _names(header: str, separator: str, width: int, path: Path, first: int) -> list[str]:
    if not header:
        return [f'[{k}]' for k in range(width)]
    names = _split(header, separator)
    if len(names) != width:
        raise RecordingError(
            f'{path}: {len(names)} names ({", ".join(names[:6])} ...) stand above {width} values '
            f'in line {first + 1}'
        )
    unique: list[str] = []
    for k, name in enumerate(names):
        name = name or f'[{k}]'
        unique.append(name if name not in unique else f'{name}#{names[: k + 1].count(name)}')
    return unique


def _numbers(
    path: Path, rows: list[str], separator: str, names: list[str], first_line: int
) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the values, shape (N, columns), and what was met."""
    delimiter = None if separator == ' ' else separator
    try:
        values = np.loadtxt(io.StringIO('\n'.join(rows)), delimiter=delimiter, ndmin=2)
        if values.shape[1] == len(names):
            return values, ()
    except ValueError:
        pass
    return _cell_by_cell(path, rows, separator, names, first_line)


def _number(cell: str, separator: str) -> float:
    """Return a number, NaN for an empty cell; raise a ValueError for a word."""
    if cell.lower() in _EMPTY:
        return np.nan
    if separator != ',' and _DECIMAL_COMMA.fullmatch(cell):
        cell = cell.replace(',', '.')
    return float(cell)


def _cell_by_cell(
    path: Path, rows: list[str], separator: str, names: list[str], first_line: int
) -> tuple[FloatArray, tuple[str, ...]]:
    values = np.full((len(rows), len(names)), np.nan)
    words: dict[int, tuple[int, str]] = {}
    notes: list[str] = []
    for k, line in enumerate(rows):
        cells = _split(line, separator)
        if len(cells) != len(names):
            if k == len(rows) - 1:
                notes.append(f'line {first_line + k} is cut off and left out')
                values = values[:k]
                break
            if not cells or line.lstrip().startswith(_COMMENTS):
                continue
            raise RecordingError(
                f'{path}: line {first_line + k} has {len(cells)} values, the others {len(names)}'
            )
        for j, cell in enumerate(cells):
            try:
                values[k, j] = _number(cell, separator)
            except ValueError:
                words.setdefault(j, (first_line + k, cell))
    for j, (line_number, cell) in words.items():
        if np.isfinite(values[:, j]).mean() >= _NUMERIC:
            raise RecordingError(
                f"{path}: line {line_number}, column {names[j]}: '{cell}' is no number"
            )
    return values, (*notes, *_gaps(values, names, first_line))


def _gaps(values: FloatArray, names: list[str], first_line: int) -> list[str]:
    """Say how many cells of columns of numbers are empty, and where the first is."""
    missing = np.isnan(values) & (np.isfinite(values).mean(axis=0) >= _NUMERIC)
    at = np.argwhere(missing)
    if not len(at):
        return []
    row, column = at[0]
    many = '1 cell is' if len(at) == 1 else f'{len(at)} cells are'
    return [
        f'{many} empty and read as NaN, the first in line {first_line + row}, '
        f'column {names[column]}'
    ]
