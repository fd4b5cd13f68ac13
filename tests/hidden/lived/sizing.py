# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How large a cause is: its power over what an ordinary model of day 1 leaves over.

The ordinary model is a least-squares fit of the rigid body (held softly to the description),
viscous and dry friction and an offset of each joint. Its misfit in a joint is the rms of what it
leaves of the recordings of day 1, each told by the two others. The gap of a cause is the mean
square of its contribution over the squared misfit, in the joint where it is largest. All go
through one zero-phase filter of 10 Hz.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import butter, sosfiltfilt

from tests.hidden.arrays import FloatArray
from tests.hidden.lived.causes.base import Cause
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import Path, STEP
from tests.hidden.lived.wear import bristle

#: Columns of what is fitted, (R, n, p), and torque that the description leaves, (R, n) [N m].
Rows = tuple[FloatArray, FloatArray]

CUT_OFF = 10.0  # Hz
_EVERY = round(1.0 / 25.0 / STEP)  # samples of a path per row

#: How softly the bodies are held to the description, in columns of length 1.
_RIDGE = 1e-3


def rows_of(described: Chain, path: Path, tau: FloatArray) -> Rows:
    """
    Return the columns of what is fitted, (R, n, p), and the torque that the description leaves.

    Parameters
    ----------
    described : Chain
        Bodies of the description.
    path : Path
        Motion.
    tau : ndarray, shape (N, n)
        Effort that was reported, on the time base of the path [N m].

    """
    rows = slice(_EVERY, -_EVERY, _EVERY)
    n = described.n_joints
    q, dq, ddq = (x[rows] for x in (path.q, path.dq, path.ddq))
    sign = filtered(bristle(path.q, np.full(n, 1e-4)))[rows]
    drives = np.zeros((len(q), n, 3 * n))
    for j in range(n):
        drives[:, j, 3 * j] = dq[:, j]
        drives[:, j, 3 * j + 1] = sign[:, j]
        drives[:, j, 3 * j + 2] = 1.0
    columns = np.concatenate([described.columns(q, dq, ddq), drives], axis=2)
    return columns, filtered(tau)[rows] - described.torque(q, dq, ddq)


def misfit(recordings: Sequence[Rows]) -> FloatArray:
    """Return the residual of joints with the other recordings fitted, rms, (n,) [N m]."""
    left = []
    for k, (columns, tau) in enumerate(recordings):
        left.append(tau - columns @ _fit([*recordings[:k], *recordings[k + 1 :]]))
    return np.sqrt((np.concatenate(left) ** 2).mean(axis=0))


def sized(cause: Cause, wanted: float, gap_of: Callable[[Cause], float]) -> Cause:
    """Return a cause with the factor that makes its gap what is wanted, as far as sense allows."""
    low, high = cause.factors
    factor, tried = 1.0, cause
    for _ in range(3):
        there = gap_of(tried)
        step = np.sqrt(wanted / max(there, 1e-12))
        factor = float(np.clip(factor * step, low, high))
        tried = cause.scaled(factor)
        if 0.9 < step < 1.1 or factor in (low, high):
            break
    return tried


def filtered(values: FloatArray) -> FloatArray:
    """Return signals every STEP behind the filter of zero phase."""
    sections = butter(4, CUT_OFF, fs=1.0 / STEP, output='sos')
    return sosfiltfilt(sections, values, axis=0)


def _fit(recordings: Sequence[Rows]) -> FloatArray:
    columns, tau = (np.concatenate(part) for part in zip(*recordings, strict=True))
    p = columns.shape[2]
    weight = 1.0 / np.maximum(tau.std(axis=0), 1e-9)
    design = (columns * weight[:, np.newaxis]).reshape(-1, p)
    scale = np.maximum(np.linalg.norm(design, axis=0), 1e-12)
    design = design / scale
    normal = design.T @ design + _RIDGE * np.eye(p)
    return np.linalg.solve(normal, design.T @ (tau * weight).ravel()) / scale
