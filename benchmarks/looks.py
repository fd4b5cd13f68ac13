# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Runs on sets of cases, and the record of those on locked sets: commit, time and result.

A locked set that is used often becomes a development set. A benchmark therefore records each run
automatically, at its start and again with its results, and rejects uncommitted code. The record
has one JSON object per line; a run without results was interrupted.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from datetime import datetime, UTC
import json
import math
import multiprocessing
import os
from pathlib import Path
import subprocess
from typing import Any

import numpy as np

from benchmarks.metrics import Metric, table

LOG = Path(__file__).parent / 'results' / 'looks.jsonl'


def judge_all(
    judge: Callable[[Any], Any],
    cases: Sequence[Any],
    what: str,
    score: Callable[[Sequence[Any]], Sequence[Metric]],
    *,
    processes: int = 2,
    out: Path | None = None,
) -> list[Any]:
    """
    Judge cases in several processes, print a line for each case and the table of rates.

    Parameters
    ----------
    judge : callable
        Returns a judged case, a dataclass with `line`, or None for one that cannot be made.
    cases : sequence
        Arguments of `judge`.
    what : str
        Name of the set, and of its part; a run on a locked one is recorded.
    score : callable
        Returns the metrics of judged cases.
    processes : int
        Number of processes.
    out : Path, optional
        File for all answers, as JSON.

    """
    for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        os.environ.setdefault(variable, '1')  # one thread each, as the processes share the cores
    context = multiprocessing.get_context('spawn')
    judged = []
    with look(what) if 'locked' in what else nullcontext({}) as entry:
        with ProcessPoolExecutor(processes, mp_context=context) as pool:
            for one in filter(None, pool.map(judge, cases)):
                judged.append(one)
                print(one.line, flush=True)
        metrics = score(judged)
        print(f'\n{what}\n{table(metrics)}')
        entry['results'] = results_of(metrics)
    if out:
        write_json(out, [asdict(one) for one in judged])
    return judged


def write_json(path: Path, content: object) -> None:
    """Write data as JSON, with arrays as lists and other objects as numbers."""
    text = json.dumps(
        content, indent=1, default=lambda x: x.tolist() if isinstance(x, np.ndarray) else float(x)
    )
    path.write_text(f'{text}\n', encoding='utf-8')


@contextmanager
def look(what: str, log: Path = LOG) -> Iterator[dict[str, Any]]:
    """
    Context manager that records a run on a locked set of cases.

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
    Return rates as JSON for the record; an indented rate has its parent's name as a prefix.

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
    """Return the current commit; raise SystemExit if a file other than the log changed."""
    git = ['git', '-C', str(log.parent)]
    others = [*git, 'status', '--porcelain', '--', ':/', f':!{log.name}']
    changed = subprocess.check_output(others, text=True).splitlines()
    if changed:
        raise SystemExit(
            f'locked sets are used with committed code only; commit or stash: '
            f'{", ".join(line[3:] for line in changed[:5])}{" ..." if len(changed) > 5 else ""}'
        )
    return subprocess.check_output([*git, 'rev-parse', '--short=12', 'HEAD'], text=True).strip()


def _finite(value: float) -> float | None:
    return round(float(value), 4) if math.isfinite(value) else None
