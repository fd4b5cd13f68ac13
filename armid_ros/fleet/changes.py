# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Steps and trends in series of estimates, and how many arms of a fleet may be named for them.

A value of a series is theta + e with the variance s^2 + t^2: s is the deviation that its bag
states, t how much bags differ beyond that, by temperature, motion or what the model lacks. t is
one number a parameter for all arms of a kind, from the median of squared differences of
neighbours, which a step or a slow trend does not change. A bag further from the median of its
neighbours than noise is an odd bag, not a change, and moved to the edge of the noise (the
identifier of Hampel 1974); what lasts has neighbours that agree with it.

Of every series the largest step and the trend are tested, of every arm all its series, with
Bonferroni's factor for as many as were tried. Over arms the false discovery rate is controlled
(Benjamini and Hochberg 1995): of the arms that are named, no more than a share alpha is healthy
in the long run.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from armid_ros.motion import FloatArray
import numpy as np
from scipy import optimize, stats

Kind = Literal['step', 'trend']

#: Days of a month.
MONTH = 365.25 / 12.0
#: Bags below which a series is not tested.
FEWEST = 4
#: Median of a squared standard normal variable.
_MEDIAN = float(stats.chi2.ppf(0.5, 1))
#: Bags that one is compared with, itself among them, and how many deviations make it an odd one.
_WINDOW, _ODD = 5, 3.0
#: No probability is less: that of larger scores is no number any more.
_SMALLEST = 1e-300
#: Degrees of freedom of a variance from the median of n squares, over n.
_EFFICIENCY = 0.37


@dataclass(frozen=True, eq=False)
class Series:
    """
    A parameter of an arm over time.

    Attributes
    ----------
    arm : str
        Whose.
    name, joint, unit : str
        What.
    days : ndarray, shape (K,)
        When, in days of the epoch, increasing.
    values, std : ndarray, shape (K,)
        Estimates and stated deviations.

    """

    arm: str
    name: str
    joint: str
    unit: str
    days: FloatArray
    values: FloatArray
    std: FloatArray

    @property
    def parameter(self) -> tuple[str, str]:
        """Name and joint."""
        return self.name, self.joint


@dataclass(frozen=True)
class Spread:
    """
    How much estimates of a parameter differ from bag to bag beyond what they state.

    Attributes
    ----------
    std : float
        Its standard deviation.
    freedom : float
        Degrees of freedom of that.

    """

    std: float
    freedom: float


@dataclass(frozen=True)
class Change:
    """
    The most that is to be said of a series.

    Attributes
    ----------
    series : Series
        Which one.
    kind : {'step', 'trend'}
        A change from one bag to the next, or one that goes on.
    index : int
        First bag after a step; 0 for a trend.
    size, std : float
        How large a step is, or a trend in a month, and its standard deviation.
    level : float
        Mean before a step, or at the beginning of a trend.
    p : float
        Of this series alone, with the factor for all steps that were tried.

    """

    series: Series
    kind: Kind
    index: int
    size: float
    std: float
    level: float
    p: float


@dataclass(frozen=True)
class Judged:
    """
    What is to be said of an arm.

    Attributes
    ----------
    arm : str
        Which one.
    changes : tuple of Change
        Of all series that were tested, the least probable first.
    p : float
        Of the first, with the factor for all series of the arm.
    adjusted : float
        The smallest false discovery rate at which the arm is named.

    """

    arm: str
    changes: tuple[Change, ...]
    p: float
    adjusted: float


def spreads(series: Sequence[Series]) -> dict[tuple[str, str], Spread]:
    """Return by how much estimates of each parameter differ beyond what they state."""
    groups: dict[tuple[str, str], list[Series]] = {}
    for one in series:
        groups.setdefault(one.parameter, []).append(one)
    return {parameter: _spread(group) for parameter, group in groups.items()}


def judge(
    series: Sequence[Series], spread: Mapping[tuple[str, str], Spread] | None = None
) -> list[Judged]:
    """
    Test all series of arms of one kind.

    Parameters
    ----------
    series : sequence of Series
        All parameters of all arms.
    spread : mapping, optional
        As of ``spreads``, which is the default.

    Returns
    -------
    list of Judged
        One an arm, the least probable first.

    """
    spread = spreads(series) if spread is None else spread
    by_arm: dict[str, list[Change]] = {}
    for one in series:
        found = by_arm.setdefault(one.arm, [])
        if len(one.values) >= FEWEST:
            found.append(largest_change(one, spread[one.parameter]))
    arms = []
    for arm, changes in by_arm.items():
        changes.sort(key=lambda change: (change.p, -abs(change.size) / change.std))
        p = min(1.0, len(changes) * changes[0].p) if changes else 1.0
        arms.append((arm, tuple(changes), p))
    adjusted = stats.false_discovery_control([p for _, _, p in arms]) if arms else []
    judged = [Judged(*arm, float(q)) for arm, q in zip(arms, adjusted, strict=True)]
    return sorted(judged, key=lambda one: (one.adjusted, one.p, one.arm))


