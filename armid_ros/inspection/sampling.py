# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sampling of a recording in time, and the period of its motion."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.identification.rows.period import find_period, mean_change, parabola_minimum
from armid_ros.recording import Recording
import numpy as np

#: A step of more than this many median steps is a gap.
GAP = 5.0


@dataclass(frozen=True)
class Sampling:
    """
    Time of a recording in numbers.

    Attributes
    ----------
    duration : float
        Time from the first sample to the last [s].
    rate_hz : float
        Samples per second, from the median step.
    jitter : float
        Standard deviation of the steps, gaps left out, as a share of the median step.
    longest_step : float
        Longest time between samples [s].
    gaps : int
        Number of steps of more than five median steps.
    period : float or None
        Period of the motion [s]; None if the motion is not periodic.
    periods : float
        Number of periods in the recording.

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
        """Return the sampling of a recording."""
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
    """Return the period of the motion [s]; None if the motion is not periodic."""
    # at most 20 Hz and 3000 samples
    rate = min(20.0, 1.0 / recording.period, 3000 / max(recording.duration, 1e-9))
    t = np.arange(recording.t[0], recording.t[-1], 1.0 / rate)
    varying = np.ptp(recording.q, axis=0) > 1e-3
    if len(t) < 40 or not varying.any():
        return None
    q = np.column_stack([np.interp(t, recording.t, column) for column in recording.q.T[varying]])
    found = find_period(t, q)
    if found is None:
        return None
    lag, where = found
    before, least, after = (mean_change(q, lag + shift, where) for shift in (-1, 0, 1))
    return (lag + parabola_minimum(before, least, after)) / rate
