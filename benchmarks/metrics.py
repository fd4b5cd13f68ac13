# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rows of a table of success rates, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest


def wilson(hits: int, total: int) -> tuple[float, float]:
    """Return the 95 % interval of a rate (Wilson 1927)."""
    if total == 0:
        return 0.0, 1.0
    low, high = binomtest(hits, total).proportion_ci(method='wilson')
    return float(low), float(high)


@dataclass(frozen=True)
class Metric:
    """
    One row of a table of rates: name, value, interval and required value.

    Attributes
    ----------
    name : str
        Name of the metric.
    value : float
        Rate, share or number; nan without cases.
    low, high : float
        95 % interval of a rate; nan for other numbers.
    count : int
        Number of cases.
    reach : str
        Required value, in words; empty without one.
    good : bool or None
        Whether the required value is reached; None without one.

    """

    name: str
    value: float
    low: float
    high: float
    count: int
    reach: str
    good: bool | None


def rate(
    name: str,
    cases: Sequence[Any],
    test: Callable[[Any], bool],
    *,
    least: float | None = None,
    most: float | None = None,
) -> Metric:
    """Return the rate of cases that pass a test, with its 95 % interval and required value."""
    hits, total = sum(map(bool, map(test, cases))), len(cases)
    value = hits / total if total else np.nan
    wanted = [f'at least {least:g}'] if least is not None else []
    wanted += [f'at most {most:g}'] if most is not None else []
    good = None
    if wanted and total:
        good = (least is None or value >= least) and (most is None or value <= most)
    return Metric(name, value, *wilson(hits, total), total, ', '.join(wanted), good)


def number(
    name: str,
    statistic: Callable[[Any], Any],
    values: Sequence[float] | np.ndarray,
    reach: str,
    test: Callable[[float], bool] | None,
) -> Metric:
    """Return a statistic of values, such as the median, with its required value."""
    value = float(statistic(values)) if len(values) else np.nan
    good = bool(test(value)) if test and len(values) else None
    return Metric(name, value, np.nan, np.nan, len(values), reach, good)


def table(metrics: Iterable[Metric]) -> str:
    """Format rates as a table, one row each."""
    rows = [f'{"":30s} {"value":>7s}  {"95 %":>15s} {"cases":>6s}  reach']
    for metric in metrics:
        interval = '' if np.isnan(metric.low) else f'{metric.low:.3f} - {metric.high:.3f}'
        verdict = {True: 'reached', False: 'NOT reached', None: ''}[metric.good]
        wanted = f'{metric.reach}: {verdict}' if metric.reach else ''
        row = f'{metric.name:30s} {metric.value:7.3f}  {interval:>15s} {metric.count:6d}  {wanted}'
        rows.append(row.rstrip())
    return '\n'.join(rows)


def processor() -> str:
    """Return the model name of the processor."""
    with open('/proc/cpuinfo', encoding='utf-8') as info:
        names = (line.split(': ')[1] for line in info if line.startswith('model name'))
        return next(names, '?').strip()
