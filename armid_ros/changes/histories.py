# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Tests for steps and trends in series of estimates, with control of false discoveries in a fleet.

A change on a day that all arms of a kind share is no change of one arm and is subtracted. Other
scatter between bags is estimated from all arms (`scatter`). A bag that differs from the median
of its neighbours by more than noise is an outlier, not a change. Its value is limited to the
range of the noise (Hampel 1974). After a lasting change, neighbours agree.

The largest step and the trend of every series of an arm are tested, with Bonferroni's factor for
the number of tests. Over arms, the false discovery rate is controlled (Benjamini and Hochberg
1995): in the long run, at most a share alpha of the named arms is healthy.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from armid_ros.changes.scatter import (
    line,
    MIN_BAGS,
    ParameterHistory,
    splits,
    Spread,
    variances,
)
from armid_ros.changes.statistic import tail
import numpy as np
from scipy import stats

Kind = Literal['step', 'trend']

#: Mean length of a month [days].
MONTH = 365.25 / 12.0


@dataclass(frozen=True)
class HistoryChange:
    """
    The largest step of a series, or its trend.

    Attributes
    ----------
    series : ParameterHistory
        Series with the change.
    kind : {'step', 'trend'}
        Sudden change between two bags, or continuing change.
    index : int
        First bag after a step; 0 for a trend.
    size, std : float
        Size of the step, or of the trend per month, and its standard deviation.
    level : float
        Mean before a step, or value at the beginning of a trend.
    p : float
        P-value within this series, corrected for the number of tested steps.

    """

    series: ParameterHistory
    kind: Kind
    index: int
    size: float
    std: float
    level: float
    p: float


@dataclass(frozen=True)
class Judged:
    """
    Result of the change tests of one arm.

    Attributes
    ----------
    arm : str
        Name of the arm.
    changes : tuple of HistoryChange
        Changes of all tested series, the most significant first.
    p : float
        P-value of the first change, corrected for the number of series of the arm.
    adjusted : float
        Smallest false discovery rate at which the arm is reported as changed.

    """

    arm: str
    changes: tuple[HistoryChange, ...]
    p: float
    adjusted: float


def judge(
    kinds: Sequence[tuple[Sequence[ParameterHistory], Mapping[tuple[str, str], Spread]]],
) -> list[Judged]:
    """
    Test all series of all arms.

    Parameters
    ----------
    kinds : sequence of (sequence of ParameterHistory, mapping)
        For each kind of arm: the series of all parameters of all arms, without effects of days,
        and their spreads; see ``without_days`` and ``spreads``.

    Returns
    -------
    list of Judged
        Results, one per arm, the most significant first.

    """
    arms = []
    for series, spread in kinds:
        by_arm: dict[str, list[HistoryChange]] = {}
        for one in series:
            found = by_arm.setdefault(one.arm, [])
            if len(one.values) >= MIN_BAGS:
                found.append(largest_change(one, spread[one.parameter]))
        for arm, changes in by_arm.items():
            changes.sort(key=lambda change: (change.p, -abs(change.size) / change.std))
            p = min(1.0, len(changes) * changes[0].p) if changes else 1.0
            arms.append((arm, tuple(changes), p))
    adjusted = stats.false_discovery_control([p for _, _, p in arms]) if arms else []
    judged = [Judged(*arm, float(q)) for arm, q in zip(arms, adjusted, strict=True)]
    return sorted(judged, key=lambda one: (one.adjusted, one.p, one.arm))


def named(judged: Judged, alpha: float) -> tuple[HistoryChange, ...]:
    """Return the significant changes of an arm at a false discovery rate alpha."""
    if judged.adjusted > alpha or not judged.changes:
        return ()
    limit = alpha * judged.p / judged.adjusted / len(judged.changes)
    return tuple(change for change in judged.changes if change.p <= limit)


def largest_change(series: ParameterHistory, spread: Spread) -> HistoryChange:
    """Return the largest step of a series, or its trend if the trend explains it equally well."""
    cut, count = splits(series, spread), len(series.values)
    scores, trend = cut.scores / spread.steps, cut.trend / spread.trends
    at = int(np.argmax(scores))
    # the search for the position of a step costs log(count); a trend has no position
    if trend**2 + np.log(count) >= scores[at] ** 2:
        p = _p(trend, cut.freedom, count)
        std = cut.slope_std * spread.trends * MONTH
        return HistoryChange(series, 'trend', 0, cut.slope * MONTH, std, cut.start, p)
    p = _p(float(scores[at]), cut.freedom, count)
    size, std = float(cut.high[at] - cut.low[at]), float(cut.std[at]) * spread.steps
    return HistoryChange(series, 'step', at + 1, size, std, float(cut.low[at]), p)


def wear(series: ParameterHistory, spread: Spread) -> tuple[float, float]:
    """Return the slope of a series per month, and its standard deviation."""
    slope, std, _ = line(series.days, series.values, 1.0 / variances(series, spread)[0])
    return slope * MONTH, std * spread.trends * MONTH


def _p(score: float, freedom: float, tried: int) -> float:
    # lower bound of the p-value, which underflows for larger scores
    return min(1.0, tried * max(float(tail(score**2, 1, freedom)), 1e-300))
