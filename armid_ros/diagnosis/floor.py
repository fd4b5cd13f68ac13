# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The noise floor: what two equal periods of one trajectory differ by.

The difference is taken of what a model leaves over, evaluated in each period with its own measured
positions: noise of the encoders is inside as it goes through the model, and whatever depends on
the motion alone cancels. Where nothing repeats the floor is assumed, from the upper half of the
spectrum, and said to be assumed.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.motion import FloatArray, Motion
import numpy as np
import numpy.typing as npt
from scipy import signal

#: Positions of two periods agree within this share of the range of motion.
_SAME = 0.02
#: The shortest period that is looked for [s].
_SHORTEST = 1.5
#: Where the difference of two periods has this many times the power at low frequency that it has
#: at high frequency, something happened in one period that did not in the other: coloured noise
#: of torques came to 3.6 at the most in 60 sets of recordings in which nothing happened.
_STRUCTURED = 8.0
#: Fewer rows than this are not enough to leave any out.
_FEW = 20
#: What people, loose parts and machines nearby do is slow; noise of torques is as strong in the
#: band above, and noise of positions stronger [Hz]. Window of the spectra [s].
_SLOW_HZ, _FAST_HZ, _WINDOW = 4.0, (6.0, 12.0), 2.5


@dataclass(frozen=True)
class Floor:
    """
    Noise of one trajectory.

    Attributes
    ----------
    sigma : ndarray, shape (n,)
        Standard deviation of a row of each joint [N m].
    period : float or None
        Length of the repeated period [s]; None where nothing repeats.
    structure : ndarray, shape (n,)
        Power of the difference of two periods at low frequency over that at high frequency.

    """

    sigma: FloatArray
    period: float | None
    structure: FloatArray

    @property
    def repeats(self) -> npt.NDArray[np.bool_]:
        """Whether each joint did the same in both periods, shape (n,)."""
        return np.asarray(self.structure < _STRUCTURED)


def find_period(motion: Motion) -> tuple[int, slice] | None:
    """
    Find a repeated period in the positions of a motion.

    Returns
    -------
    lag : int
        Length of the period in samples.
    where : slice
        Samples of which each has its like one period later.

    """
    rate = 1.0 / float(motion.t[1] - motion.t[0])
    stride = max(1, int(rate / 25.0))
    q = motion.q[::stride]
    size = np.ptp(q, axis=0)
    if not np.any(size > 0.0):
        return None
    q = q[:, size > 0.0] / size[size > 0.0]
    change = np.abs(np.gradient(q, axis=0))
    speed = change.max(axis=1)
    moving = speed > 0.05 * speed.max()
    allowed = _SAME + change  # the lag is only known to a sample yet
    shortest = int(_SHORTEST * rate / stride)
    best: tuple[int, int, int] | None = None
    for lag in range(shortest, int(0.7 * len(q))):
        same = np.all(np.abs(q[lag:] - q[:-lag]) < allowed[:-lag], axis=1)
        start, stop = _longest(same)
        length = int(np.sum(moving[start:stop]))
        if length > 0.6 * lag and (best is None or length > 1.2 * (best[2] - best[1])):
            best = lag, start, stop
    if best is None:
        return None
    lag, start, stop = (value * stride for value in best)
    part = slice(start, min(stop, len(motion) - lag - stride))
    lags = range(max(1, lag - 2 * stride), lag + 2 * stride + 1)
    errors = []
    for shift in lags:
        end = min(part.stop, len(motion) - shift)
        gap = motion.q[part.start + shift : end + shift] - motion.q[part.start : end]
        errors.append(float(np.mean(gap**2)))
    lag = lags[int(np.argmin(errors))]
    return lag, slice(part.start, min(part.stop, len(motion) - lag))


