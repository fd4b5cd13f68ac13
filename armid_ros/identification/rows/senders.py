# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the messages of one topic come from two senders, whose positions take turns."""

from __future__ import annotations

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: A joint that steps by less between two messages may stand still beside its noise [rad or m].
_LEAST = 1e-3
#: A step is contradicted where the messages on both sides of it differ by so many times less.
_CLOSER = 5.0
#: Messages of a second sender, and their share, below which they are faulty samples.
_FEWEST, _SHARE = 20, 0.01
#: Values of one sender are nearer to each other than to those of the other by this factor.
_TRACK = 3.0
#: Below this share of the messages, those of a second sender come between the others; where they
#: replace them, so that without them there is a gap of so many periods, an encoder is at fault.
_FEW, _GAP = 0.2, 1.5


def require_one_sender(recording: Recording) -> None:
    """Raise an IdentificationError where messages come from two senders."""
    mixed = two_senders(recording)
    if mixed:
        raise IdentificationError(f'{recording.source or "recording"}: {mixed}')


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
    apart = step > np.maximum(_LEAST, _CLOSER * np.abs(across))
    fewest = max(_FEWEST, _SHARE * len(t))
    if np.count_nonzero(apart) < fewest:
        return ''
    apart &= step > _usual_speed(recording, across) * (t[2:] - t[:-2])[:, np.newaxis]
    if np.count_nonzero(apart.any(axis=1)) < fewest:
        return ''
    joint = int(np.argmax(apart.sum(axis=0)))
    rows = np.flatnonzero(apart[:, joint])
    jump = float(np.median(step[rows, joint]))
    side = before[rows, joint] > 0.0
    own = [np.abs(np.diff(q[rows[one] + 1, joint])) for one in (side, ~side) if one.sum() > 1]
    if not own or float(np.median(np.concatenate(own))) * _TRACK > jump:
        return ''
    if len(rows) < _FEW * len(t) and np.median(t[rows + 2] - t[rows]) > _GAP * recording.period:
        return ''
    return (
        f'{len(rows)} of {len(t)} messages contradict those around them, as of two senders of '
        f'one topic: the position of {recording.joints[joint]} jumps by {jump:.3g} and back, '
        f'first at {t[rows[0] + 1] - t[0]:.3f} s; record each sender on a topic of its own'
    )


def _usual_speed(recording: Recording, across: FloatArray) -> FloatArray:
    """Return the speed that each joint seldom exceeds, (n,), by its velocities if there are."""
    if recording.dq is not None and np.any(recording.dq):
        return np.percentile(np.abs(recording.dq), 99, axis=0)
    time = (recording.t[2:] - recording.t[:-2])[:, np.newaxis]
    return np.asarray(np.median(np.abs(across) / time, axis=0))
