# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a recording is sampled in time, and whether its motion repeats."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.identification.rows.period import least_change, parabola_minimum
from armid_ros.recording import Recording
import numpy as np

#: A step of more than this many median ones is a gap.
GAP = 5.0
#: Positions of two periods differ by less than this share of what the positions vary by.
_SAME = 0.03
_SEARCH_HZ = 20.0
_LONGEST = 3000


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
    change = np.array([least_change(q, int(lag)) for lag in lags])
    low = change < max(_SAME, (np.pi * 2 / rate) ** 2 / 4)
    for k in range(1, len(lags) - 1):
        if low[k] and change[k] <= change[k - 1] and change[k] <= change[k + 1]:
            return float(lags[k] + parabola_minimum(*change[k - 1 : k + 2])) / rate
    return None
