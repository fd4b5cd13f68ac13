# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether time stamps are so uneven that samples are not where they seem to be."""

from __future__ import annotations

from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: Share of steps in time that differ from the median by more than half of it, or are less than
#: half of their mean.
_UNEVEN = 0.05
#: Jitter of stamps that blurs a signal at the end of the band by less than this share of it is
#: harmless.
_BLURRED = 0.1
#: A step in time is a multiple of another one within this share of it.
_WHOLE = 0.01
#: Stamps are compared with an even grid over so many samples: jitter shows in them, and a clock
#: that is slewed does not.
_WINDOW = 50


def uneven_stamps(recording: Recording, cutoff_hz: float, band_hz: float) -> str:
    """
    Say that time stamps are too uneven; empty where they are not.

    Parameters
    ----------
    recording : Recording
        The data.
    cutoff_hz : float
        Up to which positions are differentiated [Hz].
    band_hz : float
        Up to which rows hold motion [Hz].

    """
    steps = np.diff(recording.t)
    if len(steps) == 0:
        return ''
    median = float(np.median(steps))
    uneven = float(np.mean(np.abs(steps - median) > 0.5 * median))
    jitter = float(np.sqrt(np.mean(np.minimum(np.abs(steps - median), median) ** 2)))
    blurred = uneven > _UNEVEN and 2.0 * np.pi * band_hz * jitter > _BLURRED
    if not blurred and not 2.0 * np.pi * cutoff_hz * _wander(recording.t) > _BLURRED:
        return ''
    return (
        f'{recording.source or "recording"}: {100 * uneven:.0f} % of the time stamps are uneven '
        'by more than half a period; record with the stamps of the driver'
    )


def rounded_stamps(recording: Recording) -> str:
    """
    Say to what time stamps are rounded, where samples share them for that; empty otherwise.

    Samples that share a stamp are dropped but one, and the others are off by half of the step.

    """
    report, steps = recording.report, np.diff(recording.t)
    if report.duplicates <= _UNEVEN * report.messages or len(steps) == 0:
        return ''
    step = float(steps.min())
    if np.any(np.abs(steps / step - np.round(steps / step)) > _WHOLE):
        return ''
    return (
        f'time stamps seem to be rounded to {1e3 * step:.4g} ms: all are multiples of that, and '
        f'{report.duplicates} of {report.messages} samples had the stamp of another and are left '
        'out; write stamps with more digits, or record with those of the driver'
    )


def _wander(t: FloatArray) -> float:
    """
    Return how far stamps are from an even grid [s], root mean square; zero where none come early.

    Samples that are lost make steps longer and none shorter. Stamps that come late, each by
    another time, make short ones too; steps alone do not tell how far they are off.

    """
    steps = np.diff(t)
    if len(t) < _WINDOW or np.mean(steps < 0.5 * np.mean(steps)) <= _UNEVEN:
        return 0.0
    windows = t[: len(t) - len(t) % _WINDOW].reshape(-1, _WINDOW).T
    line = np.linalg.qr(np.column_stack([np.ones(_WINDOW), np.arange(_WINDOW)]))[0]
    return float(np.sqrt(np.median(np.mean((windows - line @ (line.T @ windows)) ** 2, axis=0))))
