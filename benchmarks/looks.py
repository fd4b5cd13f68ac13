# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The record of looks at locked sets: which commit was judged by them, when, and what came out.

A set that is looked at often enough is a development set. So a benchmark writes down each look
by itself, at its beginning and again with its table, and refuses code that is in no commit.

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, UTC
from pathlib import Path
import subprocess

LOG = Path(__file__).with_name('looks.md')

_HEAD = """# Looks at locked sets

Written by the benchmarks; see looks.py. An entry without a table is a look that was broken off.
"""


@dataclass
class Look:
    """
    One look.

    Attributes
    ----------
    what : str
        The set, and which part of it.
    table : str
        What came out.

    """

    what: str
    table: str = ''


@contextmanager
def look(what: str, log: Path = LOG) -> Iterator[Look]:
    """
    Record a look at a locked set; SystemExit where the code is in no commit.

    Parameters
    ----------
    what : str
        The set, and which part of it.
    log : Path
        Where it is recorded.

    """
    commit = clean_commit(log)
    when = datetime.now(UTC).strftime('%Y-%m-%d %H:%M UTC')
    entry = f'\n## {what}\n\ncommit {commit}, clean, {when}\n'
    text = log.read_text(encoding='utf-8') if log.exists() else _HEAD
    log.write_text(text + entry, encoding='utf-8')
    record = Look(what)
    yield record
    with log.open('a', encoding='utf-8') as end:
        end.write(f'\n```\n{record.table.strip()}\n```\n')


def clean_commit(log: Path = LOG) -> str:
    """Return the commit of the tree; SystemExit where anything but the log is not in it."""
    folder = log.parent
    changed = [
        line[3:]
        for line in _git(folder, 'status', '--porcelain').splitlines()
        if not line.endswith(log.name)
    ]
    if changed:
        raise SystemExit(
            f'locked sets are looked at with committed code only; commit or stash: '
            f'{", ".join(changed[:5])}{" ..." if len(changed) > 5 else ""}'
        )
    return _git(folder, 'rev-parse', '--short=12', 'HEAD').strip()


def _git(folder: Path, *words: str) -> str:
    try:
        done = subprocess.run(
            ['git', '-C', str(folder), *words], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(
            f'locked sets are looked at in a git tree only, which says which code it was: {error}'
        ) from None
    return done.stdout
