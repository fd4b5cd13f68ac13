# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read tables in text files: values separated by commas, semicolons, tabs or blanks."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
import csv
import io
from pathlib import Path
import re

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.tables.table import read_content, Table, TableColumn
import numpy as np

_SEPARATORS = {';': 'semicolons', '\t': 'tabs', ',': 'commas', ' ': 'blanks'}
_COMMENTS = ('#', '%')
_EMPTY = ('', 'nan', 'na', 'n/a', 'null', 'none', '-')
_DECIMAL_COMMA = re.compile(r'[-+]?\d+,\d+([eE][-+]?\d+)?')


def read_text(path: Path) -> Table:
    """
    Read a table from a text file, which gzip may have compressed.

    Raises
    ------
    RecordingError
        If a cell is not a number; the message names line and column.

    """
    lines = _lines(path)
    first, header, units = _heading(path, lines)
    separator = _separator(lines[first : first + 20])
    width = len(_split(lines[first], separator))
    given = _split(header, separator) if header else [''] * width
    if len(given) != width:
        raise RecordingError(
            f'{path}: the header has {len(given)} names ({", ".join(given[:6])} ...), but line '
            f'{first + 1} has {width} values'
        )
    names = [name or f'[{k}]' for k, name in enumerate(given)]
    values, words, notes, damage = _numbers(path, lines[first:], separator, names, first + 1)
    array, unit_of = '' if header else '[]', dict(enumerate(_split(units, separator)))
    return Table(
        str(path),
        tuple(
            TableColumn(name, column, array, unit_of.get(k, ''))
            for k, (name, column) in enumerate(zip(names, values.T, strict=True))
        ),
        f'text with {_SEPARATORS[separator]}',
        first_line=first + 1,
        notes=notes,
        damage=damage,
        words=words,
    )


def _lines(path: Path) -> list[str]:
    """Return the lines of a text file in UTF-8, UTF-16 or Latin-1."""
    raw = read_content(path)
    if not raw.strip():
        raise RecordingError(f'{path}: the file is empty; record again, or give another file')
    wide = raw.startswith((b'\xff\xfe', b'\xfe\xff'))
    try:
        text = raw.decode('utf-16' if wide else 'utf-8-sig')
    except UnicodeDecodeError:
        text = raw.decode('latin-1')
    if '\0' in text:
        raise RecordingError(
            f'{path}: the file is binary, not text; use the suffix of the format (.npz, .mat, '
            '.parquet, .mcap), or save the data as CSV in UTF-8'
        )
    return text.rstrip().splitlines()


def _heading(path: Path, lines: list[str]) -> tuple[int, str, str]:
    """Return the index of the first line of numbers, and the lines of column names and units."""
    words: list[str] = []
    comment = ''
    for number, line in enumerate(lines):
        bare = line.strip()
        if bare.startswith(_COMMENTS):
            comment = bare.lstrip('#% ')
        elif bare and _has_numbers(bare):
            if not words and _same_width(comment, bare):
                words = [comment]
            if len(words) > 1 and _same_width(words[-2], words[-1]):
                return number, words[-2], words[-1]
            return number, (words or [''])[-1], ''
        elif bare:
            words.append(line)
    raise RecordingError(
        f'{path}: none of the {len(lines)} lines has numbers; a table needs one row per line, '
        'with commas, semicolons, tabs or blanks between values'
    )


def _has_numbers(line: str) -> bool:
    """Return whether more than half of the cells in a line are numbers."""
    cells = [cell for cell in _split(line, _separator([line])) if cell.lower() not in _EMPTY]
    count = 0
    for cell in cells:
        with suppress(ValueError):
            _number(cell, ';')
            count += 1
    return count > len(cells) / 2


def _same_width(header: str, row: str) -> bool:
    separator = _separator([row])
    return bool(header) and len(_split(header, separator)) == len(_split(row, separator))


def _separator(lines: list[str]) -> str:
    """Return the cell separator: the first candidate that occurs in every line, or a blank."""
    there = [line for line in lines if line.strip()]
    return next((s for s in _SEPARATORS if all(s in line for line in there)), ' ')


def _split(line: str, separator: str) -> list[str]:
    """Return the cells of a line; a cell in quotes may contain the separator."""
    if separator == ' ':
        return line.split()
    return [cell.strip() for row in csv.reader([line], delimiter=separator) for cell in row]


def _number(cell: str, separator: str) -> float:
    """Convert a cell to a number, an empty cell to NaN; raise ValueError for text."""
    if cell.lower() in _EMPTY:
        return np.nan
    if separator != ',' and _DECIMAL_COMMA.fullmatch(cell):
        cell = cell.replace(',', '.')
    return float(cell)


def _numbers(
    path: Path,
    rows: list[str],
    separator: str,
    names: list[str],
    first_line: int,
) -> tuple[FloatArray, dict[str, Sequence[str]], tuple[str, ...], tuple[str, ...]]:
    """Parse rows; return values (N, columns), cells of text, notes on content and on damage."""
    with suppress(ValueError):  # fast path if every cell is a number
        delimiter = None if separator == ' ' else separator
        values = np.loadtxt(io.StringIO('\n'.join(rows)), delimiter=delimiter, ndmin=2)
        if values.shape[1] == len(names):
            return values, {}, (), ()
    values = np.full((len(rows), len(names)), np.nan)
    texts: dict[int, dict[int, str]] = {}
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    for k, line in enumerate(rows):
        where = f'line {first_line + k}'
        cells = _split(line, separator)
        if len(cells) != len(names):
            if not cells or line.lstrip().startswith(_COMMENTS):
                continue
            if k == len(rows) - 1:
                damage = (f'{where} is incomplete and left out',)
                values = values[:k]
                break
            raise RecordingError(
                f'{path}: {where} has {len(cells)} values, but other lines have {len(names)}'
            )
        for j, cell in enumerate(cells):
            try:
                values[k, j] = _number(cell, separator)
            except ValueError:
                texts.setdefault(j, {})[k] = cell
    # a column with fewer numbers contains text
    numeric = np.isfinite(values).mean(axis=0) >= 0.5
    wrong = [(j, *next(iter(of.items()))) for j, of in texts.items() if numeric[j]]
    if wrong:
        j, k, cell = wrong[0]
        raise RecordingError(
            f"{path}: line {first_line + k}, column {names[j]}: '{cell}' is not a number; correct "
            'the cell, or leave the cell empty'
        )
    words: dict[str, Sequence[str]] = {
        names[j]: [of.get(k, '') for k in range(len(values))] for j, of in texts.items()
    }
    empty = np.argwhere(np.isnan(values) & numeric)
    if len(empty):
        many = '1 cell is' if len(empty) == 1 else f'{len(empty)} cells are'
        row, column = empty[0]
        notes = (
            f'{many} empty and read as NaN, the first in line {first_line + row}, '
            f'column {names[column]}',
        )
    return values, words, notes, damage
