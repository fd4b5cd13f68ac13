# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Tests for steps and trends in series of estimates, with control of false discoveries in a fleet.

A value of a series is theta + c + e. The common effect of a day, c, is the same for all arms of a
kind, for example by the temperature of a hall. It is estimated by median polish (Tukey 1977) and
subtracted. The error e has the variance s^2 + t^2: s is the standard deviation of the bag's
estimate, and t the additional scatter between bags. The scatter follows from the median of squared
differences of successive values, which a step or slow trend does not change. Three further
properties are estimated from all arms of a kind:

- Arms differ in their scatter. The variance of an arm is shrunk towards that of all arms, the
  more these agree (Smyth 2004).
- Scatter is correlated over days. Steps and trends of healthy arms are then larger than expected
  from differences of successive values. The inflation factor is the median of the squared steps or
  trends over that of chi-squared (genomic control; Devlin and Roeder 1999). It only needs most
  arms to be healthy.
- Few series determine these factors only roughly; uncertain factors are shrunk towards one.

A bag that differs from the median of its neighbours by more than noise is an outlier, not a
change. Its value is limited to the range of the noise (Hampel 1974). After a lasting change,
neighbours agree.

The largest step and the trend of every series of an arm are tested, with Bonferroni's factor for
the number of tests. Over arms, the false discovery rate is controlled (Benjamini and Hochberg
1995): in the long run, at most a share alpha of the named arms is healthy.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, NamedTuple

from armid_ros.changes.statistic import MEDIAN_SQUARE, tail, two_means
from armid_ros.motion import FloatArray
import numpy as np
from scipy import ndimage, optimize, special, stats

Kind = Literal['step', 'trend']

#: Smallest number of bags of a tested series.
_MIN_BAGS = 4
#: Smallest number of arms of a kind for a comparison of arms; smallest number of arms with bags of
#: a day for the common effect of that day.
_MIN_ARMS = 8
#: Prior degrees of freedom of the variances of arms if these do not differ.
_MAX_FREEDOM = 1e6
#: Mean length of a month [days].
MONTH = 365.25 / 12.0
#: Second derivative of the logarithm of the gamma function.
_trigamma = partial(special.polygamma, 1)


@dataclass(frozen=True, eq=False)
class ParameterHistory:
    """
    Estimates of one parameter of an arm from successive recordings.

    Attributes
    ----------
    arm : str
        Name of the arm.
    name, joint, unit : str
        Name, joint and unit of the parameter.
    days : ndarray, shape (K,)
        Times of the bags, increasing [days since the epoch].
    values, std : ndarray, shape (K,)
        Estimates from the bags, and their standard deviations.

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
        """Name and joint of the parameter."""
        return self.name, self.joint


@dataclass(frozen=True)
class Spread:
    """
    Scatter of a parameter between recordings, beyond the standard errors of its estimates.

    Attributes
    ----------
    std : float
        Additional standard deviation between bags.
    freedom : float
        Degrees of freedom of `std`.
    prior_freedom : float
        Prior degrees of freedom of the variances of arms; large if arms do not differ.
    steps, trends : float
        Inflation factors: steps and trends of healthy arms over those expected from differences
        of successive values.

    """

    std: float
    freedom: float
    prior_freedom: float = _MAX_FREEDOM
    steps: float = 1.0
    trends: float = 1.0


@dataclass(frozen=True)
class HistoryChange:
    """
    Largest step in the estimates of a parameter over time, or their linear trend.

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
    Significance of steps and trends over time in the parameters of one arm.

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
    Test the parameters of all arms for steps and trends over time; return a result per arm.

    Parameters
    ----------
    kinds : sequence of (sequence of ParameterHistory, mapping)
        For each kind of arm: the series of all parameters of all arms, without common effects of
        days, and their scatter; see ``without_days`` and ``spreads``.

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
            if len(one.values) >= _MIN_BAGS:
                found.append(_largest_change(one, spread[one.parameter]))
        for arm, changes in by_arm.items():
            changes.sort(key=lambda change: (change.p, -abs(change.size) / change.std))
            p = min(1.0, len(changes) * changes[0].p) if changes else 1.0
            arms.append((arm, tuple(changes), p))
    adjusted = stats.false_discovery_control([p for _, _, p in arms]) if arms else []
    judged = [Judged(*arm, float(q)) for arm, q in zip(arms, adjusted, strict=True)]
    return sorted(judged, key=lambda one: (one.adjusted, one.p, one.arm))


