# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read tables from Parquet files, and LeRobot datasets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.files import finite, load_json, read_text, reading
from armid_ros.recording.source import DEFAULT
from armid_ros.recording.tables.table import imported, Table, TableColumn
import numpy as np

INFO = Path('meta', 'info.json')


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
        info = load_json(read_text(path / INFO, RecordingError))
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
    """Return the columns of numbers, and the cells of columns of words."""
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
    """Yield name and cells of each element of lists; None for missing rows."""
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
