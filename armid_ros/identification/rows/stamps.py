# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether stamps are so uneven that samples are not where they seem, and senders take turns."""

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
#: A joint that steps by less between two messages may stand still beside its noise [rad or m].
_LEAST_STEP = 1e-3
#: A step is contradicted where the messages on both sides of it differ by so many times less.
_CLOSER = 5.0
#: Messages of a second sender, and their share, below which they are faulty samples.
_FEWEST, _SHARE_OF_MESSAGES = 20, 0.01
#: Values of one sender are nearer to each other than to those of the other by this factor.
_TRACK = 3.0
#: Below this share of the messages, those of a second sender come between the others; where they
#: replace them, so that without them there is a gap of so many periods, an encoder is at fault.
_FEW, _REPLACED = 0.2, 1.5


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
        f'time stamps seem to be rounded to {1e3 * step:.4g} ms: all are multiples of that. '
        f'{report.duplicates} of {report.messages} samples had the stamp of another and are left '
        'out. Write stamps with more digits, or record with those of the driver'
    )


def _wander(t: FloatArray) -> float:
    """Return how far stamps are from an even grid [s]; zero where none come early."""
    # samples that are lost make steps longer and none shorter; stamps that come late, each by
    # another time, make short ones too, and steps alone do not tell how far they are off
    steps = np.diff(t)
    if len(t) < _WINDOW or np.mean(steps < 0.5 * np.mean(steps)) <= _UNEVEN:
        return 0.0
    windows = t[: len(t) - len(t) % _WINDOW].reshape(-1, _WINDOW).T
    line = np.linalg.qr(np.column_stack([np.ones(_WINDOW), np.arange(_WINDOW)]))[0]
    return float(np.sqrt(np.median(np.mean((windows - line @ (line.T @ windows)) ** 2, axis=0))))


def two_senders(recording: Recording) -> str:
    """
    Say that positions of a recording jump to and fro between two tracks; empty where they do not.

    A message is of another sender than those around it where it is far from both in some joint,
    they are near each other, and the step is faster than the joint otherwise moves. Such messages
    are a track of their own, where those of a faulty encoder are anywhere.

    """
    t, q = recording.t, recording.q
    if len(t) < 2 * _FEWEST:
        return ''
    before, after, across = q[1:-1] - q[:-2], q[1:-1] - q[2:], q[2:] - q[:-2]
    step = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    apart = step > np.maximum(_LEAST_STEP, _CLOSER * np.abs(across))
    fewest = max(_FEWEST, _SHARE_OF_MESSAGES * len(t))
    if np.count_nonzero(apart) < fewest:
        return ''
    # the speed that each joint seldom exceeds, by its velocities if there are
    time = (t[2:] - t[:-2])[:, np.newaxis]
    usual = np.median(np.abs(across) / time, axis=0)
    if recording.dq is not None and np.any(recording.dq):
        usual = np.percentile(np.abs(recording.dq), 99, axis=0)
    apart &= step > usual * time
    if np.count_nonzero(apart.any(axis=1)) < fewest:
        return ''
    joint = int(np.argmax(apart.sum(axis=0)))
    rows = np.flatnonzero(apart[:, joint])
    jump = float(np.median(step[rows, joint]))
    side = before[rows, joint] > 0.0
    own = [np.abs(np.diff(q[rows[one] + 1, joint])) for one in (side, ~side) if one.sum() > 1]
    if not own or float(np.median(np.concatenate(own))) * _TRACK > jump:
        return ''
    if (
        len(rows) < _FEW * len(t)
        and np.median(t[rows + 2] - t[rows]) > _REPLACED * recording.period
    ):
        return ''
    return (
        f'{len(rows)} of {len(t)} messages contradict those around them, as of two senders of '
        f'one topic. The position of {recording.joints[joint]} jumps by {jump:.3g} and back, '
        f'first at {t[rows[0] + 1] - t[0]:.3f} s. Record each sender on a topic of its own'
    )
