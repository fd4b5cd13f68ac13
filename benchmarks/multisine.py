# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sums of sines with exact derivatives: the motions of the benchmarks."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Frequencies [Hz] and sizes [rad] that excite an arm.
TONES = ((0.1, 0.5), (0.2, 0.3), (0.5, 0.1))


def multisine(
    joints: Sequence[str],
    t: FloatArray,
    rng: np.random.Generator,
    tones: Sequence[tuple[float, FloatArray | float]] = TONES,
) -> Motion:
    """
    Return a motion that is a sum of sines with random phases.

    Parameters
    ----------
    joints : sequence of str
        Names, n of them.
    t : ndarray, shape (N,)
        Time [s].
    rng : numpy.random.Generator
        Draws the phases.
    tones : sequence of (float, float or ndarray, shape (n,))
        Frequency [Hz] and size [rad] of each sine.

    """
    q, dq, ddq = np.zeros((3, len(t), len(joints)))
    for hz, size in tones:
        w = 2 * np.pi * hz
        angle = w * t[:, None] + rng.uniform(0, 2 * np.pi, len(joints))
        q += size * np.sin(angle)
        dq += size * w * np.cos(angle)
        ddq -= size * w * w * np.sin(angle)
    return Motion(tuple(joints), t, q, dq, ddq)
