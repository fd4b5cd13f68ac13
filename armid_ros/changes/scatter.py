# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Scatter of estimates of healthy arms between bags, estimated from all arms of a kind.

A value of a series is theta + c + e. The effect of the day, c, is the same for all arms of a
kind, for example by the temperature of a hall. It is estimated by median polish (Tukey 1977). The
part e has the variance s^2 + t^2: s is the standard deviation of the bag's estimate, and t the
additional scatter between bags. The scatter follows from the median of squared differences of
neighbours, which a step or slow trend does not change.
Three further properties are estimated:

- Arms differ in their scatter. The variance of an arm is shrunk towards that of all arms, the
  more these agree (Smyth 2004).
- Scatter is correlated over days. Steps and trends of healthy arms then exceed the prediction
  from differences of neighbours. Their factor is the median of their squares, divided by that of
  chi-squared
  (genomic control; Devlin and Roeder 1999), which only needs most arms to be healthy.
- Few series determine these factors only roughly; uncertain factors are shrunk towards one.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from armid_ros.changes.statistic import MEDIAN_SQUARE, two_means
from armid_ros.motion import FloatArray
import numpy as np
from scipy import ndimage, optimize, special

#: Smallest number of bags of a tested series.
MIN_BAGS = 4
#: Smallest number of arms of a kind for a comparison of arms, or of those with a bag on a day for
#: an effect of that day.
_MIN_ARMS = 8
#: Prior degrees of freedom of the variances of arms if these do not differ.
_MAX_FREEDOM = 1e6


@dataclass(frozen=True, eq=False)
class ParameterHistory:
    """
    A parameter of an arm over time.

    Attributes
    ----------
    arm : str
        Name of the arm.
    name, joint, unit : str
        Name, joint and unit of the parameter.
    days : ndarray, shape (K,)
        Times of the bags, increasing [days since the epoch].
    values, std : ndarray, shape (K,)
        Estimates and their stated standard deviations.

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
    Spread of a parameter between bags beyond its stated uncertainty.

    Attributes
    ----------
    std : float
        Standard deviation between bags.
    freedom : float
        Degrees of freedom of `std`.
    prior_freedom : float
        Prior degrees of freedom of the variances of arms; large if arms do not differ.
    steps, trends : float
        Ratios of the steps and trends of healthy arms to those predicted from differences of
        neighbours, in standard deviations.

    """

    std: float
    freedom: float
    prior_freedom: float = _MAX_FREEDOM
    steps: float = 1.0
    trends: float = 1.0


@dataclass(frozen=True, eq=False)
class Splits:
    """
    Means of a series before and after every possible step, and its straight line.

    Attributes
    ----------
    low, high, std : ndarray, shape (K - 1,)
        Means before and after, and the standard deviation of their difference.
    slope, slope_std, start : float
        Slope of the line per day, its standard deviation, and value at the beginning; the
        deviation is infinite if all bags are of one day.
    freedom : float
        Degrees of freedom of the variance.

    """

    low: FloatArray
    high: FloatArray
    std: FloatArray
    slope: float
    slope_std: float
    start: float
    freedom: float

    @property
    def scores(self) -> FloatArray:
        """Return the steps in standard deviations, shape (K - 1,)."""
        return np.asarray(np.abs(self.high - self.low) / self.std)

    @property
    def trend(self) -> float:
        """Return the trend in standard deviations."""
        return abs(self.slope) / self.slope_std if self.slope_std < np.inf else 0.0


def splits(series: ParameterHistory, spread: Spread) -> Splits:
    """Return the steps and the trend of a series, in standard deviations of neighbours."""
    variance, freedom = variances(series, spread)
    std = np.sqrt(variance)
    # outliers are clipped to three standard deviations around the median of five bags
    windows = np.lib.stride_tricks.sliding_window_view(series.values, min(5, len(series.values)))
    nearest = np.clip(np.arange(len(std)) - 2, 0, len(windows) - 1)
    middle = np.median(windows, axis=1)[nearest]
    x = np.clip(series.values, middle - 3.0 * std, middle + 3.0 * std)
    weights = 1.0 / variance
    return Splits(*two_means(x, weights), *line(series.days, x, weights), freedom)


def spreads(series: Sequence[ParameterHistory]) -> dict[tuple[str, str], Spread]:
    """Return the spread of each parameter beyond its stated uncertainty."""
    found = {parameter: _spread(group) for parameter, group in by_parameter(series).items()}
    names: dict[str, list[ParameterHistory]] = {}
    for one in series:
        names.setdefault(one.name, []).append(one)
    prior_freedom = {name: _prior_freedom(group, found) for name, group in names.items()}
    found = {
        one: replace(spread, prior_freedom=prior_freedom[one[0]]) for one, spread in found.items()
    }
    factors = {name: _lasting(group, found) for name, group in names.items()}
    return {
        one: replace(spread, steps=factors[one[0]][0], trends=factors[one[0]][1])
        for one, spread in found.items()
    }


def without_days(series: Sequence[ParameterHistory]) -> list[ParameterHistory]:
    """
    Subtract the effect of each day, which all siblings share.

    The effect is proportional to the size of the parameter, as for friction that falls with
    temperature. Days on which few siblings have bags are unchanged.

    """
    changed: dict[int, ParameterHistory] = {}
    for group in by_parameter(series).values():
        for one, values in zip(group, _polished(group), strict=True):
            changed[id(one)] = replace(one, values=values)
    return [changed[id(one)] for one in series]


