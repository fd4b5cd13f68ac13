# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for the period of a motion."""

from __future__ import annotations

from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Positions of two periods agree within this share of the range of motion.
_SAME = 0.02
#: Smallest range of some joint in a period, in units of `_SAME`: slower motion agrees with itself
#: after any lag, but hardly moves by one unit in it. Of 108 recordings of 17 arms, 30 % more or
#: less changes none.
_FARTHER = 3.0
#: Smallest variance of positions in a compared window, as a share of that of the whole motion.
_MOVING = 0.3


def find_period(motion: Motion) -> tuple[int, slice] | None:
    """
    Find a repeated period in the positions of a motion.

    Returns
    -------
    lag : int
        Length of the period in samples.
    where : slice
        Samples that are repeated one period later.

    """
    rate = 1.0 / float(motion.t[1] - motion.t[0])
    stride = max(1, int(rate / 25.0))
    q = motion.q[::stride]
    size = np.ptp(q, axis=0)
    if not np.any(size > 0.0):
        return None
    q = q[:, size > 0.0] / size[size > 0.0]
    change = np.abs(np.gradient(q, axis=0))
    speed = change.max(axis=1)
    moving = speed > 0.05 * speed.max()
    allowed = _SAME + change  # at this stage, the lag is known to one sample
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
        if np.ptp(q[start : start + lag], axis=0).max() > _FARTHER * _SAME:
            best = lag, start, stop
    if best is None:
        return None
    lag, start, stop = (value * stride for value in best)
    part = slice(start, min(stop, len(motion) - lag - stride))
    lags = range(max(1, lag - 2 * stride), lag + 2 * stride + 1)
    errors = []
    for shift in lags:
        end = min(part.stop, len(motion) - shift)
        gap = motion.q[part.start + shift : end + shift] - motion.q[part.start : end]
        errors.append(float(np.mean(gap**2)))
    lag = lags[int(np.argmin(errors))]
    return lag, slice(part.start, min(part.stop, len(motion) - lag))


def least_change(q: FloatArray, lag: int) -> float:
    """
    Return the least mean square change of positions after a lag; infinite if all joints rest.

    Parameters
    ----------
    q : ndarray, shape (N, n)
        Positions, of zero mean and unit deviation.
    lag : int
        Lag in samples.

    """
    width = min(int(0.8 * lag), len(q) - lag)  # positions are compared over this share of a period
    change = np.mean((q[lag:] - q[:-lag]) ** 2, axis=1) / 2.0
    first, second = (_window_means(values[: len(change)], width) for values in (q, q**2))
    spread = np.mean(second - first**2, axis=1)
    moving = spread > _MOVING
    if not moving.any():
        return np.inf
    return float(np.min(_window_means(change[:, np.newaxis], width)[moving, 0] / spread[moving]))


def _window_means(values: FloatArray, width: int) -> FloatArray:
    """Return the means of all windows of a width, shape (N - width + 1, k)."""
    sums = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
    return np.asarray((sums[width:] - sums[:-width]) / width)


def parabola_minimum(before: float, least: float, after: float) -> float:
    """Return where a parabola through values at -1, 0 and 1 is least; 0 if it has no minimum."""
    bend = before - 2.0 * least + after
    return float(0.5 * (before - after) / bend) if 0.0 < bend < np.inf else 0.0
