# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether a driver has low-pass filtered the torque it reports, and how narrowly.

While an arm stands still its torque is constant but for noise. Noise of a sensor is as strong at
all frequencies; behind a filter it falls off above the band of the filter, with which the torque
of a moving arm is late and rounded, too.

"""

from __future__ import annotations

from armid_ros.inspection.joints import STILL
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy.signal import welch

#: Samples at rest that are needed, and in each of the spectra that are averaged.
LEAST, _SEGMENT = 512, 128
#: A joint slower than this share of its top speed stands; over how long it is looked at [s].
_REST, _LOOK = 0.02, 0.1
#: Bands that are tried, in octaves of a tenth.
_TENTHS = 10
#: Log-likelihood that a filter has to gain over white noise to be reported: two quantities are
#: fitted, so thirty has a p-value of about 1e-13.
_CLEAR = 30.0
#: A filter whose band is more than this share of half the rate takes nothing away.
_WIDEST = 0.6


def noise_band(noise: FloatArray, rate: float) -> FloatArray:
    """
    Return the band of noise that has been filtered.

    The likelihood (Whittle's) of the spectrum is compared for white noise, and for white noise
    behind an exponential smoothing or a second-order Butterworth filter.

    Parameters
    ----------
    noise : ndarray, shape (N, n)
        Samples of n signals that are constant but for noise, in even steps.
    rate : float
        Samples per second [Hz].

    Returns
    -------
    ndarray, shape (n,)
        Frequency at which half the power passes [Hz]; NaN where the noise is white, or there are
        fewer than `LEAST` samples, or nothing varies.

    """
    bands = np.full(noise.shape[1], np.nan)
    if len(noise) < LEAST:
        return bands
    frequency, power = welch(noise, rate, nperseg=_SEGMENT, detrend='linear', axis=0)
    w = 2.0 * np.pi * frequency[2:-1, np.newaxis] / rate  # without trend and Nyquist
    power = power[2:-1]
    averaged = len(noise) / _SEGMENT
    lowest = 2.0 / _SEGMENT
    steps = int(_TENTHS * np.log2(0.5 / lowest))
    edges = 2.0 * np.pi * lowest * 2.0 ** (np.arange(steps) / _TENTHS)
    shapes = np.stack(
        [*(_smoothed(w, edge) for edge in edges), *(_butter(w, edge) for edge in edges)]
    )
    for j in np.flatnonzero(power.min(axis=0) > 0.0):
        white = _loss(power[:, j], np.ones(len(w)))
        losses = np.array([_loss(power[:, j], shape[:, 0]) for shape in shapes])
        best = int(np.argmin(losses))
        edge = edges[best % steps] * rate / (2.0 * np.pi)
        if averaged * (white - losses[best]) > _CLEAR and edge < _WIDEST * rate / 2.0:
            bands[j] = edge
    return bands


def standing_bands(q: FloatArray, tau: FloatArray, period: float) -> FloatArray:
    """
    Return the bands that torques were filtered to, from the longest time the arm stands.

    Parameters
    ----------
    q, tau : ndarray, shape (N, n)
        Positions [rad or m] and torques [N m].
    period : float
        Time from sample to sample [s].

    Returns
    -------
    ndarray, shape (n,)
        [Hz]; NaN where torques are not filtered, or the arm does not stand long enough.

    """
    if len(q) < LEAST or period <= 0.0:
        return np.full(tau.shape[1], np.nan)
    first, last = _longest(_standing(q, period))
    return noise_band(tau[first:last], 1.0 / period)


def _standing(q: FloatArray, period: float) -> npt.NDArray[np.bool_]:
    """Return for each sample of positions, shape (N, n), whether all joints stand still."""
    wide = max(int(_LOOK / period), 1)
    travel = np.abs(q[wide:] - q[:-wide])
    fastest = travel.max(axis=0, initial=0.0)
    slow = np.all((travel <= _REST * fastest) | (fastest < STILL), axis=1)
    still = np.ones(len(q), dtype=bool)
    still[wide:] &= slow
    still[:-wide] &= slow
    return still


def _longest(flags: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """Return the first sample of the longest stretch that is true, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    if not len(edges):
        return 0, 0
    first, last = edges[::2], edges[1::2]
    best = int(np.argmax(last - first))
    return int(first[best]), int(last[best])


def _loss(power: FloatArray, shape: FloatArray) -> float:
    """Return the negative log-likelihood of a spectrum whose level is free, one average of it."""
    level = np.mean(power / shape)
    return float(np.sum(np.log(level * shape)))


def _smoothed(w: FloatArray, edge: float) -> FloatArray:
    """Return the power that exponential smoothing leaves at angles w per sample."""
    c = 2.0 - np.cos(edge)
    keep = c - np.sqrt(c**2 - 1.0)
    return np.asarray((1.0 - keep) ** 2 / (1.0 - 2.0 * keep * np.cos(w) + keep**2))


def _butter(w: FloatArray, edge: float) -> FloatArray:
    """Return the power that a second-order Butterworth filter leaves at angles w per sample."""
    return np.asarray(1.0 / (1.0 + (np.tan(w / 2.0) / np.tan(edge / 2.0)) ** 4))
