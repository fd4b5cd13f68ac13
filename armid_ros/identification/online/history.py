# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The last rows of numbers that came, one after the other."""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np


class History:
    """
    Rows of numbers, of which the last ones are remembered.

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
        """Return how many rows there are."""
        return min(self._end, self._most)

    def append(self, row: FloatArray) -> None:
        """Take in a row."""
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
        """Return the rows, oldest first; they stay as they are when others come."""
        return self._rows[self._end - len(self) : self._end]
