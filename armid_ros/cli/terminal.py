# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Terminal output: tables on stdout, progress on stderr."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import threading
import time

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
    Show a progress bar; yields tick(share, what=None).

    Without a terminal there is a line on stderr every ten seconds.

    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        done, start = threading.Event(), time.monotonic()
        shares, steps = [0.0], [what]

        def watch() -> None:
            before = math.inf
            while not done.wait(10.0):
                share, spent = shares[0], time.monotonic() - start
                rest = spent * (1.0 / share - 1.0) if share else math.inf
                # if the share has not grown, the remaining time cannot be predicted
                click.echo(progress_line(steps[0], share, spent, rest < before), err=True)
                before = min(before, rest)

        def note(share: float, what: str | None = None) -> None:
            shares[0] = share
            steps[0] = steps[0] if what is None else what

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        try:
            yield note
        finally:
            done.set()
            thread.join()
        return
    columns = (TextColumn('{task.description}'), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=1.0)

        def tick(share: float, what: str | None = None) -> None:
            if what is not None:
                bar.update(task, description=what)
            bar.update(task, completed=share)

        yield tick


def progress_line(what: str, share: float, spent: float, steady: bool = True) -> str:
    """Return progress as a line of text, with the remaining time if steady; time spent in s."""
    known = steady and 0.0 < share < 1.0
    rest = f', about {spent * (1.0 / share - 1.0):.0f} s to go' if known else ''
    return f'{what}: {100.0 * share:.0f} %, {spent:.0f} s{rest}'
