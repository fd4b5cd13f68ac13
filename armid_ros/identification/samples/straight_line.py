# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Prediction of a sample of a stream by the straight line through the two samples before it.

The typical prediction errors are the noise of a stream and the resolution of its signals. One
sample in a hundred completes a window of errors. All windows take the same computing time, as a
stream must not wait.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

from armid_ros.motion import FloatArray
import numpy as np
from scipy import special

#: Correlation of successive errors of a straight line in white noise.
_NOISE_CORRELATION = -2.0 / 3.0
#: Number of predictions in a window, whose usual error is computed together.
WINDOW = 100
#: Largest number of successive damaged samples, and of periods in a gap. A longer excursion is
#: real, and a longer gap begins a new stretch.
MAX_GAP = 10
#: Mean time between two good samples that are left out by error, in normal noise [s].
FALSE_ALARM_TIME = 360_000.0

#: Factor by which prediction errors exceed those over one period: a number, or (N, 1).
Factor = float | FloatArray
Time = TypeVar('Time', float, FloatArray)


@dataclass(frozen=True, eq=False)
class StreamSample:
    """
    Measured signals of all joints at one time in a stream.

    Attributes
    ----------
    t : float
        Time stamp [s].
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
    Samples that leave a predicted straight line before later samples return to the line.

    Attributes
    ----------
    samples : tuple of StreamSample
        Samples off the line.
    ratio : ndarray, shape (m,)
        Largest distance from the line, over `limit`.
    limit : ndarray, shape (m,)
        Largest allowed distance from the line, in units of the signals.

    """

    samples: tuple[StreamSample, ...]
    ratio: FloatArray
    limit: FloatArray


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """
    Typical prediction errors of undamaged samples of a stream.

    Attributes
    ----------
    period : float
        Sampling period [s].
    size : ndarray, shape (m,)
        Standard deviation of the prediction errors over one period, in the noisiest window.
    white : ndarray, shape (m,)
        Share of white noise in the squared errors.
    quantile : float
        Largest allowed error by noise, in standard deviations.

    """

    period: float
    size: FloatArray
    white: FloatArray
    quantile: float

    def growth(self, noise: Factor, acceleration: Factor) -> FloatArray:
        """Return each signal's growth factor, (m,) or (N, m), from noise and acceleration."""
        squares = acceleration**2
        return np.asarray(np.sqrt(squares + self.white * (noise**2 - squares)))

    @cached_property
    def correlation(self) -> FloatArray:
        """Correlation of successive prediction errors: 0 for noise, 1 for acceleration, (m,)."""
        return np.clip(1.0 - (1.0 - _NOISE_CORRELATION) * self.white, 0.0, 1.0)

    def limits(self, noise: Factor, acceleration: Factor) -> FloatArray:
        """
        Return the largest allowed prediction errors for growth factors of noise and acceleration.

        The acceleration of an arm is bounded, unlike noise, which has tails. The limit of a smooth
        signal is therefore a small multiple of its typical error, not a quantile of the normal
        distribution.

        """
        # the largest acceleration of an arm is twice its 95 % quantile, which is 1.96 standard
        # deviations of a normal variable
        white, smooth = np.sqrt(self.white), np.sqrt(1.0 - self.white) * (2.0 * 1.96)
        return np.asarray(self.size * (self.quantile * white * noise + smooth * acceleration))

    @cached_property
    def limits_of_a_period(self) -> FloatArray:
        """Largest allowed prediction errors over one sampling period, shape (m,)."""
        return self.limits(1.0, 1.0)


class Innovation(NamedTuple):
    """
    Error of the prediction of one sample.

    Attributes
    ----------
    error : ndarray, shape (m,)
        Measured minus predicted signals.
    noise, acceleration : float
        Factors by which errors by noise, and by an acceleration, exceed those over one period.

    """

    error: FloatArray
    noise: float
    acceleration: float


