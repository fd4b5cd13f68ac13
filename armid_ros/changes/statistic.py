# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tests for changes: tail probabilities, change points, and multiple-test corrections."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import special, stats

#: Median of a squared standard normal variable [-].
MEDIAN_SQUARE = float(stats.chi2(1).median())


def tail(
    square: npt.ArrayLike, rank: npt.ArrayLike, freedom: npt.ArrayLike = np.inf
) -> FloatArray:
    """
    Return the p-value of `square`, a quadratic form of z-scores, if nothing changed.

    Parameters
    ----------
    square : array_like
        Quadratic form in units of the noise.
    rank : array_like
        Degrees of freedom of the quadratic form.
    freedom : array_like
        Degrees of freedom of the noise variance; infinite where the variance is known.

    """
    known = np.isfinite(freedom)
    ratio = np.asarray(square) / rank
    fisher = stats.f.sf(ratio, rank, np.where(known, freedom, 1.0))
    return np.asarray(np.where(known, fisher, stats.chi2.sf(square, rank)))


def limits(chance: float, rank: FloatArray, freedom: FloatArray) -> FloatArray:
    """
    Return the thresholds that quadratic forms exceed with probability `chance`, shape (k,).

    Parameters
    ----------
    chance : float
        Probability that a quadratic form exceeds its threshold, if nothing changed.
    rank, freedom : ndarray, shape (k,)
        Degrees of freedom of each quadratic form, and of its noise variance.

    """
    # Fisher's distribution by the beta distribution, as scipy.stats takes ten times as long
    share = special.betaincinv(0.5 * freedom, 0.5 * rank, chance)
    return np.asarray(freedom * (1.0 - share) / share)


def two_means(x: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return the weighted means of values before and after each possible change point.

    Parameters
    ----------
    x : ndarray, shape (K, ...)
        Values.
    weights : ndarray, shape (K, ...)
        Inverse variances.

    Returns
    -------
    low, high, std : ndarray, shape (K - 1, ...)
        Means before and after, and the standard deviation of their difference.

    """
    before, after = np.cumsum(weights, axis=0)[:-1], np.cumsum(weights[::-1], axis=0)[::-1][1:]
    low = np.cumsum(weights * x, axis=0)[:-1] / before
    high = np.cumsum((weights * x)[::-1], axis=0)[::-1][1:] / after
    return low, high, np.sqrt(1.0 / before + 1.0 / after)


def beyond_chance(p_values: Sequence[float] | FloatArray, error_rate: float) -> list[bool]:
    """Return whether each p-value is significant at `error_rate` over all tests (Holm 1979)."""
    beyond = [False] * len(p_values)
    for tried, index in enumerate(np.argsort(p_values)):
        if p_values[index] > error_rate / (len(p_values) - tried):
            break
        beyond[int(index)] = True
    return beyond