def named(judged: Judged, alpha: float) -> tuple[Change, ...]:
    """Return the changes for which an arm is named: those that would name it by themselves."""
    if judged.adjusted > alpha or not judged.changes:
        return ()
    limit = alpha * judged.p / judged.adjusted / len(judged.changes)
    return tuple(change for change in judged.changes if change.p <= limit)


def largest_change(series: Series, spread: Spread) -> Change:
    """Return the largest step of a series, or its trend if that explains it as well."""
    variance = np.maximum(series.std**2 + spread.std**2, 1e-300)
    weights = 1.0 / variance
    x, count = _bounded(series.values, np.sqrt(variance)), len(series.values)
    before, after = np.cumsum(weights)[:-1], np.cumsum(weights[::-1])[::-1][1:]
    low = np.cumsum(weights * x)[:-1] / before
    high = np.cumsum((weights * x)[::-1])[::-1][1:] / after
    std = np.sqrt(1.0 / before + 1.0 / after)
    score = np.abs(high - low) / std
    at = int(np.argmax(score))
    slope, slope_std, start = _line(series.days, x, weights)
    trend = abs(slope) / slope_std if slope_std < np.inf else 0.0
    # a step has a place that was searched for, a trend has none
    if trend**2 + np.log(count) >= score[at] ** 2:
        p = _p(trend, spread.freedom, count)
        return Change(series, 'trend', 0, slope * MONTH, slope_std * MONTH, start, p)
    p = _p(float(score[at]), spread.freedom, count)
    return Change(
        series, 'step', at + 1, float(high[at] - low[at]), float(std[at]), float(low[at]), p
    )


def wear(series: Series, spread: Spread) -> tuple[float, float]:
    """Return the slope of a series and its standard deviation, in a month."""
    weights = 1.0 / np.maximum(series.std**2 + spread.std**2, 1e-300)
    slope, std, _ = _line(series.days, series.values, weights)
    return slope * MONTH, std * MONTH


def unlike_siblings(series: Sequence[Series]) -> dict[tuple[str, str, str], float]:
    """
    Return how far each arm is from its siblings, by arm, name and joint.

    Distance of its median from that of all arms, over the spread of arms, both robust.

    """
    groups: dict[tuple[str, str], list[Series]] = {}
    for one in series:
        groups.setdefault(one.parameter, []).append(one)
    found = {}
    for parameter, group in groups.items():
        levels = np.array([np.median(one.values) for one in group])
        middle = np.median(levels)
        size = 1.4826 * float(np.median(np.abs(levels - middle)))
        for one, level in zip(group, levels, strict=True):
            found[one.arm, *parameter] = float((level - middle) / size) if size > 0.0 else 0.0
    return found


def _spread(group: Sequence[Series]) -> Spread:
    """Solve median(d^2 / (s_k^2 + s_k+1^2 + 2 t^2)) = median of chi^2 for t."""
    squares = np.concatenate([np.diff(one.values) ** 2 for one in group])
    stated = np.concatenate([one.std[1:] ** 2 + one.std[:-1] ** 2 for one in group])
    freedom = max(1.0, _EFFICIENCY * len(squares))
    if not len(squares):
        return Spread(0.0, freedom)

    def excess(extra: float) -> float:
        return float(np.median(squares / np.maximum(stated + 2.0 * extra, 1e-300))) - _MEDIAN

    most = float(np.max(squares)) + 1e-300
    if excess(0.0) <= 0.0 or excess(most) >= 0.0:
        return Spread(0.0, freedom)
    extra = optimize.brentq(excess, 0.0, most, xtol=1e-9 * most, rtol=1e-6)
    return Spread(float(np.sqrt(extra)), freedom)


def _bounded(x: FloatArray, std: FloatArray) -> FloatArray:
    """Return a series with odd values moved to the edge of the noise about their neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(x, min(_WINDOW, len(x)))
    nearest = np.clip(np.arange(len(x)) - _WINDOW // 2, 0, len(windows) - 1)
    middle = np.median(windows, axis=1)[nearest]
    return np.asarray(np.clip(x, middle - _ODD * std, middle + _ODD * std))


def _line(days: FloatArray, x: FloatArray, weights: FloatArray) -> tuple[float, float, float]:
    """Return slope, its standard deviation, and the value at the beginning."""
    total = weights.sum()
    middle, mean = weights @ days / total, weights @ x / total
    away = days - middle
    inertia = float(weights @ away**2)
    if not inertia > 0.0:
        return 0.0, np.inf, float(mean)
    slope = float(weights @ (away * (x - mean))) / inertia
    return slope, 1.0 / np.sqrt(inertia), float(mean + slope * (days[0] - middle))


def _p(score: float, freedom: float, tried: int) -> float:
    return min(1.0, 2.0 * tried * max(float(stats.t.sf(score, freedom)), _SMALLEST))
