# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scale of the residuals of every joint, relative to the noise that was assumed."""

from __future__ import annotations

from armid_ros.identification.online.history import History
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats

#: Blocks that are remembered: a minute of four a second.
_MEMORY = 240
#: Blocks before the assumption is given up.
_FEWEST = 16
#: Median of the square of a standard normal variable.
_MEDIAN = float(stats.chi2(1).median())


class ResidualScale:
    """
    Standard deviation of residuals that last, per joint, relative to noise as assumed.

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
        """Take in the residuals of a block, in units of the assumed noise, shape (k, m)."""
        used = np.sum(weights > 0.0, axis=0)
        if not used.any():
            return  # an arm at rest must not forget what it is like in motion
        squares = np.sum(residual, axis=0) ** 2
        if self._seen is None:
            self._seen = History(len(squares), _MEMORY)
        self._seen.append(np.where(used > 0, squares / np.maximum(used, 1), np.nan))
        if len(self._seen) < _FEWEST:
            return
        later = self._seen.values[len(self._seen) // 2 :]
        known = np.any(later > 0.0, axis=0)
        value = np.ones(later.shape[1]) if self._value is None else self._value.copy()
        # the medians of the numbers in every column; numpy's nanmedian takes ten times it
        values = later[:, known]
        ordered, counts = np.sort(values, axis=0), np.sum(~np.isnan(values), axis=0)
        columns = np.arange(values.shape[1])
        medians = (ordered[(counts - 1) // 2, columns] + ordered[counts // 2, columns]) / 2.0
        value[known] = np.sqrt(medians / _MEDIAN)
        self._value = np.maximum(value, self._least)
