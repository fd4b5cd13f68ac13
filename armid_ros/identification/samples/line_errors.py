# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What straight lines miss the samples of a whole recording by (`straight_line`), all at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.identification.samples.straight_line import robust_scale, share_of_noise, Usual
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class LineErrors:
    """
    Errors of the straight lines through the two samples before each.

    Attributes
    ----------
    stretch : ndarray of int, shape (N,)
        First sample of the stretch without a long gap that a sample is of.
    error : ndarray, shape (N, m)
        How far off each sample is, when a smooth signal bends on; 0 for the first of a stretch.
    bent : ndarray, shape (N, m)
        How far off the straight line it is, over a period.
    noise, bend : ndarray, shape (N, 1)
        How much more noise, and an acceleration, make a prediction over this time miss than one
        over a period.
    usual : Usual
        What is usual of the loudest part of the whole.
    quantile : float
        Standard deviations that a prediction may miss by.

    """

    stretch: npt.NDArray[np.intp]
    error: FloatArray
    bent: FloatArray
    noise: FloatArray
    bend: FloatArray
    usual: Usual
    quantile: float = 1.0

    def off(self, floor: FloatArray) -> FloatArray:
        """
        Return how far off each sample is, over what is too far.

        Parameters
        ----------
        floor : ndarray, shape (m,)
            What a sample may be off by without consequence.

        Returns
        -------
        ndarray, shape (N, m)

        """
        limit = self.usual.limits(self.quantile, self.noise, self.bend)
        limit = np.maximum(limit, floor)
        return np.asarray(np.abs(self.error) / np.maximum(limit, np.finfo(float).tiny))


def line_errors(
    t: FloatArray,
    x: FloatArray,
    turn: FloatArray,
    *,
    max_gap: int,
    window: int,
    share: float,
    seen: int,
) -> LineErrors:
    """
    Return what the straight lines through two samples miss the next ones by.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Stamps, at least 3, each after the one before [s].
    x : ndarray, shape (N, m)
        Signals.
    turn : ndarray, shape (m,)
        Jumps of a signal that are none, 0 without.
    max_gap : int
        Periods beyond which a gap ends a stretch.
    window : int
        Errors whose usual size is measured together.
    share : float
        Share of them that tells it.
    seen : int
        How often a step has to be seen to be the smallest that a signal makes.

    Returns
    -------
    LineErrors

    """
    dt, moves = np.diff(t), np.diff(x, axis=0)
    moves -= np.rint(moves / np.where(turn > 0.0, turn, np.inf)) * turn
    period = float(np.median(dt))
    gap = dt > max_gap * period
    first = np.where(np.concatenate([[True], gap]), np.arange(len(t)), 0)
    ratio = dt[1:] / dt[:-1]
    noise = np.sqrt((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0)
    bend = 0.5 * dt[1:] * (dt[1:] + dt[:-1]) / period**2
    error = moves[1:] - ratio[:, np.newaxis] * moves[:-1]
    error[gap[1:] | gap[:-1]] = 0.0
    usual = _usual(period, error / np.maximum(noise, bend)[:, np.newaxis], window, share)
    smallest = np.minimum(_smallest_steps(np.abs(moves), seen), np.abs(error).max(axis=0))
    usual = replace(usual, size=np.maximum(usual.size, smallest))
    bent = error / bend[:, np.newaxis]
    error[1:] -= usual.smoothness * bent[:-1] * bend[1:, np.newaxis]
    none = np.zeros((2, x.shape[1]))
    return LineErrors(
        np.maximum.accumulate(first),
        np.concatenate([none, error]),
        np.concatenate([none, bent]),
        np.concatenate([[1.0, 1.0], noise])[:, np.newaxis],
        np.concatenate([[1.0, 1.0], bend])[:, np.newaxis],
        usual,
    )


def _usual(period: float, errors: FloatArray, window: int, share: float) -> Usual:
    """Return what is usual of the loudest of all windows of errors (N, m)."""
    windows = max(1, len(errors) // window)
    size, longer = divmod(len(errors), windows)
    signals, cut = errors.shape[1], longer * (size + 1)
    parts = [
        errors[:cut].reshape(longer, size + 1, signals),
        errors[cut:].reshape(windows - longer, size, signals),
    ]
    parts = [part.swapaxes(0, 1) for part in parts if len(part)]
    sizes = [robust_scale(part, share) for part in parts]
    noisy = np.concatenate([share_of_noise(*both) for both in zip(parts, sizes, strict=True)])
    every = np.concatenate(sizes)
    loudest = np.argmax(every, axis=0)[np.newaxis]
    return Usual(
        period,
        np.take_along_axis(every, loudest, 0)[0],
        np.take_along_axis(noisy, loudest, 0)[0],
    )


def _smallest_steps(steps: FloatArray, seen: int) -> FloatArray:
    """Return the smallest step of every signal that is seen so often, 0 where none is."""
    steps = np.where(steps > 0.0, steps, np.inf)
    if len(steps) < seen:
        return np.zeros(steps.shape[1])
    smallest = np.partition(steps, seen - 1, axis=0)[seen - 1]
    return np.where(np.isfinite(smallest), smallest, 0.0)
