# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The record of runs on locked sets: commit, time and result.

A locked set that is used often becomes a development set. So a benchmark records each run by
itself, at its beginning and again with its results, and rejects uncommitted code. The record has
one JSON object per line; a run without results was interrupted.

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
    Record a run on a locked set; SystemExit for uncommitted code.

    Parameters
    ----------
    what : str
        Name of the set, and of its part.
    log : Path
        File of the record.

    Yields
    ------
    dict
        The entry, to which the caller adds `results`.

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
    Return metrics for the record; a part of another metric has both names.

    Parameters
    ----------
    metrics : iterable of Metric
        Metrics in the order of their table.

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
    """Return the commit of the tree; SystemExit if a file other than the log is uncommitted."""
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
