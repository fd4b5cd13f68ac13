# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Prediction of a sample of a stream by the straight line through the two before it.

The usual prediction errors are the noise of a stream and the resolution of its signals. One
sample in a hundred completes a window of errors. All windows take the same computing time, as a
stream must not wait.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import special

#: Correlation of successive errors of a straight line in white noise.
_NOISE_CORRELATION = -2.0 / 3.0
#: Smallest jump that may be a full turn [rad].
_HALF_A_TURN = np.pi
#: Number of predictions in a window, whose usual error is computed together.
_WINDOW = 100
#: Number of windows kept: one minute at 1 kHz.
_REMEMBERED = 600
#: Share of predictions that define the usual error. Others may be friction steps, or damage.
_SHARE = 0.95
#: Share for the first few samples, where one damaged sample spoils three predictions.
_SHARE_FIRST = 0.75
#: Number of occurrences from which a step is the resolution of the signal.
_SEEN = 3


#: Growth factor of errors over other times, of one sample or of each, shape (N, 1).
Factor = float | FloatArray
Time = TypeVar('Time', float, FloatArray)


@dataclass(frozen=True, eq=False)
class StreamSample:
    """
    Sample of a stream.

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
        # the largest acceleration of an arm is twice its 95 % quantile, which is 1.96 standard
        # deviations of a normal variable
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
    Prediction error of one sample.

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


def growth_over(step: Time, ahead: Time, period: float) -> tuple[Time, Time]:
    """Return the growth of errors by noise and by acceleration over a time after two samples."""
    ratio = ahead / step
    noise: Time = ((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0) ** 0.5
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
    """Return the standard deviation of errors, (k, m), from one of their quantiles."""
    ordered = np.sort(np.abs(missed), axis=0)  # numpy's quantile takes ten times as long
    place = share * (len(ordered) - 1)
    first = int(place)
    low, high = ordered[first], ordered[min(first + 1, len(ordered) - 1)]
    return np.asarray((low + (place - first) * (high - low)) / special.ndtri(0.5 + share / 2.0))


def share_of_noise(missed: FloatArray, size: FloatArray) -> FloatArray:
    """Return the share of white noise in the squares of successive errors of shape (k, m)."""
    most = 3.0 * size  # larger errors are limited
    errors = np.minimum(np.maximum(missed, -most), most)
    squares = np.einsum('k...,k...->...', errors, errors)
    products = np.einsum('k...,k...->...', errors[1:], errors[:-1])
    correlation = np.divide(products, squares, where=squares > 0.0, out=np.ones_like(squares))
    share = (1.0 - correlation) / (1.0 - _NOISE_CORRELATION)
    return np.asarray(np.minimum(np.maximum(share, 0.0), 1.0))


class NoiseLevel:
    """
    Estimator of the usual prediction error, from undamaged samples.

    Parameters
    ----------
    count : int
        Number of signals m.
    together : int
        Largest number of samples that are added before `settle`.
    finest : ndarray, shape (m,)
        Best resolution of the signals.
    onset : ndarray, shape (m,)
        Assumed second derivative before the first motion, per second squared.

    Attributes
    ----------
    usual : Usual
        Usual error in the noisiest window that is kept; at least the resolution.

    """

    def __init__(self, count: int, together: int, finest: FloatArray, onset: FloatArray) -> None:
        self._finest, self._onset = finest, onset
        self.usual = Usual(np.inf, np.zeros(count), np.zeros(count))
        self._steps, self._most = np.full((_SEEN, count), np.inf), np.zeros(count)
        self._sizes, self._shares = np.zeros((2, _REMEMBERED, count))
        self._seen = 0
        self._errors, self._moves = np.empty((2, _WINDOW + together, count))
        self._growths = np.empty((_WINDOW + together, 2, 1))
        self._waiting = 0

    def set(self, usual: Usual) -> None:
        """Set the usual prediction error."""
        self.forget()
        self._remember(usual.size, usual.noisy)
        self.usual = usual

    def forget(self) -> None:
        """Clear the measured noise; the next `begin` measures it again."""
        self._sizes[:] = 0.0
        self._seen = 0

    def begin(self, missed: Sequence[Missed], moves: FloatArray, period: float) -> None:
        """
        Measure the usual errors of the first samples, some of which may be damaged.

        Parameters
        ----------
        missed : sequence of Missed
            The prediction errors.
        moves : ndarray, shape (k, m)
            Differences between successive samples.
        period : float
            Sampling period [s].

        """
        self.see_steps(moves)
        self._most = np.maximum(self._most, np.max(np.abs([m.error for m in missed]), axis=0))
        if not self._seen:
            errors = np.array([m.error / max(m.noise, m.bend) for m in missed])
            size = np.maximum(robust_scale(errors, _SHARE_FIRST), self._least(period))
            self.usual = Usual(period, size, share_of_noise(errors, size))

    def learn(self, missed: Missed, move: FloatArray) -> None:
        """Add the prediction error of an undamaged sample, and its change, shape (m,)."""
        self._errors[self._waiting] = missed.error
        self._growths[self._waiting, :, 0] = missed.noise, missed.bend
        self._moves[self._waiting] = move
        self._waiting += 1

    def settle(self, period: float) -> None:
        """Update the usual error when a window of errors is complete."""
        if self._waiting < _WINDOW:
            return
        growths, moves = self._growths[: self._waiting], self._moves[: self._waiting]
        errors = self._errors[: self._waiting] / self.usual.growth(growths[:, 0], growths[:, 1])
        self._waiting = 0
        self._most = np.maximum(self._most, np.abs(errors).max(axis=0))
        size = robust_scale(errors, _SHARE)
        self._remember(size, share_of_noise(errors, size))
        self.see_steps(moves)
        loudest = np.argmax(self._sizes, axis=0), np.arange(len(size))
        size = np.maximum(self._sizes[loudest], self._least(period))
        self.usual = Usual(period, size, self._shares[loudest])

    def _remember(self, size: FloatArray, noisy: FloatArray) -> None:
        place = self._seen % _REMEMBERED
        self._sizes[place], self._shares[place] = size, noisy
        self._seen += 1

    def see_steps(self, moves: FloatArray) -> None:
        """Estimate the resolution from changes between samples, shape (k, m)."""
        self._steps = _smallest(np.concatenate([self._steps, np.abs(moves)]))

    def _least(self, period: float) -> FloatArray:
        """Return the smallest step of every signal, at least the finest and that of an onset."""
        # A fast signal has no small steps, but its resolution causes prediction errors.
        step = np.where(np.isfinite(self._steps[-1]), self._steps[-1], 0.0)
        least = np.maximum(self._finest, self._onset * period**2)
        return np.maximum(np.minimum(self._most, step), least)


class LineErrors(NamedTuple):
    """
    Prediction errors of the samples of a recording.

    Attributes
    ----------
    stretch : ndarray of int, shape (N,)
        First sample of the stretch that contains a sample; long gaps separate stretches.
    suspect : ndarray of bool, shape (N,)
        Whether a signal is off the line of the two samples before by more than the largest allowed
        error; False for the first two samples of a stretch.
    usual : Usual
        Usual error in the noisiest part of the recording.

    """

    stretch: npt.NDArray[np.intp]
    suspect: npt.NDArray[np.bool_]
    usual: Usual


def line_errors(
    t: FloatArray,
    x: FloatArray,
    floor: FloatArray,
    max_gap: int,
    quantile: Callable[[float], float],
) -> LineErrors:
    """
    Compare all samples of a recording with the straight lines through the two samples before.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Stamps, at least 3, each after the one before [s].
    x : ndarray, shape (N, m)
        Signals.
    floor : ndarray, shape (m,)
        Negligible error of a sample.
    max_gap : int
        Longest gap within a stretch, in periods.
    quantile : callable
        Function of the period [s] that returns the largest allowed error in standard deviations.

    """
    dt = np.diff(t)
    period = float(np.median(dt))
    gap = dt > max_gap * period
    first = np.where(np.concatenate([[True], gap]), np.arange(len(t)), 0)
    apart = gap[1:] | gap[:-1]
    ratio, (noise, bend) = dt[1:] / dt[:-1], growth_over(dt[:-1], dt[1:], period)
    growth = np.maximum(noise, bend)
    suspect = np.zeros(len(t), dtype=bool)
    sizes, shares = np.zeros((2, x.shape[1]))
    # windows of equal length are processed together; the last few samples are in none
    count = max(1, len(ratio) // _WINDOW)
    length = len(ratio) // count
    for signal in range(x.shape[1]):  # the arrays of one signal fit into the cache
        moves = np.diff(x[:, signal])
        error = moves[1:] - ratio * moves[:-1]
        error[apart] = 0.0
        windows = (error / growth)[: count * length].reshape(count, length).T
        scales = robust_scale(windows, _SHARE)
        loudest = int(np.argmax(scales))
        noisy = share_of_noise(windows[:, loudest], scales[loudest])
        step = float(_smallest(np.abs(moves)[:, np.newaxis])[-1, 0])
        least = min(step if np.isfinite(step) else 0.0, float(np.abs(error).max()))
        size = max(scales[loudest], least)
        usual = Usual(period, np.array([size]), np.array([noisy]))
        limit = np.maximum(usual.limits(quantile(period), noise, bend), floor[signal])
        # a smooth signal keeps its curvature
        error[1:] -= usual.smoothness * (error[:-1] / bend[:-1]) * bend[1:]
        suspect[2:] |= (np.abs(error) > limit) & ~apart
        sizes[signal], shares[signal] = size, noisy
    return LineErrors(np.maximum.accumulate(first), suspect, Usual(period, sizes, shares))


def _smallest(steps: FloatArray) -> FloatArray:
    """Return the smallest nonzero steps of every signal, shape (_SEEN, m)."""
    none = np.full((_SEEN, steps.shape[1]), np.inf)
    steps = np.concatenate([none, np.where(steps > 0.0, steps, np.inf)])
    return np.partition(steps, _SEEN - 1, axis=0)[:_SEEN]
