# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a recording is sampled in time, and whether its motion repeats."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: A step of more than this many median ones is a gap.
GAP = 5.0
#: Positions of two periods differ by less than this share of what the positions vary by.
_SAME = 0.03
_SEARCH_HZ = 20.0
_LONGEST = 3000
#: Positions are compared over this share of a period.
_STRETCH = 0.8
#: In a stretch that tells, positions vary by this share of what they vary by in all.
_MOVING = 0.3


@dataclass(frozen=True)
class Sampling:
    """
    Time of a recording in numbers.

    Attributes
    ----------
    duration : float
        [s].
    rate_hz : float
        Samples per second, from the median step.
    jitter : float
        Standard deviation of the steps, gaps left out, as a share of the median step.
    longest_step : float
        [s].
    gaps : int
        Steps of more than five median ones.
    period : float or None
        After which the motion repeats [s]; None where it does not.
    periods : float
        How many of them there are.

    """

    duration: float
    rate_hz: float
    jitter: float
    longest_step: float
    gaps: int
    period: float | None
    periods: float

    @staticmethod
    def of(recording: Recording) -> Sampling:
        """Measure a recording."""
        steps = np.diff(recording.t)
        median = float(np.median(steps))
        ordinary = steps[steps <= GAP * median]
        period = find_repetition(recording)
        return Sampling(
            recording.duration,
            1.0 / median,
            float(np.std(ordinary) / median),
            float(steps.max()),
            int(np.sum(steps > GAP * median)),
            period,
            recording.duration / period if period else 0.0,
        )


def find_repetition(recording: Recording) -> float | None:
    """
    Return the time after which all positions are what they were [s]; None where there is none.

    For each lag the stretch of nearly that length is taken in which the positions change least
    from one period to the next, in mean square over what they vary by in it; a run-in at the
    beginning counts for nothing then. The first lag that is a minimum and small is the period.

    """
    rate = min(_SEARCH_HZ, 1.0 / recording.period, _LONGEST / max(recording.duration, 1e-9))
    t = np.arange(recording.t[0], recording.t[-1], 1.0 / rate)
    varying = np.ptp(recording.q, axis=0) > 1e-3
    if len(t) < 40 or not varying.any():
        return None
    q = np.column_stack([np.interp(t, recording.t, column) for column in recording.q.T[varying]])
    q = (q - q.mean(axis=0)) / q.std(axis=0)
    lags = np.arange(max(2, int(rate)), int(0.6 * len(t)))
    change = np.array([_least_change(q, int(lag)) for lag in lags])
    low = change < max(_SAME, (np.pi * 2 / rate) ** 2 / 4)
    for k in range(1, len(lags) - 1):
        before, least, after = change[k - 1 : k + 2]
        if low[k] and least <= before and least <= after:
            bend = before - 2.0 * least + after  # of a parabola through the three
            beside = 0.5 * (before - after) / bend if 0.0 < bend < np.inf else 0.0
            return float((lags[k] + beside) / rate)
    return None


def _least_change(q: FloatArray, lag: int) -> float:
    """
    Return the mean square change after a lag where it is least; infinite where all rest.

    Parameters
    ----------
    q : ndarray, shape (N, n)
        Positions, of zero mean and unit deviation.
    lag : int
        Samples.

    """
    width = min(int(_STRETCH * lag), len(q) - lag)
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
