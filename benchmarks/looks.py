# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The record of runs on locked sets: which commit was judged by them, when, and the result.

A set that is used often enough is a development set. So a benchmark records each run by itself, at
its beginning and again with its results, and refuses code that is in no commit. The record is one
JSON object a line; a run without results was broken off.

"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime, UTC
import json
import math
from pathlib import Path
import subprocess
from typing import Any

from benchmarks.metrics import Metric

LOG = Path(__file__).parent / 'results' / 'looks.jsonl'


@contextmanager
def look(what: str, log: Path = LOG) -> Iterator[dict[str, Any]]:
    """
    Record a run on a locked set; SystemExit where the code is in no commit.

    Parameters
    ----------
    what : str
        The set, and which part of it.
    log : Path
        File of the record.

    Yields
    ------
    dict
        The entry; `results` is added to it.

    """
    commit = clean_commit(log)
    when = datetime.now(UTC).strftime('%Y-%m-%d %H:%M UTC')
    entry: dict[str, Any] = {'set': what, 'commit': commit, 'when': when}
    before = log.read_text(encoding='utf-8') if log.exists() else ''
    log.write_text(f'{before}{json.dumps(entry)}\n', encoding='utf-8')
    yield entry
    log.write_text(f'{before}{json.dumps(entry)}\n', encoding='utf-8')


def results_of(metrics: Iterable[Metric]) -> dict[str, dict[str, Any]]:
    """
    Return metrics as they are recorded, a part of another with the name of both.

    Parameters
    ----------
    metrics : iterable of Metric
        In the order of their table.

    """
    rows: dict[str, dict[str, Any]] = {}
    parent = ''
    for metric in metrics:
        name = metric.name.strip()
        if metric.name.startswith(' '):
            name = f'{parent}: {name}'
        else:
            parent = name
        rows[name] = {'value': _finite(metric.value), 'cases': metric.count}
        if not math.isnan(metric.low):
            rows[name]['interval'] = [_finite(metric.low), _finite(metric.high)]
    return rows


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
            f'locked sets are used with committed code only; commit or stash: '
            f'{", ".join(changed[:5])}{" ..." if len(changed) > 5 else ""}'
        )
    return _git(folder, 'rev-parse', '--short=12', 'HEAD').strip()


def _finite(value: float) -> float | None:
    return round(float(value), 4) if math.isfinite(value) else None


def _git(folder: Path, *words: str) -> str:
    try:
        done = subprocess.run(
            ['git', '-C', str(folder), *words], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(
            f'locked sets are used in a git tree only, which names the code: {error}'
        ) from None
    return done.stdout
