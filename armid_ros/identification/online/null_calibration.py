# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Distribution of likelihood ratios and residuals while nothing changes, and the limit that it gives.

Twice the logarithm is chi-square of p degrees only if noise is white and the model right. Noise
that is coloured, and what the model lacks, make it larger, by a factor that is measured for every
candidate while nothing changes and is 1 at least. The ratio of the two is then of Fisher's
distribution, its degrees of freedom counting how much was measured.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armid_ros.changes.statistic import limits, MEDIAN_SQUARE
from armid_ros.identification.online.background import Job, Pieces
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats

#: Windows that are remembered: ten minutes of four a second.
_MEMORY = 2400
#: Windows between two looks at how large statistics usually are, and as a share of all.
_EVERY = 8
_SHARE = 0.05
#: The usual size is measured by what so many exceed.
_TAIL = 0.05
#: Quantile of all statistics that shows whether large ones are more frequent than in noise.
_RARE = 0.01
#: Standard deviation of the logarithms of usual sizes, at the least.
_LEAST_SPREAD = 0.1
#: The next motion may show so much more of what the model lacks than those before.
_MARGIN = 1.3
#: What is divided by is at least this.
_SMALLEST = 1e-100
#: What is stronger than this share of all windows is stronger than usual.
_STRONG = 0.1
#: Rounds in which factors and what is limited by them settle.
_ROUNDS = 8
#: Independent windows before anything is judged.
_FEWEST = 12.0
#: Numbers that are looked at in one piece of work.
_AT_A_TIME = 4_000
#: Blocks that are remembered: a minute of four a second.
_BLOCKS = 240
#: Blocks before the assumption is given up.
_FEWEST_BLOCKS = 16


class History:
    """
    Buffer of the last rows of numbers.

    Parameters
    ----------
    width : int
        Numbers in a row.
    most : int
        Rows that are remembered.

    """

    def __init__(self, width: int, most: int) -> None:
        self._rows = np.empty((16, width))
        self._most = most
        self._end = 0

    def __len__(self) -> int:
        """Return the number of rows."""
        return min(self._end, self._most)

    def append(self, row: FloatArray) -> None:
        """Append a row."""
        if self._end == len(self._rows):
            kept = self.values
            size = min(2 * len(self._rows), 2 * self._most)
            self._rows = np.empty((size, self._rows.shape[1]))
            self._rows[: len(kept)] = kept
            self._end = len(kept)
        self._rows[self._end] = row
        self._end += 1

    @property
    def values(self) -> FloatArray:
        """Return a view of the rows, oldest first; later appends do not change it."""
        return self._rows[self._end - len(self) : self._end]


