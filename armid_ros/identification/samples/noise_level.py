# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What predictions of a stream usually miss by: its noise, and the resolution of its signals."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from armid_ros.identification.samples.straight_line import (
    Missed,
    robust_scale,
    share_of_noise,
    Usual,
)
from armid_ros.motion import FloatArray
import numpy as np

#: Predictions whose usual error is measured together.
WINDOW = 100
#: Such windows that are remembered: a minute at 1 kHz.
_REMEMBERED = 600
#: Share of predictions that tells the usual error. The others may be steps of friction, or damage.
SHARE = 0.95
#: The same for the first few samples: one damaged sample spoils three predictions.
_SHARE_FIRST = 0.75
#: How often a step has to be seen to be one that the signal makes.
SEEN = 3


class NoiseLevel:
    """
    Learns from good samples what the predictions of the next ones usually miss by.

    Parameters
    ----------
    count : int
        Signals m.

    Attributes
    ----------
    usual : Usual
        Of the loudest window that is remembered; at least the resolution.

    """

    def __init__(self, count: int) -> None:
        self.usual = Usual(np.inf, np.zeros(count), np.zeros(count))
        self._steps, self._most = np.full((SEEN, count), np.inf), np.zeros(count)
        self._windows: deque[tuple[FloatArray, FloatArray]] = deque(maxlen=_REMEMBERED)
        self._errors: list[FloatArray] = []
        self._moves: list[FloatArray] = []

    def set(self, usual: Usual) -> None:
        """Take it as known what is usual."""
        self._windows.clear()
        self._windows.append((usual.size, usual.noisy))
        self.usual = usual

    def forget(self) -> None:
        """Measure the noise anew with the next `begin`."""
        self._windows.clear()

    def begin(self, missed: Sequence[Missed], moves: FloatArray, period: float) -> None:
        """
        Learn from the first samples, of which some may be damaged.

        Parameters
        ----------
        missed : sequence of Missed
            The prediction errors.
        moves : ndarray, shape (k, m)
            From each sample to the next.
        period : float
            Sampling period [s].

        """
        self.see_steps(moves)
        self._most = np.maximum(self._most, np.max(np.abs([m.error for m in missed]), axis=0))
        if not self._windows:
            errors = np.array([m.error / max(m.noise, m.bend) for m in missed])
            size = np.maximum(robust_scale(errors, _SHARE_FIRST), self._resolution)
            self.usual = Usual(period, size, share_of_noise(errors, size))

    def learn(self, missed: Missed, move: FloatArray) -> None:
        """Take in the prediction error of a good sample and its move, shape (m,)."""
        self._errors.append(missed.error / self.usual.growth(missed.noise, missed.bend))
        self._moves.append(move)

    def settle(self, period: float) -> None:
        """Measure what is usual anew if a whole window of errors came."""
        if len(self._errors) < WINDOW:
            return
        errors = np.array(self._errors)
        self._most = np.maximum(self._most, np.abs(errors).max(axis=0))
        size = robust_scale(errors, SHARE)
        self._windows.append((size, share_of_noise(errors, size)))
        self.see_steps(np.array(self._moves))
        self._errors, self._moves = [], []
        sizes, shares = (np.array(part) for part in zip(*self._windows, strict=True))
        loudest = np.argmax(sizes, axis=0)[np.newaxis]
        size = np.maximum(np.take_along_axis(sizes, loudest, 0)[0], self._resolution)
        self.usual = Usual(period, size, np.take_along_axis(shares, loudest, 0)[0])

    def see_steps(self, moves: FloatArray) -> None:
        """Learn the resolution from moves of shape (k, m)."""
        steps = np.abs(moves)
        steps = np.concatenate([self._steps, np.where(steps > 0.0, steps, np.inf)])
        self._steps = np.partition(steps, SEEN - 1, axis=0)[:SEEN]

    @property
    def _resolution(self) -> FloatArray:
        """
        The smallest step of every signal, 0 where it is not known.

        A signal that moves fast makes no small steps; but by its resolution it leaves any line.

        """
        return np.minimum(self._most, np.where(np.isfinite(self._steps[-1]), self._steps[-1], 0.0))
