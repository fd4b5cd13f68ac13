# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Prediction of a sample of a stream by the straight line through the two before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from armid_ros.motion import FloatArray
import numpy as np
from scipy import special

#: Correlation of successive errors of a straight line in white noise.
_NOISE_CORRELATION = -2.0 / 3.0
#: Limit of errors in the computation of their correlation, in usual errors.
_CLIPPED = 3.0
#: Smallest jump that may be a full turn [rad].
_HALF_A_TURN = np.pi


#: Growth factor of errors over other times, of one sample or of each, shape (N, 1).
Factor = float | FloatArray


@dataclass(frozen=True, eq=False)
class StreamSample:
    """
    One sample of a stream.

    Attributes
    ----------
    t : float
        Stamp [s].
    x : ndarray, shape (m,)
        Measured signals.
    begins : bool
        Whether a position has stepped here, so that a new stretch begins.

    """

    t: float
    x: FloatArray
    begins: bool = False


@dataclass(frozen=True, eq=False)
class Excursion:
    """
    Samples off the predicted line, to which later samples return.

    Attributes
    ----------
    samples : tuple of StreamSample
        Samples off the line.
    off : ndarray, shape (m,)
        Largest distance from the line, over `limit`.
    limit : ndarray, shape (m,)
        Largest allowed distance from the line, in units of the signals.

    """

    samples: tuple[StreamSample, ...]
    off: FloatArray
    limit: FloatArray


@dataclass(frozen=True, eq=False)
class Usual:
    """
    Usual prediction errors.

    Attributes
    ----------
    period : float
        Sampling period [s].
    size : ndarray, shape (m,)
        Standard deviation of the errors over a period, in the noisiest window.
    noisy : ndarray, shape (m,)
        Share of white noise in the squared errors.

    """

    period: float
    size: FloatArray
    noisy: FloatArray

    def growth(self, noise: Factor, bend: Factor) -> FloatArray:
        """Return the growth of the errors over other times, shape (m,) or (N, m)."""
        squares = bend**2
        return np.asarray(np.sqrt(squares + self.noisy * (noise**2 - squares)))

    @cached_property
    def smoothness(self) -> FloatArray:
        """Correlation of successive errors, 0 for noise, shape (m,)."""
        return np.clip(1.0 - (1.0 - _NOISE_CORRELATION) * self.noisy, 0.0, 1.0)

    @cached_property
    def _shares(self) -> tuple[FloatArray, FloatArray]:
        """Return deviation of noise, and largest error by acceleration, over `size`, (m,)."""
        # the hardest acceleration of an arm is twice that of 95 % of the time, which is 1.96
        # standard deviations of a normal variable
        return np.sqrt(self.noisy), np.sqrt(1.0 - self.noisy) * (2.0 * 1.96)

    def limits(self, quantile: float, noise: Factor, bend: Factor) -> FloatArray:
        """
        Return the largest allowed prediction errors, shape (m,) or (N, m).

        The acceleration of an arm is bounded, unlike noise, which has tails. So the limit of a
        smooth signal is a small multiple of its usual error, not a quantile of the normal
        distribution.

        """
        noisy, smooth = self._shares
        tails = quantile * self.growth(noise, bend)
        return np.asarray(self.size * np.minimum(tails, quantile * noisy * noise + smooth * bend))


class Missed(NamedTuple):
    """
    Prediction error of a sample.

    Attributes
    ----------
    error : ndarray, shape (m,)
        Measured minus predicted signals.
    noise, bend : float
        Growth of the errors by noise, and by an acceleration, over this time relative to one
        period.

    """

    error: FloatArray
    noise: float
    bend: float


def growth_over(step: Factor, ahead: Factor, period: float) -> tuple[Factor, Factor]:
    """Return the growth of errors by noise and by an acceleration, a time ahead of two samples."""
    ratio = ahead / step
    noise = ((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0) ** 0.5
    return noise, 0.5 * ahead * (ahead + step) / period**2


def missed_by(known: Sequence[StreamSample], sample: StreamSample, period: float) -> Missed:
    """Return the error of the straight line through two samples at another one."""
    before, last = known
    step, ahead = last.t - before.t, sample.t - last.t
    error = sample.x - last.x - ahead / step * (last.x - before.x)
    return Missed(error, *growth_over(step, ahead, period))


def unwrapped(x: FloatArray, last: FloatArray, turn: FloatArray) -> FloatArray:
    """Undo a jump by full turns, by which drivers keep positions within +-pi."""
    if float(np.abs(x - last).max()) <= _HALF_A_TURN:
        return x
    turns = np.rint(np.divide(x - last, turn, where=turn > 0.0, out=np.zeros_like(x)))
    return np.asarray(x - turns * turn)


def all_unwrapped(samples: Sequence[StreamSample], turn: FloatArray) -> list[StreamSample]:
    """Return samples without the jumps by full turns between them."""
    found = [samples[0]]
    for sample in samples[1:]:
        found.append(replace(sample, x=unwrapped(sample.x, found[-1].x, turn)))
    return found


def robust_scale(missed: FloatArray, share: float) -> FloatArray:
    """Return the standard deviation of errors (k, m), from the quantile of a share of them."""
    ordered = np.sort(np.abs(missed), axis=0)  # numpy's quantile takes ten times as long
    place = share * (len(ordered) - 1)
    first = int(place)
    low, high = ordered[first], ordered[min(first + 1, len(ordered) - 1)]
    return np.asarray((low + (place - first) * (high - low)) / special.ndtri(0.5 + share / 2.0))


def share_of_noise(missed: FloatArray, size: FloatArray) -> FloatArray:
    """Return the share of white noise in the squares of successive errors of shape (k, m)."""
    most = _CLIPPED * size
    errors = np.minimum(np.maximum(missed, -most), most)
    squares = np.einsum('k...,k...->...', errors, errors)
    products = np.einsum('k...,k...->...', errors[1:], errors[:-1])
    correlation = np.divide(products, squares, where=squares > 0.0, out=np.ones_like(squares))
    share = (1.0 - correlation) / (1.0 - _NOISE_CORRELATION)
    return np.asarray(np.minimum(np.maximum(share, 0.0), 1.0))
