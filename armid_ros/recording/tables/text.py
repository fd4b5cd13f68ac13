# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables in text: values with commas, semicolons, tabs or blanks between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
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
_LIST = re.compile(r'[\[(]([^\[\]()]*)[\])]\s*\)?$')
_COMMAS = re.compile(r'[,;\s]+')
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
    lists = [_elements(cell) for cell in cells]
    widths = [None if elements is None else len(elements) for elements in lists]
    heads = [
        (name if width is None else f'{name}[{k}]', unit, '' if width is None else name)
        for name, unit, width in zip(names, unit_cells, widths, strict=True)
        for k in range(1 if width is None else width)
    ]
    names = [name for name, _, _ in heads]
    values, words, notes = _numbers(path, rows, separator, names, widths, first + 1)
    columns = tuple(
        TableColumn(name, column, array if header else '[]', unit)
        for (name, unit, array), column in zip(heads, values.T, strict=True)
    )
    described = f'text with {_SEPARATORS[separator]}'
    return Table(str(path), columns, described, first_line=first + 1, notes=notes, words=words)


def _lines(path: Path) -> list[str]:
    raw = read_content(path)
    if not raw.strip():
        raise RecordingError(f'{path}: the file is empty; record again, or name another file')
    for start, coding in _WIDE.items():
        if not raw.startswith(start):
            continue
        with suppress(UnicodeDecodeError):
            raw.decode(coding)
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
    values = (_elements(cell) or [cell] for cell in cells)
    return sum(all(map(_is_number, some)) for some in values) > len(cells) / 2


def _as_many(header: str, row: str) -> bool:
    if not header:
        return False
    separator = _separator([row])
    return len(_split(header, separator)) == len(_split(row, separator))


def _is_number(cell: str) -> bool:
    with suppress(ValueError):
        _number(cell, ';')
        return True
    return False


def _elements(cell: str) -> list[str] | None:
    """Return the elements of a list, as '[1, 2]', '(1, 2)' and '[1 2]'; None of other cells."""
    found = _LIST.search(cell) if cell[:1] in ('[', '(', 'a') else None
    return (
        None if found is None else [part.strip('\'"') for part in _COMMAS.split(found[1]) if part]
    )


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
    return [name or f'[{k}]' for k, name in enumerate(names)]


def _number(cell: str, separator: str) -> float:
    """Return a number, NaN for an empty cell; raise a ValueError for a word."""
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
    widths: list[int | None],
    first_line: int,
) -> tuple[FloatArray, dict[str, Sequence[str]], tuple[str, ...]]:
    """Return the values, shape (N, columns), cells of words by column, and what was met."""
    delimiter = None if separator == ' ' else separator
    with suppress(ValueError):  # quick where every cell is a number
        values = np.loadtxt(io.StringIO('\n'.join(rows)), delimiter=delimiter, ndmin=2)
        if values.shape[1] == len(names):
            return values, {}, ()
    values = np.full((len(rows), len(names)), np.nan)
    said: dict[int, dict[int, str]] = {}
    notes: list[str] = []
    for k, line in enumerate(rows):
        cells = _split(line, separator)
        if len(cells) != len(widths):
            if k == len(rows) - 1:
                notes.append(f'line {first_line + k} is cut off and left out')
                values = values[:k]
                break
            if not cells or line.lstrip().startswith(_COMMENTS):
                continue
            raise RecordingError(
                f'{path}: line {first_line + k} has {len(cells)} values, the others {len(widths)}'
            )
        for j, cell in enumerate(_taken_apart(cells, widths, f'{path}: line {first_line + k}')):
            try:
                values[k, j] = _number(cell, separator)
            except ValueError:
                said.setdefault(j, {})[k] = cell
    for j, of in said.items():
        if np.isfinite(values[:, j]).mean() >= _NUMERIC:
            k, cell = next(iter(of.items()))
            raise RecordingError(
                f"{path}: line {first_line + k}, column {names[j]}: '{cell}' is no number"
            )
    words: dict[str, Sequence[str]] = {
        names[j]: [of.get(k, '') for k in range(len(values))] for j, of in said.items()
    }
    return values, words, (*notes, *_gaps(values, names, first_line))


def _taken_apart(cells: list[str], widths: list[int | None], where: str) -> Iterator[str]:
    """Yield cells, and the elements of those that are lists."""
    for k, (cell, width) in enumerate(zip(cells, widths, strict=True)):
        elements = [cell] if width is None else _elements(cell) or []
        if len(elements) != (1 if width is None else width):
            raise RecordingError(
                f'{where}, column {k + 1}: a list of {len(elements)}, the first has {width}'
            )
        yield from elements


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