class NullCalibration:
    """
    Calibration of test statistics against those of white noise.

    By their mean, in which what one in twenty exceeds counts as that and no more, over the later
    three quarters of what was seen and ten minutes at most: so what came while little was known,
    or before a change was noticed, soon has no part in it. A few windows determine a factor only
    roughly; those of other statistics, of the same arm and motion, are much the same, and each is
    drawn towards their mean as far as it is less certain than they are different (Efron and
    Morris 1975). Where large ones come more often than the mean suggests, as where the model lacks
    what happens at reversals, by what one in a hundred of all statistics exceeds.

    Parameters
    ----------
    sizes : sequence of int
        Degrees of freedom of each statistic.
    overlap : int
        Successive windows of which one is independent of the one before.
    sources : int
        Independent sources of noise, such as joints, that the statistics look at.

    """

    def __init__(self, sizes: Sequence[int], overlap: int, sources: int) -> None:
        self._sizes = np.array(sizes)
        shared = np.arange(1, overlap) / overlap
        self._overlap = 1.0 + 2.0 * float(np.sum(shared**2))  # of squares of sums that overlap
        self._sources = sources
        self._ratios = History(len(sizes), _MEMORY)
        self._strengths = History(int(np.sum(sizes)), _MEMORY)
        self._first = np.cumsum([0, *sizes[:-1]])
        self._strength = np.zeros(int(np.sum(sizes)))
        self._most = stats.chi2.isf(_TAIL, self._sizes)
        below = self._sizes * stats.chi2.cdf(self._most, self._sizes + 2)
        square = self._sizes * (self._sizes + 2) * stats.chi2.cdf(self._most, self._sizes + 4)
        self._fresh = 0
        self._rare = stats.chi2.isf(_RARE, self._sizes)
        self._tail = 1.0
        self._limits: tuple[float, FloatArray] | None = None
        self._mean = below + _TAIL * self._most
        # of the logarithm of the factor that makes the mean right, from one window
        self._variance = (square + _TAIL * self._most**2 - self._mean**2) / below**2
        self.factors = np.full(len(sizes), np.nan)
        self._freedom = np.zeros(len(sizes))

    def learning(self, ratios: FloatArray, strength: FloatArray) -> Job:
        """
        Learn from a window without a change, in pieces.

        Parameters
        ----------
        ratios : ndarray, shape (C,)
            Twice the logarithms of the likelihood ratios; 0: no data.
        strength : ndarray, shape (Q,)
            Squares of the torques that a unit of each quantity would make.

        """
        if not np.any(ratios > 0.0):
            return
        self._ratios.append(ratios)
        self._strengths.append(strength)
        self._fresh += 1
        if self._fresh < max(_EVERY, _SHARE * len(self._ratios)):
            return
        self._fresh = 0
        yield
        strengths = self._strengths.values
        for columns in _in_pieces(strengths):
            some = strengths[:, columns]
            self._strength[columns] = np.quantile(some, 1.0 - _STRONG, axis=0)
            yield
        yield from self._look(self._ratios.values[len(self._ratios) // 4 :])

    def _look(self, later: FloatArray) -> Job:
        """Find the factors of the later windows; 0: no data."""
        counts = np.sum(later > 0.0, axis=0)
        independent = counts / self._overlap
        judged = independent >= _FEWEST
        if not judged.any():
            return
        single = np.full(len(self._sizes), np.nan)
        for columns in _in_pieces(later):
            some = np.arange(len(single))[columns][judged[columns]]
            # the factors with which the means of limited statistics are as expected
            seen, most, mean = later[:, some], self._most[some], self._mean[some] * counts[some]
            factor = np.sum(seen, axis=0) / (self._sizes[some] * counts[some])
            for _ in range(_ROUNDS):
                factor = factor * np.sum(np.minimum(seen / factor, most), axis=0) / mean
            single[some] = np.log(factor)
            yield
        # shrunk towards their mean as far as they are uncertain
        value, variance = single[judged], self._variance[judged] / independent[judged]
        middle = float(np.average(value, weights=1.0 / variance))
        apart = float(np.average((value - middle) ** 2 - variance, weights=1.0 / variance))
        spread = max(apart, _LEAST_SPREAD**2)
        middle = float(np.average(value, weights=1.0 / (variance + spread)))
        drawn = variance / (variance + spread)
        left = drawn * spread + drawn**2 * np.mean(variance + spread) / self._sources
        factors = np.full(len(self._sizes), np.nan)
        factors[judged] = np.exp(value + drawn * (middle - value)).clip(1.0)
        yield
        tail = yield from self._tail_of(later[:, judged], (factors * self._rare)[judged])
        self.factors, self._tail = factors, max(1.0, tail)
        self._freedom = np.zeros(len(self._sizes))
        self._freedom[judged] = 2.0 / left  # what a mean square of so many degrees varies by
        self._limits = None

    @staticmethod
    def _tail_of(seen: FloatArray, rare: FloatArray) -> Pieces[float]:
        """Return the 99 % quantile of the statistics, each divided by its expected one."""
        count = int(np.sum(seen > 0.0))
        most = count - int((1.0 - _RARE) * (count - 1))  # so many of the largest hold the quantile
        largest = np.empty(0)
        for columns in _in_pieces(seen):
            relative = (seen[:, columns] / rare[columns]).reshape(-1)
            largest = np.concatenate([largest, relative])
            if len(largest) > most:
                largest = np.partition(largest, len(largest) - most)[-most:]
            yield
        place = (1.0 - _RARE) * (count - 1) - (count - len(largest))
        return float(np.interp(place, np.arange(len(largest)), np.sort(largest)))

    def excess(self, ratios: FloatArray, strength: FloatArray, chance: float) -> FloatArray:
        """
        Return statistics over their critical values; 0 before calibration.

        What the model lacks has biased the parameters, and a motion that is stronger than those
        they were learned from makes the more of it.

        Parameters
        ----------
        ratios, strength : ndarray
            The statistics, as of `learning`.
        chance : float
            Of each to exceed its limit.

        """
        judged = self._freedom > 0.0
        if self._limits is None or self._limits[0] != chance:
            self._limits = chance, limits(chance, self._sizes[judged], self._freedom[judged])
        result = np.zeros(len(self._sizes))
        stronger = np.maximum.reduceat(
            strength / self._strength.clip(_SMALLEST), self._first
        ).clip(1.0)
        usual = 1.0 + (_MARGIN * self._tail * self.factors[judged] - 1.0) * stronger[judged]
        result[judged] = ratios[judged] / (usual * self._limits[1])
        return result


def _in_pieces(values: FloatArray) -> Iterator[slice]:
    """Yield slices of the columns, one for each piece of work."""
    width = max(1, _AT_A_TIME // max(1, len(values)))
    for first in range(0, values.shape[1], width):
        yield slice(first, first + width)


class ResidualScale:
    """
    Standard deviation of autocorrelated residuals per joint, over the assumed noise.

    Sums of residuals over a block: what is quick cancels in them. By their median, which neither
    the first blocks nor a change that is not yet noticed moves.

    Parameters
    ----------
    least : float
        What the factor is at least.

    """

    def __init__(self, least: float) -> None:
        self._least = least
        self._seen: History | None = None
        self._value: FloatArray | None = None

    @property
    def value(self) -> FloatArray:
        """Return the factor of every joint, shape (m,); 1 in the beginning."""
        return np.ones(1) if self._value is None else self._value

    def learn(self, residual: FloatArray, weights: FloatArray) -> None:
        """Learn from the residuals of a block over the assumed noise, shape (k, m)."""
        used = np.sum(weights > 0.0, axis=0)
        if not used.any():
            return  # an arm at rest must not forget what it is like in motion
        squares = np.sum(residual, axis=0) ** 2
        if self._seen is None:
            self._seen = History(len(squares), _BLOCKS)
        self._seen.append(np.where(used > 0, squares / np.maximum(used, 1), np.nan))
        if len(self._seen) < _FEWEST_BLOCKS:
            return
        later = self._seen.values[len(self._seen) // 2 :]
        known = np.any(later > 0.0, axis=0)
        value = np.ones(later.shape[1]) if self._value is None else self._value.copy()
        # the medians of the numbers in every column; numpy's nanmedian takes ten times it
        values = later[:, known]
        ordered, counts = np.sort(values, axis=0), np.sum(~np.isnan(values), axis=0)
        columns = np.arange(values.shape[1])
        medians = (ordered[(counts - 1) // 2, columns] + ordered[counts // 2, columns]) / 2.0
        value[known] = np.sqrt(medians / MEDIAN_SQUARE)
        self._value = np.maximum(value, self._least)
