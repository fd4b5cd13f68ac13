# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How soon a change of torque can be seen at all, whatever looks for it.

The most powerful test knows everything but whether the change has come: the parameters before,
what it does to the torques and the spectrum of the noise. Its statistic is the energy
E = d^T C^-1 d of the change d in units of the noise, and it sees a change in one of two cases once
sqrt(E) is the quantile of the normal distribution for its rate of false alarms (Neyman and Pearson
1933). It is given the torques' means over a tenth of a second, which is what a low-pass of 5 Hz
leaves of them.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np
from scipy import linalg, stats

#: Samples of a mean: a tenth of a second at 1 kHz.
_MEAN = 100


@dataclass(frozen=True)
class Noise:
    """
    White noise and noise of first order beside it, alike on all joints.

    Attributes
    ----------
    white, coloured : float
        Standard deviations of a sample [N m].
    keep : float
        Share of the coloured one that is the same in the next sample.

    """

    white: float
    coloured: float
    keep: float

    def covariance(self, count: int) -> FloatArray:
        """Return the covariance of `count` successive means, shape (count, count)."""
        lag = np.arange(-_MEAN + 1, _MEAN)
        share = (_MEAN - np.abs(lag)) / _MEAN**2
        apart = np.abs(lag + _MEAN * np.arange(count)[:, np.newaxis])
        values = self.coloured**2 * self.keep**apart + self.white**2 * (apart == 0)
        return np.asarray(linalg.toeplitz(values @ share))


@dataclass(frozen=True, eq=False)
class Visibility:
    """
    What the most powerful test makes of a change.

    Attributes
    ----------
    delay : float
        When it sees the change [s]; NaN if not within the torques that are given.
    smallest : float
        The share of the change that it would see within the time that is wanted.

    """

    delay: float
    smallest: float


def visibility(
    torque: FloatArray, period: float, noise: Noise, within: float, chance: float
) -> Visibility:
    """
    Say how soon a change can be seen.

    Parameters
    ----------
    torque : ndarray, shape (N, n)
        What it adds to the torques, from its beginning [N m].
    period : float
        Between samples [s].
    noise : Noise
        Of the torques.
    within : float
        When it should be seen [s].
    chance : float
        Of a false alarm in one look.

    """
    count = len(torque) // _MEAN
    means = torque[: count * _MEAN].reshape(count, _MEAN, -1).mean(axis=1)
    root = linalg.cholesky(noise.covariance(count), lower=True)
    white = linalg.solve_triangular(root, means, lower=True)
    energy = np.cumsum(np.sum(white**2, axis=1))
    needed = stats.norm.isf(chance) ** 2
    seen = np.flatnonzero(energy >= needed)
    end = period * _MEAN * (seen[0] + 1) if len(seen) else np.nan
    then = energy[round(within / (period * _MEAN)) - 1]
    return Visibility(float(end), float(np.sqrt(needed / then)) if then > 0.0 else np.inf)
