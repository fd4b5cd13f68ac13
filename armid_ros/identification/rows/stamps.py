# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of time stamps: uneven, rounded or slow stamps, and two senders on one topic."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import IdentificationError
from armid_ros.recording import Recording
import numpy as np
from scipy import signal

#: Share of short time steps above which stamps are uneven, and of equal stamps above which they
#: are rounded.
_UNEVEN_SHARE = 0.05


def uneven_stamps(recording: Recording, cutoff_hz: float) -> str:
    """
    Return a message if time stamps are too uneven for a position cut-off [Hz], else ''.

    Lost samples only make steps longer; varying delays of stamps make short steps too. Windows of
    50 stamps are compared with an even grid, which finds jitter and no slow drift of the clock.

    """
    steps, window = np.diff(recording.t), 50
    if len(recording) < window or np.mean(steps < 0.5 * np.mean(steps)) <= _UNEVEN_SHARE:
        return ''
    windows = recording.t[: len(recording) // window * window].reshape(-1, window).T
    squares = np.mean(signal.detrend(windows, axis=0) ** 2, axis=0)
    # largest harmless error due to jitter, as a share of a signal at the cut-off
    if not 2.0 * np.pi * cutoff_hz * float(np.sqrt(np.median(squares))) > 0.1:
        return ''
    median = float(np.median(steps))
    uneven = float(np.mean(np.abs(steps - median) > 0.5 * median))
    return (
        f'{recording.source or "recording"}: {100 * uneven:.0f} % of the time stamps are uneven '
        'by more than half a period; record with the stamps of the driver'
    )


def rounded_stamps(recording: Recording) -> str:
    """
    Return a message if samples have equal time stamps because of rounding, else ''.

    Of samples with equal stamps, the reader keeps one. Its stamp is wrong by up to half a step.

    """
    report, steps = recording.report, np.diff(recording.t)
    if report.duplicates <= _UNEVEN_SHARE * report.messages or len(steps) == 0:
        return ''
    step = float(steps.min())
    # time steps that are multiples of the smallest step, to a hundredth of it
    if np.any(np.abs(steps / step - np.round(steps / step)) > 0.01):
        return ''
    return (
        f'time stamps seem to be rounded to multiples of {1e3 * step:.4g} ms. '
        f'{report.duplicates} of {report.messages} samples had the stamp of another sample and '
        'are left out. Write stamps with more digits, or record with the stamps of the driver'
    )


def check_recordings(recordings: Sequence[Recording]) -> None:
    """Raise IdentificationError for too few samples per second, or for two senders of a topic."""
    for recording in recordings:
        source, rate = recording.source or 'recording', 1.0 / recording.period
        if rate < 2.0:  # too slow to resolve the motion of an arm
            units = (('milliseconds', 1e3), ('microseconds', 1e6), ('nanoseconds', 1e9))
            likely = [
                f'; the stamps seem to be {unit} in place of seconds, {factor * rate:.4g} '
                'samples/s: write them in seconds'
                for unit, factor in units
                if 20.0 <= factor * rate <= 20_000.0  # rates at which arms are recorded [Hz]
            ]
            raise IdentificationError(
                f'{source}: {len(recording)} samples in {recording.duration:.4g} s, one '
                f'every {1.0 / rate:.4g} s: too slow for a motion' + (likely[0] if likely else '')
            )
        mixed = two_senders(recording)
        if mixed:
            raise IdentificationError(f'{source}: {mixed}')


def two_senders(recording: Recording) -> str:
    """
    Return a message if positions alternate as if two senders published them, else ''.

    A sample has another sender than its neighbours if some joint is far from both neighbours, and
    these are near each other. Such samples form a separate track; values of a faulty encoder are
    scattered.

    """
    t, q = recording.t, recording.q
    if len(t) < 40:
        return ''
    # samples of each joint that are far from both neighbours in the same direction; joint by
    # joint, as the arrays of one joint fit into the cache
    found = []
    for joint in range(recording.n_joints):
        steps = np.diff(q[:, joint])
        before, after, across = steps[:-1], -steps[1:], q[2:, joint] - q[:-2, joint]
        step = np.minimum(np.abs(before), np.abs(after))
        # a step below 1e-3 [rad or m] may be noise at rest
        apart = step > np.maximum(1e-3, 5.0 * np.abs(across))
        found.append(np.flatnonzero(apart & (before * after > 0.0)))
    # fewer contradicted samples, or less than 1 %, are faulty samples of one sender
    if len(np.unique(np.concatenate(found))) < max(20, 0.01 * len(t)):
        return ''
    joint = int(np.argmax([len(rows) for rows in found]))
    rows = found[joint]
    jump = float(np.median(np.abs(q[rows + 1, joint] - q[rows, joint])))
    # A second sender of less than a fifth of the samples sends between those of the first. If gaps
    # remain without these samples, they are faults of an encoder.
    if len(rows) < 0.2 * len(t) and np.median(t[rows + 2] - t[rows]) > 1.5 * recording.period:
        return ''
    return (
        f'{len(rows)} of {len(t)} messages contradict their neighbours, as if two senders used '
        f'one topic. The position of {recording.joints[joint]} jumps by {jump:.3g} and back, '
        f'first at {t[rows[0] + 1] - t[0]:.3f} s. Record each sender on a topic of its own'
    )
