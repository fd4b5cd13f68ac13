# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Null distribution of likelihood ratios and residuals, and critical values of the tests.

Twice the log-likelihood ratio is chi-square with p degrees of freedom if noise is white and the
model is exact. Coloured noise and model discrepancy multiply it by a factor of at least 1, which
is measured for every candidate while nothing changes. The statistic over its factor then has
Fisher's F distribution, whose second degrees of freedom increase with the number of windows.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence

from armid_ros.changes.statistic import limits, MEDIAN_SQUARE
from armid_ros.identification.online.background import Job
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats

#: Tail probability of the quantile that shows whether large statistics are too frequent.
_TAIL_PROBABILITY = 0.01
#: Number of blocks kept: one minute at four blocks per second.
MAX_BLOCKS = 240


class NullCalibration:
    """
    Critical values of the change tests, calibrated while the arm does not change.

    The factor of a statistic is the ratio of its mean to its mean in white noise; the largest 5 %
    are limited to their quantile. The mean covers the last three quarters of at most ten
    minutes, so early windows soon lose their influence. Few windows determine a factor only
    roughly. The factors of one arm are similar, so uncertain factors are shrunk towards the mean
    of all (Efron and Morris 1975). If large statistics are more frequent than expected from the
    mean, as with model discrepancy at reversals, the 99 % quantile of all statistics raises the
    limits.

    Parameters
    ----------
    sizes : sequence of int
        Degrees of freedom of each statistic.
    overlap : int
        Length of a window in blocks; windows at this distance are independent.
    sources : int
        Number of independent sources of noise in the statistics, such as joints.

    """

    def __init__(self, sizes: Sequence[int], overlap: int, sources: int) -> None:
        # tail probability of the quantile to which larger statistics are limited in the mean
        tail_share = 0.05
        # number of windows kept: ten minutes at four windows per second
        memory = 2400
        self._sizes = np.array(sizes)
        shared = np.arange(1, overlap) / overlap
        self._overlap = 1.0 + 2.0 * float(np.sum(shared**2))  # windows per independent window
        self._sources = sources
        self._ratios: deque[FloatArray] = deque(maxlen=memory)
        self._strengths: deque[FloatArray] = deque(maxlen=memory)
        self._first = np.cumsum([0, *sizes[:-1]])
        self._strength = np.zeros(int(np.sum(sizes)))
        self._clip = stats.chi2.isf(tail_share, self._sizes)
        below = self._sizes * stats.chi2.cdf(self._clip, self._sizes + 2)
        square = self._sizes * (self._sizes + 2) * stats.chi2.cdf(self._clip, self._sizes + 4)
        self._n_new = 0
        self._tail_quantile = stats.chi2.isf(_TAIL_PROBABILITY, self._sizes)
        self._tail = 1.0
        self._limits: tuple[float, FloatArray] | None = None
        self._mean = below + tail_share * self._clip
        # variance of the logarithm of a factor that is estimated from one window
        self._variance = (square + tail_share * self._clip**2 - self._mean**2) / below**2
        self.factors = np.full(len(sizes), np.nan)
        self._freedom = np.zeros(len(sizes))

    def update(self, ratios: FloatArray, strength: FloatArray) -> Job:
        """
        Update the critical values with a window in which the arm did not change.

        Parameters
        ----------
        ratios : ndarray, shape (C,)
            Twice the logarithms of the likelihood ratios; 0: no data.
        strength : ndarray, shape (Q,)
            Sum of squared torques per unit of each quantity.

        """
        if not np.any(ratios > 0.0):
            return
        self._ratios.append(ratios)
        self._strengths.append(strength)
        self._n_new += 1
        if self._n_new < max(8, 0.05 * len(self._ratios)):  # often enough
            return
        self._n_new = 0
        yield
        strengths = np.array(self._strengths)
        for columns in _in_pieces(strengths):
            some = strengths[:, columns]
            self._strength[columns] = np.quantile(some, 0.9, axis=0)
            yield
        yield from self._fit_factors(np.array(self._ratios)[len(self._ratios) // 4 :])

    def _fit_factors(self, later: FloatArray) -> Job:
        """Estimate the factors of test statistics from windows without a change, (K, C)."""
        counts = np.sum(later > 0.0, axis=0)
        independent = counts / self._overlap
        valid = independent >= 12.0  # too few independent windows for a test
        if not valid.any():
            return
        single = np.full(len(self._sizes), np.nan)
        for columns in _in_pieces(later):
            some = np.arange(len(single))[columns][valid[columns]]
            # factors that give the means of the limited statistics their white-noise values
            seen, most, mean = later[:, some], self._clip[some], self._mean[some] * counts[some]
            factor = np.sum(seen, axis=0) / (self._sizes[some] * counts[some])
            for _ in range(8):  # until both converge
                factor = factor * np.sum(np.minimum(seen / factor, most), axis=0) / mean
            single[some] = np.log(factor)
            yield
        # shrunk towards their mean according to their uncertainty
        value, variance = single[valid], self._variance[valid] / independent[valid]
        middle = float(np.average(value, weights=1.0 / variance))
        between = float(np.average((value - middle) ** 2 - variance, weights=1.0 / variance))
        spread = max(between, 0.1**2)  # smallest variance between the logarithms of the factors
        middle = float(np.average(value, weights=1.0 / (variance + spread)))
        shrinkage = variance / (variance + spread)
        remaining = shrinkage * spread + shrinkage**2 * np.mean(variance + spread) / self._sources
        factors = np.full(len(self._sizes), np.nan)
        factors[valid] = np.exp(value + shrinkage * (middle - value)).clip(1.0)
        yield
        # 99 % quantile of the statistics, each over its quantile in white noise; zero: no data
        relative = (later[:, valid] / (factors * self._tail_quantile)[valid]).ravel()
        count = np.count_nonzero(relative)
        place = len(relative) - count + (1.0 - _TAIL_PROBABILITY) * (count - 1)
        # a partition takes less time than numpy's quantile
        largest = np.sort(np.partition(relative, int(place))[int(place) :])
        tail = float(np.interp(place % 1.0, np.arange(len(largest)), largest))
        self.factors, self._tail = factors, max(1.0, tail)
        self._freedom = np.zeros(len(self._sizes))
        self._freedom[valid] = 2.0 / remaining  # a mean square of k degrees varies by 2 / k
        self._limits = None

    def excess(self, ratios: FloatArray, strength: FloatArray, chance: float) -> FloatArray:
        """
        Return test statistics divided by their critical values; 0 before calibration.

        Model discrepancy has biased the parameters, so the critical values are larger for motion
        that is stronger than usual.

        Parameters
        ----------
        ratios, strength : ndarray
            Statistics of one window, as in `update`.
        chance : float
            Probability of a false alarm of each statistic.

        """
        valid = self._freedom > 0.0
        if self._limits is None or self._limits[0] != chance:
            self._limits = chance, limits(chance, self._sizes[valid], self._freedom[valid])
        result = np.zeros(len(self._sizes))
        relative = strength / self._strength.clip(1e-100)
        stronger = np.maximum.reduceat(relative, self._first).clip(1.0)
        # the next motion may have 1.3 times the model discrepancy of earlier motions
        usual = 1.0 + (1.3 * self._tail * self.factors[valid] - 1.0) * stronger[valid]
        result[valid] = ratios[valid] / (usual * self._limits[1])
        return result


def _in_pieces(values: FloatArray) -> Iterator[slice]:
    """Yield slices of an array's columns, each small enough for a short computation."""
    width = max(1, 4_000 // max(1, len(values)))
    for first in range(0, values.shape[1], width):
        yield slice(first, first + width)


class ResidualScale:
    """
    Standard deviation of each joint's residual, relative to the assumed noise.

    Residuals are summed over a block, in which fast errors cancel. The scale is the median over
    blocks, so first blocks and a change that is not yet detected hardly affect it.

    Parameters
    ----------
    least : float
        Lower bound of the factor [-].

    """

    def __init__(self, least: float) -> None:
        self._least = least
        self._blocks: deque[FloatArray] = deque(maxlen=MAX_BLOCKS)
        self._value: FloatArray | None = None

    @property
    def value(self) -> FloatArray:
        """Ratio of residual standard deviation to assumed noise by joint, (m,); at first 1."""
        return np.ones(1) if self._value is None else self._value

    def learn(self, residual: FloatArray, weights: FloatArray) -> None:
        """Update the scale with residuals of a block, in units of the assumed noise, (k, m)."""
        used = np.sum(weights > 0.0, axis=0)
        if not used.any():
            return  # residuals during motion are kept while the arm is at rest
        squares = np.sum(residual, axis=0) ** 2
        self._blocks.append(np.where(used > 0, squares / np.maximum(used, 1), np.nan))
        if len(self._blocks) < 16:  # with fewer blocks, the assumed noise is used
            return
        later = np.array(list(self._blocks)[len(self._blocks) // 2 :])
        known = np.any(later > 0.0, axis=0)
        value = np.ones(later.shape[1]) if self._value is None else self._value.copy()
        # medians of the columns without NaN; numpy's nanmedian takes ten times as long
        values = later[:, known]
        ordered, counts = np.sort(values, axis=0), np.sum(~np.isnan(values), axis=0)
        columns = np.arange(values.shape[1])
        medians = (ordered[(counts - 1) // 2, columns] + ordered[counts // 2, columns]) / 2.0
        value[known] = np.sqrt(medians / MEDIAN_SQUARE)
        self._value = np.maximum(value, self._least)