def significant(judged: Judged, alpha: float) -> tuple[HistoryChange, ...]:
    """Return the significant parameter changes of an arm at false discovery rate alpha."""
    if judged.adjusted > alpha or not judged.changes:
        return ()
    limit = alpha * judged.p / judged.adjusted / len(judged.changes)
    return tuple(change for change in judged.changes if change.p <= limit)


def wear(series: ParameterHistory, spread: Spread) -> tuple[float, float]:
    """Return the linear trend of a parameter per month, and the trend's standard deviation."""
    slope, std, _ = _line(series.days, series.values, 1.0 / _variances(series, spread)[0])
    return slope * MONTH, std * spread.trends * MONTH


def spreads(series: Sequence[ParameterHistory]) -> dict[tuple[str, str], Spread]:
    """Return the scatter between recordings of each parameter, by parameter name and joint."""
    found = {parameter: _spread(group) for parameter, group in _by_parameter(series).items()}
    for name in dict.fromkeys(one.name for one in series):  # of all joints together
        group = [one for one in series if one.name == name]
        freedom = _prior_freedom(group, found)
        own = {key: replace(found[key], prior_freedom=freedom) for key in found if key[0] == name}
        steps, trends = _inflation(group, own)
        found |= {key: replace(one, steps=steps, trends=trends) for key, one in own.items()}
    return found


def without_days(series: Sequence[ParameterHistory]) -> list[ParameterHistory]:
    """
    Return the series minus the daily deviation that all arms have in common.

    The shared deviation is proportional to the size of the parameter, as for friction that falls
    with temperature. A median polish estimates it. Days on which few arms have bags are
    unchanged.

    """
    changed: dict[int, ParameterHistory] = {}
    for group in _by_parameter(series).values():
        days = np.concatenate([np.floor(one.days) for one in group])
        arm = np.repeat(np.arange(len(group)), [len(one.days) for one in group])
        values = np.concatenate([one.values for one in group])
        _, day = np.unique(days, return_inverse=True)
        arms_of_day = np.bincount(np.unique(np.stack([day, arm]), axis=1)[0])
        arms, dates = np.arange(len(group)), np.arange(len(arms_of_day))
        level = ndimage.median(values, arm, arms)
        middle = float(np.median(level))
        same_sign = bool(np.all(level * middle > 0.0))
        share = level / middle if same_sign else np.ones(len(level))
        common = np.zeros(len(arms_of_day))
        for _ in range(4):
            common = ndimage.median((values - level[arm]) / share[arm], day, dates)
            common[arms_of_day < _MIN_ARMS] = 0.0
            level = ndimage.median(values - share[arm] * common[day], arm, arms)
        rest = values - share[arm] * common[day]
        ends = np.cumsum([len(one.days) for one in group])[:-1]
        for one, own in zip(group, np.split(rest, ends), strict=True):
            changed[id(one)] = replace(one, values=own)
    return [changed[id(one)] for one in series]