def noise_floor(trajectory: Trajectory, arm: ArmModel) -> Floor:
    """
    Measure the noise of a trajectory beside a model.

    Parameters
    ----------
    trajectory : Trajectory
        The data.
    arm : ArmModel
        A model with parameters near to those of the data; what it lacks cancels.

    """
    motion = trajectory.motion
    assert motion.tau is not None
    left = motion.tau - arm.torque(motion)
    taps = trajectory.used.taps()
    half = (len(taps) - 1) // 2
    smooth = signal.fftconvolve(left, taps[:, np.newaxis], mode='same', axes=0)
    found = find_period(motion)
    if found is None:
        return Floor(_assumed(trajectory, smooth), None, np.ones(motion.n_joints))
    lag, where = found
    first = np.arange(max(where.start, half), min(where.stop, len(motion) - lag - half))
    rows = first[:: trajectory.used.decimation]
    sigma, structure = np.empty((2, motion.n_joints))
    for joint in range(motion.n_joints):
        rest, used = _difference(trajectory, smooth, rows, lag, joint)
        freedom = max(1.0, used.sum() - 4.0)
        sigma[joint] = np.sqrt(np.sum(rest[used] ** 2) / freedom / 2.0)
        rest, used = _difference(trajectory, left, first, lag, joint)
        structure[joint] = _structure(np.where(used, rest, 0.0), trajectory.used.rate_hz)
    return Floor(
        np.maximum(sigma, _least(sigma)), lag * float(motion.t[1] - motion.t[0]), structure
    )


def _difference(
    trajectory: Trajectory, left: FloatArray, first: npt.NDArray[np.intp], lag: int, joint: int
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """
    Return what samples of two periods differ by in one joint, and where that tells something.

    What drifts with time, by itself or in proportion to the velocity, is taken out: it is an
    effect of its own.

    """
    motion = trajectory.motion
    difference = left[first + lag, joint] - left[first, joint]
    t = (motion.t[first] - motion.t[first].mean()) / max(np.ptp(motion.t[first]), 1e-9)
    dq = motion.dq[first, joint]
    drifting = np.column_stack([np.ones_like(t), t, dq, t * dq])
    used = _between_rows(trajectory, first, joint) & _between_rows(trajectory, first + lag, joint)
    if used.sum() < _FEW:
        used = np.ones(len(first), dtype=bool)
    fit = np.linalg.lstsq(drifting[used], difference[used], rcond=None)[0]
    return difference - drifting @ fit, used


def _between_rows(
    trajectory: Trajectory, samples: npt.NDArray[np.intp], joint: int
) -> npt.NDArray[np.bool_]:
    """Return whether the nearest rows of a joint tell something, shape (K,)."""
    nearest = np.clip(np.searchsorted(trajectory.rows, samples), 0, len(trajectory.rows) - 1)
    return np.asarray(trajectory.told[nearest, joint])


def _structure(difference: FloatArray, rate: float) -> float:
    """Return the power per bin of what is slow over that of what is fast."""
    length = min(len(difference), int(_WINDOW * rate))
    frequency, power = signal.welch(difference, fs=rate, nperseg=length, detrend=False)
    slow = power[(frequency > 0.0) & (frequency < _SLOW_HZ)]
    fast = power[(frequency > _FAST_HZ[0]) & (frequency < _FAST_HZ[1])]
    if not len(slow) or len(fast) < 3:
        return 1.0
    return float(np.mean(slow) / max(float(np.mean(fast)), 1e-300))


def _assumed(trajectory: Trajectory, smooth: FloatArray) -> FloatArray:
    """Return the noise that the upper part of the spectrum suggests, taken as white."""
    rows = smooth[trajectory.rows]
    frequency, power = signal.welch(rows, nperseg=min(len(rows), 256), axis=0)
    high = (frequency > 0.25) & (frequency < 0.36)
    sigma = np.sqrt(np.median(power[high], axis=0) * 0.4)
    return np.asarray(np.maximum(sigma, _least(sigma)))


def _least(sigma: FloatArray) -> float:
    return max(1e-6 * float(np.max(sigma)), 1e-12)


def _longest(flags: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """Return begin and end of the longest run of True."""
    padded = np.concatenate([[False], flags, [False]]).astype(int)
    edges = np.flatnonzero(np.diff(padded)).reshape(-1, 2)
    if not len(edges):
        return 0, 0
    start, stop = edges[int(np.argmax(edges[:, 1] - edges[:, 0]))]
    return int(start), int(stop)
