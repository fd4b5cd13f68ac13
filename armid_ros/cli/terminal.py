# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Terminal output: tables on stdout, progress on stderr."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import time

from armid_ros.errors import visible
import click

Tick = Callable[..., None]


def say(text: str, colour: str | None = None) -> None:
    """Print a line on stdout, in colour on a terminal."""
    shown = visible(text)
    click.echo(shown if colour is None else click.style(shown, fg=colour))


@contextmanager
def progress(what: str) -> Iterator[Tick]:
    """
    Show a progress bar in a `with` block; yield a function that updates share and step.

    Without a terminal there is a line on stderr at most every ten seconds.

    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        start, step = time.monotonic(), [what]
        due = [start + 10.0]

        def note(share: float, what: str | None = None) -> None:
            step[0] = what or step[0]
            now = time.monotonic()
            if now >= due[0]:
                click.echo(progress_line(step[0], share, now - start), err=True)
                due[0] = now + 10.0

        yield note
        return
    columns = (TextColumn('{task.description}'), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=1.0)

        def tick(share: float, what: str | None = None) -> None:
            if what is not None:
                bar.update(task, description=what)
            bar.update(task, completed=share)

        yield tick


def progress_line(what: str, share: float, spent: float) -> str:
    """Return a line with completed share, elapsed time `spent` [s] and remaining time."""
    known = 0.0 < share < 1.0
    rest = f', about {spent * (1.0 / share - 1.0):.0f} s to go' if known else ''
    return f'{what}: {100.0 * share:.0f} %, {spent:.0f} s{rest}'