def _largest_change(series: ParameterHistory, spread: Spread) -> HistoryChange:
    """Return the most significant step of a parameter, or an equally likely linear trend."""
    split, count = _splits(series, spread), len(series.values)
    scores, trend = split.scores / spread.steps, split.trend / spread.trends
    best = int(np.argmax(scores))
    # the search for the position of a step costs log(count); a trend has no position
    if trend**2 + np.log(count) >= scores[best] ** 2:
        p = _p(trend, split.freedom, count)
        std = split.slope_std * spread.trends * MONTH
        return HistoryChange(series, 'trend', 0, split.slope * MONTH, std, split.start, p)
    p = _p(float(scores[best]), split.freedom, count)
    size, std = float(split.high[best] - split.low[best]), float(split.std[best]) * spread.steps
    return HistoryChange(series, 'step', best + 1, size, std, float(split.low[best]), p)


def _p(score: float, freedom: float, tried: int) -> float:
    """Return the p-value of `score`, the largest of `tried` z-scores, by Bonferroni."""
    # lower bound of the p-value, which underflows for larger scores
    return min(1.0, tried * max(float(tail(score**2, 1, freedom)), 1e-300))


class _Splits(NamedTuple):
    """Mean estimates before and after each possible step, and a line fitted to all estimates."""

    low: FloatArray  # (K - 1,)
    high: FloatArray
    std: FloatArray  # of the difference
    scores: FloatArray  # steps in standard deviations
    slope: float  # per day
    slope_std: float  # infinite if all bags are of one day
    start: float  # value of the line at the beginning
    trend: float  # slope in standard deviations
    freedom: float  # degrees of freedom of the variance


def _splits(series: ParameterHistory, spread: Spread) -> _Splits:
    """Fit a step after each value of a series, and a straight line to all values."""
    variance, freedom = _variances(series, spread)
    std = np.sqrt(variance)
    # outliers are clipped to three standard deviations around the median of five bags
    windows = np.lib.stride_tricks.sliding_window_view(series.values, min(5, len(series.values)))
    nearest = np.clip(np.arange(len(std)) - 2, 0, len(windows) - 1)
    middle = np.median(windows, axis=1)[nearest]
    x = np.clip(series.values, middle - 3.0 * std, middle + 3.0 * std)
    weights = 1.0 / variance
    low, high, difference_std = two_means(x, weights)
    scores = np.abs(high - low) / difference_std
    slope, slope_std, start = _line(series.days, x, weights)
    trend = abs(slope) / slope_std if slope_std < np.inf else 0.0
    return _Splits(low, high, difference_std, scores, slope, slope_std, start, trend, freedom)


def _by_parameter(
    series: Sequence[ParameterHistory],
) -> dict[tuple[str, str], list[ParameterHistory]]:
    groups: dict[tuple[str, str], list[ParameterHistory]] = {}
    for one in series:
        groups.setdefault(one.parameter, []).append(one)
    return groups


def _spread(group: Sequence[ParameterHistory]) -> Spread:
    """Estimate the scatter of a parameter between recordings from successive differences."""
    # the scatter t solves median(d^2 / (s_k^2 + s_k+1^2 + 2 t^2)) = median of chi-squared
    squares = np.concatenate([np.diff(one.values) ** 2 for one in group])
    stated = np.concatenate([one.std[1:] ** 2 + one.std[:-1] ** 2 for one in group])
    # degrees of freedom of a variance from the median of n squares
    freedom = max(1.0, 0.37 * len(squares))
    if not len(squares):
        return Spread(0.0, freedom)

    def excess(extra: float) -> float:
        return float(np.median(squares / np.maximum(stated + 2.0 * extra, 1e-300))) - MEDIAN_SQUARE

    most = float(np.max(squares)) + 1e-300
    extra = 0.0
    if excess(0.0) > 0.0 > excess(most):
        extra = float(optimize.brentq(excess, 0.0, most, xtol=1e-9 * most, rtol=1e-6))
    return Spread(float(np.sqrt(extra)), freedom)


