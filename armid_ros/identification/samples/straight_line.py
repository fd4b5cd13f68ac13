# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the straight line through two samples of a stream misses the next one by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math
from typing import NamedTuple

from armid_ros.motion import FloatArray
import numpy as np
from scipy import special

#: Correlation of successive errors of a straight line in white noise.
_NOISE_CORRELATION = -2.0 / 3.0
#: Usual errors beyond which one says nothing of the correlation.
_CLIPPED = 3.0
#: Less is no jump by a full turn [rad].
_HALF_A_TURN = np.pi


#: How much more something is over other times, of one sample or of each, shape (N, 1).
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
        What was measured.
    begins : bool
        Whether a position has stepped here, so that this does not continue what was before.

    """

    t: float
    x: FloatArray
    begins: bool = False


@dataclass(frozen=True, eq=False)
class Excursion:
    """
    Samples that leave the line that was led to them, and come back to it.

    Attributes
    ----------
    samples : tuple of StreamSample
        Those between the line before and behind.
    off : ndarray, shape (m,)
        How far off the line they are at most, over what is too far.
    limit : ndarray, shape (m,)
        What is too far, in units of the signals.

    """

    samples: tuple[StreamSample, ...]
    off: FloatArray
    limit: FloatArray


@dataclass(frozen=True, eq=False)
class Usual:
    """
    What predictions usually miss by.

    Attributes
    ----------
    period : float
        Sampling period [s].
    size : ndarray, shape (m,)
        Standard deviation of the errors over a period, where the signals are loudest.
    noisy : ndarray, shape (m,)
        Share of white noise in their squares.

    """

    period: float
    size: FloatArray
    noisy: FloatArray

    def growth(self, noise: Factor, bend: Factor) -> FloatArray:
        """Return by how much more they miss over other times, shape (m,) or (N, m)."""
        squares = bend**2
        return np.asarray(np.sqrt(squares + self.noisy * (noise**2 - squares)))

    @cached_property
    def smoothness(self) -> FloatArray:
        """Correlation of successive errors, 0 for noise, shape (m,)."""
        return np.clip(1.0 - (1.0 - _NOISE_CORRELATION) * self.noisy, 0.0, 1.0)

    @cached_property
    def _shares(self) -> tuple[FloatArray, FloatArray]:
        """Return standard deviations of what is noise, most of what is not, over `size`, (m,)."""
        # how hard an arm may accelerate over what 95 % of the time it does at most, times the
        # standard deviations that those are of a normal variable
        return np.sqrt(self.noisy), np.sqrt(1.0 - self.noisy) * (2.0 * 1.96)

    def limits(self, quantile: float, noise: Factor, bend: Factor) -> FloatArray:
        """
        Return what a prediction may miss by, shape (m,) or (N, m).

        An arm has a hardest acceleration, unlike noise, which has tails. So a smooth signal is
        held to a small multiple of what it usually misses by, not to a quantile of the normal
        distribution.

        """
        noisy, smooth = self._shares
        tails = quantile * self.growth(noise, bend)
        return np.asarray(self.size * np.minimum(tails, quantile * noisy * noise + smooth * bend))


class Missed(NamedTuple):
    """
    What a prediction missed a sample by.

    Attributes
    ----------
    error : ndarray, shape (m,)
        Measured minus predicted.
    noise, bend : float
        How much more noise, and an acceleration, make a prediction over this time miss than one
        over a period.

    """

    error: FloatArray
    noise: float
    bend: float


def missed_by(known: Sequence[StreamSample], sample: StreamSample, period: float) -> Missed:
    """Return what a straight line through two samples misses another one by."""
    before, last = known
    step, ahead = last.t - before.t, sample.t - last.t
    ratio = ahead / step
    noise = math.sqrt((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0)
    bend = 0.5 * ahead * (ahead + step) / period**2
    return Missed(sample.x - last.x - ratio * (last.x - before.x), noise, bend)


def unwrapped(x: FloatArray, last: FloatArray, turn: FloatArray) -> FloatArray:
    """Undo the jump by a full turn, where there is one, with which drivers keep within +-pi."""
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
    """Return the standard deviation of which a normal variable exceeds so few of the errors."""
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