def by_parameter(
    series: Sequence[ParameterHistory],
) -> dict[tuple[str, str], list[ParameterHistory]]:
    """Return the series of all arms of each parameter, by name and joint."""
    groups: dict[tuple[str, str], list[ParameterHistory]] = {}
    for one in series:
        groups.setdefault(one.parameter, []).append(one)
    return groups


def _polished(group: Sequence[ParameterHistory]) -> list[FloatArray]:
    """Return values without the effects of days, by a median polish with the arms' levels."""
    days = np.concatenate([np.floor(one.days) for one in group])
    arm = np.repeat(np.arange(len(group)), [len(one.days) for one in group])
    values = np.concatenate([one.values for one in group])
    _, day = np.unique(days, return_inverse=True)
    arms_of_day = np.bincount(np.unique(np.stack([day, arm]), axis=1)[0], minlength=day.max() + 1)
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
    return np.split(rest, np.cumsum([len(one.days) for one in group])[:-1])


def _spread(group: Sequence[ParameterHistory]) -> Spread:
    """Solve median(d^2 / (s_k^2 + s_k+1^2 + 2 t^2)) = median of chi^2 for t."""
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
    group: Sequence[ParameterHistory], found: Mapping[tuple[str, str], Spread]
) -> float:
    """
    Return the prior degrees of freedom of the variances of arms (empirical Bayes).

    The logarithms of variance ratios have the variance trigamma(d_a / 2) + trigamma(d_0 / 2). The
    degrees d_a are those of one series, and the equation is solved for d_0. Only scatter beyond
    one standard error is a difference between arms.

    """
    tested = [one for one in group if len(one.values) >= MIN_BAGS]
    if len(tested) < _MIN_ARMS:
        return _MAX_FREEDOM
    logs = np.log([_ratio(one, found[one.parameter]) for one in tested])
    own = [_trigamma(0.5 * _freedom(len(one.values))) for one in tested]
    # relative standard error of a variance from the median of n absolute deviations
    sure = 1.0 - 2.33 / np.sqrt(len(logs))
    beyond = sure * _robust_scale(logs) ** 2 - float(np.mean(own))
    return _inverse_trigamma(beyond)


def _ratio(series: ParameterHistory, spread: Spread) -> float:
    """Return the ratio of the variance of a series to the usual variance."""
    stated = series.std[1:] ** 2 + series.std[:-1] ** 2 + 2.0 * spread.std**2
    squares = np.diff(series.values) ** 2 / np.maximum(stated, 1e-300)
    return max(float(np.median(squares)) / MEDIAN_SQUARE, 1e-100)


@cache
def _freedom(bags: int) -> float:
    """Return the degrees of freedom of the variance of a number of bags, from white noise."""
    noise = np.random.default_rng(0).normal(size=(4000, bags))  # series of white noise
    medians = np.median(np.diff(noise, axis=1) ** 2, axis=1)
    return _inverse_trigamma(_robust_scale(np.log(medians)) ** 2)


def _robust_scale(values: FloatArray) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _trigamma(x: float) -> float:
    return float(special.polygamma(1, x))


def _inverse_trigamma(value: float) -> float:
    """Return 2 x with trigamma(x) = value, between 1 and `_MAX_FREEDOM`."""
    if value <= _trigamma(0.5 * _MAX_FREEDOM):
        return _MAX_FREEDOM
    if value >= _trigamma(0.5):
        return 1.0
    return 2.0 * float(optimize.brentq(lambda x: _trigamma(x) - value, 0.5, 0.5 * _MAX_FREEDOM))


def variances(series: ParameterHistory, spread: Spread) -> tuple[FloatArray, float]:
    """Return the variance of every value, shape (K,), and its degrees of freedom."""
    usual = np.maximum(series.std**2 + spread.std**2, 1e-300)
    if len(series.values) < MIN_BAGS or spread.prior_freedom >= _MAX_FREEDOM:
        return usual, spread.freedom
    ratio, freedom = _ratio(series, spread), _freedom(len(series.values))
    both = spread.prior_freedom + freedom
    return usual * (spread.prior_freedom + freedom * ratio) / both, min(
        both, spread.freedom + freedom
    )


def _lasting(
    group: Sequence[ParameterHistory], found: dict[tuple[str, str], Spread]
) -> tuple[float, float]:
    """Return `steps` and `trends` of a `Spread`, each 1 or more."""
    steps, trends = [], []
    for one in group:
        if len(one.values) < MIN_BAGS:
            continue
        cut = splits(one, found[one.parameter])
        third = len(cut.scores) // 3
        steps.append(float(np.median(cut.scores[third : len(cut.scores) - third] ** 2)))
        trends.append(cut.trend**2)
    if not steps:
        return 1.0, 1.0
    # the prior (scatter is uncorrelated over days) has the weight of 10 series
    weight = len(steps) / (len(steps) + 10.0)
    step, trend = (
        max(1.0, float(np.median(squares)) / MEDIAN_SQUARE) ** (0.5 * weight)
        for squares in (steps, trends)
    )
    return step, trend


def line(days: FloatArray, x: FloatArray, weights: FloatArray) -> tuple[float, float, float]:
    """Return slope, its standard deviation and start value of a weighted straight line."""
    total = weights.sum()
    middle, mean = weights @ days / total, weights @ x / total
    away = days - middle
    inertia = float(weights @ away**2)
    if not inertia > 0.0:
        return 0.0, np.inf, float(mean)
    slope = float(weights @ (away * (x - mean))) / inertia
    return slope, 1.0 / np.sqrt(inertia), float(mean + slope * (days[0] - middle))