def _prior_freedom(
    group: Sequence[ParameterHistory], scatters: Mapping[tuple[str, str], Spread]
) -> float:
    """
    Return prior degrees of freedom for the variances of single arms, by empirical Bayes.

    The logarithms of variance ratios have the variance trigamma(d_a / 2) + trigamma(d_0 / 2). The
    degrees of freedom of one series are d_a, and the equation is solved for d_0. Only scatter
    beyond one standard error is a difference between arms.

    """
    tested = [one for one in group if len(one.values) >= _MIN_BAGS]
    if len(tested) < _MIN_ARMS:
        return _MAX_FREEDOM
    logs = np.log([_ratio(one, scatters[one.parameter]) for one in tested])
    own = [_trigamma(0.5 * _freedom(len(one.values))) for one in tested]
    # relative standard error of a variance from the median of n absolute deviations
    sure = 1.0 - 2.33 / np.sqrt(len(logs))
    scale = float(stats.median_abs_deviation(logs, scale='normal'))
    beyond = sure * scale**2 - float(np.mean(own))
    if beyond <= _trigamma(0.5 * _MAX_FREEDOM):
        return _MAX_FREEDOM
    if beyond >= _trigamma(0.5):
        return 1.0
    ends = 0.5, 0.5 * _MAX_FREEDOM
    return 2.0 * float(optimize.brentq(lambda half: _trigamma(half) - beyond, *ends))


def _ratio(series: ParameterHistory, spread: Spread) -> float:
    """Return the variance of one series divided by the variance expected from all arms."""
    stated = series.std[1:] ** 2 + series.std[:-1] ** 2 + 2.0 * spread.std**2
    squares = np.diff(series.values) ** 2 / np.maximum(stated, 1e-300)
    return max(float(np.median(squares)) / MEDIAN_SQUARE, 1e-100)


def _freedom(bags: int) -> float:
    """Return the degrees of freedom of a variance estimated from `bags` successive values."""
    # a line through simulated series of white noise; right to 6 % from 4 to 80 bags
    return 0.8 + 0.31 * bags


def _variances(series: ParameterHistory, spread: Spread) -> tuple[FloatArray, float]:
    """Return the variance of each estimate, (K,), and the degrees of freedom of the variances."""
    usual = np.maximum(series.std**2 + spread.std**2, 1e-300)
    if len(series.values) < _MIN_BAGS or spread.prior_freedom >= _MAX_FREEDOM:
        return usual, spread.freedom
    ratio, freedom = _ratio(series, spread), _freedom(len(series.values))
    both = spread.prior_freedom + freedom
    shrunk = usual * (spread.prior_freedom + freedom * ratio) / both
    return shrunk, min(both, spread.freedom + freedom)


def _inflation(
    group: Sequence[ParameterHistory], scatters: dict[tuple[str, str], Spread]
) -> tuple[float, float]:
    """Return inflation factors (at least 1) for the steps and the trends of healthy arms."""
    steps, trends = [], []
    for one in group:
        if len(one.values) < _MIN_BAGS:
            continue
        split = _splits(one, scatters[one.parameter])
        third = len(split.scores) // 3
        steps.append(float(np.median(split.scores[third : len(split.scores) - third] ** 2)))
        trends.append(split.trend**2)
    if not steps:
        return 1.0, 1.0
    # the prior (scatter is uncorrelated over days) has the weight of 10 series
    weight = len(steps) / (len(steps) + 10.0)
    step, trend = (
        max(1.0, float(np.median(squares)) / MEDIAN_SQUARE) ** (0.5 * weight)
        for squares in (steps, trends)
    )
    return step, trend


def _line(days: FloatArray, x: FloatArray, weights: FloatArray) -> tuple[float, float, float]:
    """Return slope, standard deviation of the slope, and first value of a weighted line."""
    total = weights.sum()
    middle, mean = weights @ days / total, weights @ x / total
    deviation = days - middle
    inertia = float(weights @ deviation**2)
    if not inertia > 0.0:
        return 0.0, np.inf, float(mean)
    slope = float(weights @ (deviation * (x - mean))) / inertia
    return slope, 1.0 / np.sqrt(inertia), float(mean + slope * (days[0] - middle))
