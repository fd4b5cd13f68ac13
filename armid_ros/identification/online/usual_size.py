# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How large likelihood ratios usually are, and what is too large for them.

Twice the logarithm is chi-square of p degrees only if noise is white and the model right. Noise
that is coloured, and what the model lacks, make it larger, by a factor that is measured for every
candidate while nothing changes and is 1 at least. The ratio of the two is then of Fisher's
distribution, its degrees of freedom counting how much was measured.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import stats

#: Windows that are remembered: ten minutes of four a second.
_MEMORY = 2400
#: Windows between two looks at how large statistics usually are, and as a share of all.
_EVERY = 8
_SHARE = 0.05
#: The usual size is measured by what so many exceed.
_TAIL = 0.05
#: What so many of all statistics exceed tells whether large ones are more frequent than in noise.
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


@dataclass(frozen=True, eq=False)
class Weighed:
    """
    What a window says of C candidates with Q quantities in all.

    Attributes
    ----------
    ratios : ndarray, shape (C,)
        Twice the logarithms of the likelihood ratios; 0: no data.
    strength : ndarray, shape (Q,)
        Squares of the torques that a unit of each quantity would make.

    """

    ratios: FloatArray
    strength: FloatArray


class UsualSize:
    """
    How large statistics usually are, compared with those of white noise.

    By their mean, in which what one in twenty exceeds counts as that and no more, over the later
    three quarters of what was seen and ten minutes at most: so what came while little was known,
    or before a change was noticed, soon has no part in it. A few windows tell a factor only
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
        self._seen: deque[Weighed] = deque(maxlen=_MEMORY)
        self._first = np.cumsum([0, *sizes[:-1]])
        self._strength = np.zeros(int(np.sum(sizes)))
        self._most = stats.chi2.isf(_TAIL, self._sizes)
        below = self._sizes * stats.chi2.cdf(self._most, self._sizes + 2)
        square = self._sizes * (self._sizes + 2) * stats.chi2.cdf(self._most, self._sizes + 4)
        self._fresh = 0
        self._rare = stats.chi2.isf(_RARE, self._sizes)
        self._tail = 1.0
        self._mean = below + _TAIL * self._most
        # of the logarithm of the factor that makes the mean right, from one window
        self._variance = (square + _TAIL * self._most**2 - self._mean**2) / below**2
        self.factors = np.full(len(sizes), np.nan)
        self._freedom = np.zeros(len(sizes))

    def learn(self, window: Weighed) -> None:
        """Take in a window in which nothing changed."""
        if not np.any(window.ratios > 0.0):
            return
        self._seen.append(window)
        self._fresh += 1
        if self._fresh < max(_EVERY, _SHARE * len(self._seen)):
            return
        self._fresh = 0
        later = np.array([window.ratios for window in self._seen])[len(self._seen) // 4 :]
        later = np.where(later > 0.0, later, np.nan)
        strengths = np.array([window.strength for window in self._seen])
        self._strength = np.quantile(strengths, 1.0 - _STRONG, axis=0)
        independent = np.sum(np.isfinite(later), axis=0) / self._overlap
        self.factors = np.full(len(self._sizes), np.nan)
        self._freedom = np.zeros(len(self._sizes))
        judged = independent >= _FEWEST
        if not judged.any():
            return
        single = np.log(self._fitted(later, judged))
        value, left = _drawn_together(
            single, self._variance[judged] / independent[judged], self._sources
        )
        self.factors[judged] = np.exp(value).clip(1.0)
        relative = later[:, judged] / (self.factors * self._rare)[judged]
        self._tail = max(1.0, float(np.nanquantile(relative, 1.0 - _RARE)))
        self._freedom[judged] = 2.0 / left  # what a mean square of so many degrees varies by

    def _fitted(self, seen: FloatArray, judged: npt.NDArray[np.bool_]) -> FloatArray:
        """Return the factors with which the means of limited statistics are as expected."""
        seen, most, mean = seen[:, judged], self._most[judged], self._mean[judged]
        factors = np.nanmean(seen, axis=0) / self._sizes[judged]
        for _ in range(_ROUNDS):
            factors = factors * np.nanmean(np.minimum(seen / factors, most), axis=0) / mean
        return np.asarray(factors)

    def excess(self, window: Weighed, chance: float) -> FloatArray:
        """
        Return statistics over what they exceed with so small a chance; 0: too early to say.

        What the model lacks has biased the parameters, and a motion that is stronger than those
        they were learned from makes the more of it.

        Parameters
        ----------
        window : Weighed
            The statistics.
        chance : float
            Of each to exceed its limit.

        """
        judged = self._freedom > 0.0
        result = np.zeros(len(self._sizes))
        stronger = np.maximum.reduceat(
            window.strength / self._strength.clip(_SMALLEST), self._first
        ).clip(1.0)
        usual = 1.0 + (_MARGIN * self._tail * self.factors[judged] - 1.0) * stronger[judged]
        sizes = self._sizes[judged]
        limit = sizes * stats.f.isf(chance, sizes, self._freedom[judged])
        result[judged] = window.ratios[judged] / (usual * limit)
        return result


def _drawn_together(
    values: FloatArray, variance: FloatArray, independent: int
) -> tuple[FloatArray, FloatArray]:
    """Return values shrunk towards their mean as far as they are uncertain, and variances."""
    mean = np.average(values, weights=1.0 / variance)
    seen = float(np.average((values - mean) ** 2 - variance, weights=1.0 / variance))
    spread = max(seen, _LEAST_SPREAD**2)
    mean = np.average(values, weights=1.0 / (variance + spread))
    share = variance / (variance + spread)
    left = share * spread + share**2 * np.mean(variance + spread) / independent
    return values + share * (mean - values), left
