# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Time spans of a recording in which all joints are at rest."""

from __future__ import annotations

from armid_ros import Recording
from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.checks import REST_RANGE
from armid_ros.motion import FloatArray, Motion
import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d, uniform_filter1d

#: Time in which a joint at rest stays within `REST_RANGE` [s]; half of this time is cut off at
#: both ends of a rest. Time in which the torque then settles, and shortest rest after it [s].
_WINDOW, _SETTLING_TIME, _MIN_REST = 1.0, 0.5, 0.5


def reading_noise(recording: Recording) -> FloatArray:
    """Return the noise (standard deviation) of the mean torque over 0.5 s, (n,) [N m or N]."""
    assert recording.tau is not None
    count = max(_MIN_REST / max(recording.period, 1e-6), 1.0)
    # the median leaves out steps of friction; for white noise it is 0.954 standard deviations
    steps = np.median(np.abs(np.diff(recording.tau, axis=0)), axis=0)
    return np.asarray(steps / 0.954 / np.sqrt(count))


def find_rests(recording: Recording) -> Motion:
    """
    Find the K rests of a recording; return a motion of K samples, the means over each rest.

    Position and torque are means over a rest. The velocity is the direction of the approach of a
    joint, 1 or -1, or 0 if the joint hardly moved since the previous rest.
    IdentificationError: efforts are missing or constant, or the arm is never at rest.

    """
    tau, t = recording.tau, recording.t
    if tau is None or not np.ptp(tau, axis=0).any():
        raise IdentificationError(
            f'{recording.source}: efforts are missing or constant; name the topic of the torques '
            'with --topic, or the columns with --effort'
        )
    size = max(round(_WINDOW / max(recording.period, 1e-6)), 3)
    # outliers and encoder noise do not end a rest
    q = median_filter(recording.q, (5, 1), mode='nearest')
    q = uniform_filter1d(q, max(size // 5, 1), axis=0, mode='nearest')
    spread = maximum_filter1d(q, size, axis=0) - minimum_filter1d(q, size, axis=0)
    still = (spread < REST_RANGE).all(axis=1)
    still[1:] &= np.diff(t) < _MIN_REST
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    begins, ends = edges[::2], edges[1::2] - 1
    lasting = t[ends] - t[begins] >= _SETTLING_TIME + _MIN_REST
    if not lasting.any():
        longest = float((t[ends] - t[begins]).max(initial=-_WINDOW)) + _WINDOW
        needed = _SETTLING_TIME + _MIN_REST + _WINDOW
        raise IdentificationError(
            f'{recording.source}: the longest rest of the arm lasts {longest:.2g} s, and '
            f'{needed:g} s are needed; record a trajectory of armid zero plan'
        )
    rests, before = [], 0
    for begin, end in zip(begins[lasting], ends[lasting] + 1, strict=True):
        first = int(np.searchsorted(t, t[begin] + _SETTLING_TIME))
        pose, approach = q[first:end].mean(axis=0), np.zeros(q.shape[1])
        for j, way in enumerate((pose - q[before:begin]).T):
            # distance after which dry friction opposes the motion [rad or m]
            apart = np.flatnonzero(np.abs(way) > 0.03)
            approach[j] = np.sign(way[apart[-1]]) if len(apart) else 0.0
        rests.append((t[begin], pose, approach, tau[first:end].mean(axis=0)))
        before = first
    time, poses, directions, torque = (np.array(one) for one in zip(*rests, strict=True))
    return Motion(recording.joints, time, poses, directions, np.zeros_like(poses), torque)
