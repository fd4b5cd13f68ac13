# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Check the order of samples, and detect frozen positions."""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np


class StreamWatch:
    """
    Detects samples out of order, and positions that are no longer measured.

    The efforts of an arm at rest are constant except for noise. If no position changes while an
    effort varies over half of its range in motion, the positions are not measured.

    Parameters
    ----------
    n_joints : int
        Number of joints of the arm.

    """

    def __init__(self, n_joints: int) -> None:
        self._n = n_joints
        self._seen: set[str] = set()
        self._in_motion = np.array([np.full(n_joints, np.inf), np.full(n_joints, -np.inf)])
        self._q: FloatArray | None
        self._tau: FloatArray | None
        self._last: float | None
        self._at_rest: FloatArray
        self._changes: FloatArray
        self._count: int
        self._begin(None)

    def take(self, t: float, q: FloatArray, tau: FloatArray) -> None:
        """Check a sample: time [s], position [rad or m] and torque [N m or N], each (n,)."""
        if self._last is not None and t <= self._last:
            # a step back of more than 0.1 s is a jump of the clock, and not a late sample
            back = self._last - t > 0.1
            self._seen.add('jump_back' if back else 'out_of_order')
            if not back:
                return
            self._begin(None)
        self._last = t
        if self._q is None or not np.array_equal(q, self._q):
            if self._q is not None:
                _widen(self._in_motion, tau)
            self._begin(t)
            self._last, self._q = t, q
        _widen(self._at_rest, tau)
        if self._tau is not None:
            self._changes += np.abs(tau - self._tau)
        self._tau, self._count = tau, self._count + 1
        if t - self._since > 2.0:  # without a change of positions [s]
            # noise of a million samples has a range of 9 mean changes per sample
            effort = _range(self._at_rest)
            moves = effort > 0.5 * _range(self._in_motion)
            if np.any(moves & (effort > 10.0 * self._changes / self._count)):
                self._seen.add('frozen')

    def news(self) -> frozenset[str]:
        """Return the names of faults since the last call: jump_back, out_of_order, frozen."""
        seen, self._seen = frozenset(self._seen), set()
        return seen

    def _begin(self, t: float | None) -> None:
        """Restart the search for changing efforts at constant positions."""
        self._last = t
        self._since = np.inf if t is None else t
        self._q = self._tau = None
        self._changes, self._count = np.zeros(self._n), 0
        self._at_rest = np.array([np.full(self._n, np.inf), np.full(self._n, -np.inf)])


def _widen(ends: FloatArray, values: FloatArray) -> None:
    """Extend lower and upper ends, shape (2, n), to include values, shape (n,)."""
    np.minimum(ends[0], values, out=ends[0])
    np.maximum(ends[1], values, out=ends[1])


def _range(ends: FloatArray) -> FloatArray:
    """Return upper minus lower ends; infinite for an empty range."""
    return np.where(ends[1] >= ends[0], ends[1] - ends[0], np.inf)
