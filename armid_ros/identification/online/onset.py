# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the time at which the residual of a model changed."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.changes.statistic import tail, two_means
from armid_ros.identification.rows.signals import (
    conditioning,
    decimate,
    decimated_samples,
    segments,
    SignalSettings,
)
from armid_ros.recording import Recording
import numpy as np


def onset(arm: ArmModel, recording: Recording) -> float | None:
    """
    Return the time [s] at which a model's residual in a recording changed, or None.

    The logarithm of the residual power of short blocks has different means before and after a
    change. The largest F ratio over time is tested for significance, corrected for all times and
    joints (change of a mean: Hinkley 1970).

    Parameters
    ----------
    arm : ArmModel
        The present model.
    recording : Recording
        Motion with torques, without a gap.

    Returns
    -------
    float or None
        Time since the begin of the recording after which the arm did not change [s]; None without
        a change.

    """
    # length of the blocks [s], longer than the correlation of the residual
    block = 0.5
    # fewest blocks before a change, so that their variance can be estimated
    fewest = 4
    used = conditioning([recording], SignalSettings())
    times, powers = [], []  # starts and mean squared residuals of blocks; the last ends the motion
    for motion in segments(recording, used):
        assert motion.tau is not None
        squares = decimate(motion.tau - arm.torque(motion), used) ** 2
        t = motion.t[decimated_samples(len(motion.t), used)]
        blocks = int((t[-1] - t[0]) / block) if len(t) else 0
        for begin in t[-1] - block * np.arange(blocks, 0, -1) if blocks else ():
            times.append(begin)
            powers.append(squares[(t > begin) & (t <= begin + block)].mean(axis=0))
    count = len(powers)
    if count <= fewest:
        return None
    logs = np.log(np.maximum(powers, 1e-300))
    # F ratio of two means against one mean, for every joint
    low, high, std = two_means(logs, np.ones_like(logs))
    between = ((high - low) / std)[fewest - 1 :] ** 2
    within = ((logs - logs.mean(axis=0)) ** 2).sum(axis=0) - between
    ratios = (between * (count - 2) / np.maximum(within, 1e-300)).max(axis=1)
    best = int(np.argmax(ratios))
    # probability of a false change, over all tested times and joints
    if tail(ratios[best], 1, count - 2) * len(ratios) * logs.shape[1] >= 0.01:
        return None
    edge = recording.duration - (times[-1] + block)  # time that the filter cuts off at the end
    return float(times[fewest + best] + block + edge)
