# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for the period of a periodic motion, and for repeated motions, in positions."""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np
from scipy import signal

#: Largest rms difference of positions on equal paths, over the range of motion: at most 0.05 if an
#: arm repeats a motion, at least 0.35 between motions.
_SAME_PATH = 0.1


def find_period(t: FloatArray, positions: FloatArray) -> tuple[int, slice] | None:
    """
    Return the period of recorded positions [samples] and the samples that repeat, or None.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Times at even steps [s].
    positions : ndarray, shape (N, n)
        Positions [rad or m].

    Returns
    -------
    lag : int
        Length of the period in samples.
    where : slice
        Samples that are repeated one period later.

    """
    # positions of two periods agree within this share of the range of motion
    tolerance = 0.02
    rate = 1.0 / float(t[1] - t[0])
    stride = max(1, int(rate / 25.0))
    q = positions[::stride]
    size = np.ptp(q, axis=0)
    if not np.any(size > 0.0):
        return None
    q = q[:, size > 0.0] / size[size > 0.0]
    change = np.abs(np.gradient(q, axis=0))
    speed = change.max(axis=1)
    moving = speed > 0.05 * speed.max()
    allowed = tolerance + change  # here, the lag is known to one sample
    shortest = int(1.5 * rate / stride)  # the shortest period is 1.5 s
    best: tuple[int, int, int] | None = None
    for lag in range(shortest, int(0.7 * len(q))):
        same = np.all(np.abs(q[lag:] - q[:-lag]) < allowed[:-lag], axis=1)
        padded = np.concatenate([[False], same, [False]]).astype(int)
        runs = np.flatnonzero(np.diff(padded)).reshape(-1, 2)
        if not len(runs):
            continue
        start, stop = (int(end) for end in runs[int(np.argmax(runs[:, 1] - runs[:, 0]))])
        length = int(np.sum(moving[start:stop]))
        if length <= 0.6 * lag or (best is not None and length <= 1.2 * (best[2] - best[1])):
            continue
        # smallest range of some joint in a period, over the tolerance: slower motion agrees with
        # itself after any lag. In 108 recordings of 17 arms, 30 % more or less changes no period.
        if np.ptp(q[start : start + lag], axis=0).max() > 3.0 * tolerance:
            best = lag, start, stop
    if best is None:
        return None
    lag, start, stop = (value * stride for value in best)
    part = slice(start, min(stop, len(t) - lag - stride))
    lags = range(max(1, lag - 2 * stride), lag + 2 * stride + 1)
    lag = lags[int(np.argmin([_mean_change(positions, shift, part) for shift in lags]))]
    return lag, slice(part.start, min(part.stop, len(t) - lag))


def is_same_path(first: FloatArray, second: FloatArray) -> bool:
    """Return whether positions (N, n) and (M, n) [rad or m] are equal after a shift in time."""
    middle, size = first.mean(axis=0), np.maximum(np.ptp(first, axis=0), 0.01)  # rad or m
    a, b = (first - middle) / size, (second - middle) / size
    likeness = sum(signal.correlate(x, y) for x, y in zip(a.T, b.T, strict=True))
    lag, longest = int(np.argmax(likeness)) - (len(b) - 1), max(len(a), len(b))
    a, b = a[max(lag, 0) :], b[max(-lag, 0) :]
    both = min(len(a), len(b))
    apart = np.sqrt(np.mean((a[:both] - b[:both]) ** 2, axis=0))
    return bool(both > 0.7 * longest and apart.max() < _SAME_PATH)


def refined_period(positions: FloatArray, lag: int, where: slice) -> float:
    """Return a period [samples], refined by a parabola through mismatches at three lags."""
    before, least, after = (_mean_change(positions, lag + shift, where) for shift in (-1, 0, 1))
    bend = before - 2.0 * least + after
    return lag + float(0.5 * (before - after) / bend) if 0.0 < bend < np.inf else float(lag)


def _mean_change(positions: FloatArray, lag: int, where: slice) -> float:
    """Return the mean square difference of positions, (N, n), that are `lag` samples apart."""
    end = min(where.stop, len(positions) - lag)
    gap = positions[where.start + lag : end + lag] - positions[where.start : end]
    return float(np.mean(gap**2))
