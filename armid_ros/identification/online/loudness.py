# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How loud the residuals of every joint usually are, compared with what was assumed."""

from __future__ import annotations

from collections import deque

from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats

#: Blocks that are remembered: a minute of four a second.
_MEMORY = 240
#: Blocks before the assumption is given up.
_FEWEST = 16
#: Median of the square of a standard normal variable.
_MEDIAN = float(stats.chi2(1).median())


class Loudness:
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
        self._seen: deque[FloatArray] = deque(maxlen=_MEMORY)
        self._value: FloatArray | None = None

    @property
    def value(self) -> FloatArray:
        """The factor of every joint, shape (m,); 1 in the beginning."""
        return np.ones(1) if self._value is None else self._value

    def learn(self, residual: FloatArray, weights: FloatArray) -> None:
        """Take in the residuals of a block, in units of the assumed noise, shape (k, m)."""
        used = np.sum(weights > 0.0, axis=0)
        if not used.any():
            return  # an arm at rest must not forget what it is like in motion
        squares = np.sum(residual, axis=0) ** 2
        self._seen.append(np.where(used > 0, squares / np.maximum(used, 1), np.nan))
        if len(self._seen) < _FEWEST:
            return
        later = np.array(self._seen)[len(self._seen) // 2 :]
        known = np.any(later > 0.0, axis=0)
        value = np.ones(later.shape[1]) if self._value is None else self._value.copy()
        value[known] = np.sqrt(np.nanmedian(later[:, known], axis=0) / _MEDIAN)
        self._value = np.maximum(value, self._least)