def growth_over(step: Time, ahead: Time, period: float) -> tuple[Time, Time]:
    """Return growth factors of prediction errors after `ahead` s: by noise, by acceleration."""
    ratio = ahead / step
    noise: Time = ((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0) ** 0.5
    return noise, 0.5 * ahead * (ahead + step) / period**2


def innovation_of(
    reference: Sequence[StreamSample], sample: StreamSample, period: float
) -> Innovation:
    """Return the error of predicting a sample by the line through two earlier samples."""
    before, last = reference
    step, ahead = last.t - before.t, sample.t - last.t
    error = sample.x - last.x - ahead / step * (last.x - before.x)
    return Innovation(error, *growth_over(step, ahead, period))


def unwrapped(x: FloatArray, last: FloatArray, turn: FloatArray) -> FloatArray:
    """Return `x` without jumps by full turns from `last`, as drivers may wrap angles."""
    if float(np.abs(x - last).max()) <= np.pi:
        return x
    turns = np.rint(np.divide(x - last, turn, where=turn > 0.0, out=np.zeros_like(x)))
    return np.asarray(x - turns * turn)


def all_unwrapped(samples: Sequence[StreamSample], turn: FloatArray) -> list[StreamSample]:
    """Return successive samples without jumps of positions by full turns."""
    found = [samples[0]]
    for sample in samples[1:]:
        found.append(replace(sample, x=unwrapped(sample.x, found[-1].x, turn)))
    return found


def quantile(period: float, count: int) -> float:
    """Return the error limit [standard deviations] for a rare false alarm of `count` signals."""
    return float(-special.ndtri(min(period / FALSE_ALARM_TIME / count, 0.5) / 2.0))


def robust_scale(innovations: FloatArray, share: float = 0.95) -> FloatArray:
    """
    Return the standard deviation of errors, (k, m), from a quantile of absolute errors.

    Larger errors may be friction steps, or damage.

    """
    place = share * (len(innovations) - 1)
    first = int(place)
    second = min(first + 1, len(innovations) - 1)
    # numpy's quantile takes ten times as long
    ordered = np.partition(np.abs(innovations), (first, second), axis=0)
    low, high = ordered[first], ordered[second]
    return np.asarray((low + (place - first) * (high - low)) / special.ndtri(0.5 + share / 2.0))


def share_of_noise(innovations: FloatArray, size: FloatArray) -> FloatArray:
    """Return the share of white noise in the squares of successive errors (k, m)."""
    most = 3.0 * size  # larger errors are limited
    errors = np.minimum(np.maximum(innovations, -most), most)
    squares = np.einsum('k...,k...->...', errors, errors)
    products = np.einsum('k...,k...->...', errors[1:], errors[:-1])
    correlation = np.divide(products, squares, where=squares > 0.0, out=np.ones_like(squares))
    share = (1.0 - correlation) / (1.0 - _NOISE_CORRELATION)
    return np.asarray(np.minimum(np.maximum(share, 0.0), 1.0))


class NoiseLevel:
    """
    Estimator of the typical prediction errors of a stream, from undamaged samples.

    Parameters
    ----------
    finest, coarsest : ndarray, shape (m,)
        Best resolution of the signals, and worst resolution of signals that never changed.
    onset : ndarray, shape (m,)
        Assumed second derivative before the first motion, per second squared.

    Attributes
    ----------
    model : ErrorModel
        Usual prediction errors in the noisiest window of the last minute; at least the resolution.

    """

    def __init__(self, finest: FloatArray, coarsest: FloatArray, onset: FloatArray) -> None:
        self._finest, self._coarsest, self._onset = finest, coarsest, onset
        count = len(self._finest)
        self.model = ErrorModel(np.inf, np.zeros(count), np.zeros(count), 0.0)
        # a step that occurs three times is the resolution of a signal
        self._min_steps, self._max_error = np.full((3, count), np.inf), np.zeros(count)
        self._sizes, self._shares = np.zeros((2, 600, count))  # windows of a minute at 1 kHz
        self._seen = 0
        # errors, changes and growth factors of each sample; more may follow before `settle`
        self._window, self._count = np.empty((WINDOW + 2 * MAX_GAP, 2 * count + 2)), 0

    def set(self, model: ErrorModel) -> None:
        """Replace the typical prediction errors by an error model."""
        self.forget()
        self._remember(model.size, model.white)
        self.model = model

    def forget(self) -> None:
        """Forget the measured noise, so that `begin` measures it again."""
        self._sizes[:] = 0.0
        self._seen = 0

    def begin(self, innovations: Sequence[Innovation], moves: FloatArray, period: float) -> None:
        """
        Measure typical prediction errors of the first samples, some of which may be damaged.

        `moves`, (k, m), are the differences between successive samples; the period is in s.

        """
        self.add_steps(moves)
        errors = np.array([one.error for one in innovations])
        self._max_error = np.maximum(self._max_error, np.abs(errors).max(axis=0))
        if not self._seen:
            errors /= [[max(one.noise, one.acceleration)] for one in innovations]
            # one damaged sample spoils three of the first predictions
            size = robust_scale(errors, 0.75)
            self._use(period, size, share_of_noise(errors, np.maximum(size, self._least(period))))

    def learn(self, innovation: Innovation, move: FloatArray) -> None:
        """Add the prediction error of an undamaged sample, and the change of its signals (m,)."""
        error, *growth = innovation
        self._window[self._count] = np.concatenate([error, move, growth])
        self._count += 1

    def settle(self, period: float, count: int = WINDOW) -> bool:
        """Update the typical prediction errors if a window is full; return whether updated."""
        if self._count < count:
            return False
        window, self._count = self._window[: self._count], 0
        growth = self.model.growth(window[:, -2:-1], window[:, -1:])
        errors, moves = window[:, : len(self._finest)] / growth, window[:, len(self._finest) : -2]
        self._max_error = np.maximum(self._max_error, np.abs(errors).max(axis=0))
        size = robust_scale(errors)
        self._remember(size, share_of_noise(errors, size))
        self.add_steps(moves)
        loudest = np.argmax(self._sizes, axis=0), np.arange(len(size))
        self._use(period, self._sizes[loudest], self._shares[loudest])
        return True

    def _use(self, period: float, size: FloatArray, white: FloatArray) -> None:
        """Set the typical prediction errors to `size`, or to the resolution if larger."""
        allowed = quantile(period, len(size))
        self.model = ErrorModel(period, np.maximum(size, self._least(period)), white, allowed)

    def _remember(self, size: FloatArray, white: FloatArray) -> None:
        """Store the typical prediction errors of a window in place of the oldest window."""
        place = self._seen % len(self._sizes)
        self._sizes[place], self._shares[place] = size, white
        self._seen += 1

    def add_steps(self, moves: FloatArray) -> None:
        """Update each signal's resolution with the changes (k, m) between samples."""
        sizes = np.abs(moves)
        if ((sizes > 0.0) & (sizes < self._min_steps[-1])).any():  # seldom after the first samples
            self._min_steps = smallest_steps(np.concatenate([self._min_steps, sizes]))

    def _least(self, period: float) -> FloatArray:
        """Return each signal's smallest relevant error: resolution, or change at motion onset."""
        # A fast signal has no small steps, but its resolution causes prediction errors.
        known = np.isfinite(self._min_steps[-1])
        step = np.where(known, self._min_steps[-1], 0.0)
        least = np.maximum(self._finest, self._onset * period**2)
        least = np.where(known, least, np.maximum(least, self._coarsest))
        return np.maximum(np.minimum(self._max_error, step), least)


def smallest_steps(steps: FloatArray) -> FloatArray:
    """Return the three smallest nonzero changes of each signal, shape (3, m)."""
    none = np.full((3, steps.shape[1]), np.inf)
    steps = np.concatenate([none, np.where(steps > 0.0, steps, np.inf)])
    return np.partition(steps, 2, axis=0)[:3]
