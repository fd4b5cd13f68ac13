# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables in Parquet, LeRobot's datasets among them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import json
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.recording.tables.extra import imported
from armid_ros.recording.tables.table import Table, TableColumn
import numpy as np

INFO = Path('meta', 'info.json')


def read_parquet(path: Path) -> Table:
    """Read a Parquet file; columns of lists become as many columns as they have elements."""
    return Table(str(path), tuple(_columns(path, {})), 'Parquet')


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
    try:
        info = json.loads((path / INFO).read_text(encoding='utf-8'))
        features: Mapping[str, Any] = info['features']
    except (OSError, ValueError, KeyError) as error:
        raise RecordingError(
            f'{path / INFO}: not the description of a dataset: {error}'
        ) from error
    names = {key: _element_names(feature) for key, feature in features.items()}
    total = int(info.get('total_episodes', 1))
    chosen = 0 if episode is None else episode
    for file in _files(path, chosen):
        columns = list(_columns(file, names))
        index = next((c.values for c in columns if c.name == 'episode_index'), None)
        rows = np.ones(len(columns[0].values), np.bool_) if index is None else index == chosen
        if rows.any():
            kept = tuple(
                TableColumn(c.name, c.values[rows], c.array)
                for c in columns
                if not _is_index(c.name)
            )
            notes = (f'episode {chosen} of 0 to {total - 1}',)
            return Table(str(path), kept, 'LeRobot dataset', rate_hz=info.get('fps'), notes=notes)
    raise RecordingError(f'{path}: no episode {chosen}; the dataset has 0 to {total - 1}')


def _files(path: Path, episode: int) -> Sequence[Path]:
    """Return the files that may hold an episode, the likeliest first."""
    own = f'episode_{episode:06d}.parquet'
    files = sorted((path / 'data').glob('**/*.parquet'))
    if not files:
        raise RecordingError(f'{path}: there is no data/**/*.parquet')
    return [f for f in files if f.name == own] or [
        f for f in files if not f.name.startswith('episode_')
    ]


def _is_index(name: str) -> bool:
    return name.endswith('index') or name.startswith('next.')


def _element_names(feature: Mapping[str, Any]) -> list[str]:
    """Return what the elements of a feature are called; datasets nest them differently."""
    names = feature.get('names')
    if isinstance(names, Mapping):
        names = next(iter(names.values()), None)
    return [str(name) for name in names] if isinstance(names, list) else []


def _columns(path: Path, names: Mapping[str, Sequence[str]]) -> Iterator[TableColumn]:
    parquet = imported('pyarrow.parquet', path, 'Parquet')
    types = imported('pyarrow', path, 'Parquet').types
    try:
        table = parquet.read_table(path)
    except (OSError, ValueError) as error:
        raise RecordingError(f'{path}: Parquet cannot be read: {error}') from error
    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    for field in table.schema:
        column = table.column(field.name).combine_chunks()
        if types.is_timestamp(field.type):
            yield TableColumn(field.name, column.cast('int64').to_numpy(), unit=field.type.unit)
        elif types.is_integer(field.type) or types.is_floating(field.type):
            yield TableColumn(field.name, column.to_numpy(zero_copy_only=False).astype(float))
        elif types.is_list(field.type) or types.is_fixed_size_list(field.type):
            yield from _elements(path, field.name, column.to_pylist(), names.get(field.name, ()))


def _elements(
    path: Path, name: str, rows: Sequence[Sequence[float] | None], labels: Sequence[str]
) -> Iterator[TableColumn]:
    """Yield a column for each element of lists of equal length."""
    width = max((len(row) for row in rows if row is not None), default=0)
    if not width or any(isinstance(row[0], (str, list, dict)) for row in rows if row):
        return
    short = next((k for k, row in enumerate(rows) if row is not None and len(row) != width), None)
    if short is not None:
        raise RecordingError(
            f'{path}: row {short}, column {name}: a list of {len(rows[short] or ())}, the others '
            f'have {width}'
        )
    values = np.array([[np.nan] * width if row is None else row for row in rows], dtype=float)
    for k in range(width):
        label = labels[k] if len(labels) == width else str(k)
        yield TableColumn(f'{name}[{label}]', values[:, k], name)
