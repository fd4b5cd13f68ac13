# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a person sees: tables on stdout, progress on stderr."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import threading
import time
from typing import Any

from armid_ros.errors import visible
import click

Tick = Callable[..., None]


def say(text: str, colour: str | None = None) -> None:
    """Print a line, coloured on a terminal."""
    shown = visible(text)
    click.echo(shown if colour is None else click.style(shown, fg=colour))


@contextmanager
def progress(what: str) -> Iterator[Tick]:
    """
    Show a bar while work goes on; yields tick(share, what=None).

    Without a terminal there is a line on stderr every ten seconds.

    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        lines = ProgressLines(what, lambda line: click.echo(line, err=True), time.monotonic)
        with lines.watched():
            yield lines.tick
        return
    columns = (TextColumn('{task.description}'), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=1.0)

        def tick(share: float, what: str | None = None) -> None:
            if what is not None:
                bar.update(task, description=what)
            bar.update(task, completed=share)

        yield tick


class ProgressLines:
    """Progress as a line of text every ten seconds, for logs and pipes; `write` gets each."""

    #: Time between two lines [s].
    EVERY = 10.0

    def __init__(
        self, what: str, write: Callable[[str], None], clock: Callable[[], float]
    ) -> None:
        self._what, self._share = what, 0.0
        self._write, self._clock = write, clock
        self._start = self._last = clock()

    def tick(self, share: float, what: str | None = None) -> None:
        """Update the share that is done and the current step."""
        self._share = share
        if what is not None:
            self._what = what

    def look(self) -> None:
        """Write a line if one is due."""
        now = self._clock()
        if now - self._last >= self.EVERY:
            self._last = now
            spent, share = now - self._start, self._share
            rest = (
                f', about {spent * (1.0 / share - 1.0):.0f} s to go' if 0.0 < share < 1.0 else ''
            )
            self._write(f'{self._what}: {100.0 * share:.0f} %, {spent:.0f} s{rest}')

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Call `look` every second in a thread while the work runs."""
        done = threading.Event()

        def watch() -> None:
            while not done.wait(1.0):
                self.look()

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()


def print_rows(
    rows: Sequence[dict[str, Any]],
    as_json: bool,
) -> None:
    """
    Print rows as a table, or as JSON.

    Parameters
    ----------
    rows : sequence of dict
        Cells by the heads of their columns.
    as_json : bool
        Whether for programs, with all columns.

    """
    from armid_ros.files import json_text
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    if as_json:
        click.echo(json_text(list(rows), indent=1))
        return
    console = Console()
    heads = list(rows[0]) if rows else []
    table = Table(box=None, header_style='bold')
    for head in heads:
        table.add_column(
            Text(head),
            no_wrap=head == 'name',
            overflow='fold',
        )
    for row in rows:
        cells = [', '.join(one) if isinstance(one, list) else one for one in row.values()]
        table.add_row(*(Text(visible(cell)) for cell in cells))
    console.print(table)
