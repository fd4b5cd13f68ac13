# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a person sees: tables on stdout, progress on stderr."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import json
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

Tick = Callable[..., None]


def say(text: str) -> None:
    """Print a line."""
    click.echo(text)


@contextmanager
def progress(what: str) -> Iterator[Tick]:
    """Show a bar while work goes on; yields tick(share, what=None)."""
    columns = (TextColumn('{task.description}'), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0)

        def tick(share: float, what: str | None = None) -> None:
            if what is not None:
                bar.update(task, description=what)
            bar.update(task, completed=share)

        yield tick


def print_rows(rows: Sequence[dict[str, Any]], as_json: bool, right: Sequence[str] = ()) -> None:
    """Print rows as a table, or as JSON; numeric columns are named in `right`."""
    if as_json:
        click.echo(json.dumps(list(rows), indent=1))
        return
    table = Table(box=None, header_style='bold')
    for head in rows[0] if rows else ():
        table.add_column(
            head, justify='right' if head in right else 'left', no_wrap=head in ('name', 'joint')
        )
    for row in rows:
        table.add_row(*(Text(_cell(value)) for value in row.values()))
    Console().print(table)


def print_parameters(rows: Sequence[dict[str, Any]]) -> None:
    """Print a table of parameters."""
    shown = [
        {
            'parameter': row['name'],
            'joint': row['joint'],
            'value': f'{row["value"]:.5g}',
            'std': '' if row['std'] is None else f'{row["std"]:.2g}',
            'unit': row['unit'],
        }
        for row in rows
    ]
    print_rows(shown, as_json=False, right=('value', 'std'))


def _cell(value: Any) -> str:
    return ', '.join(map(str, value)) if isinstance(value, list) else str(value)
