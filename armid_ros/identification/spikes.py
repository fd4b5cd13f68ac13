# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Damaged samples in a stream of joint states, told from what the arm really does.

A torque or an encoder that is off in one sample bends an estimate by as much as thousands of good
samples mend. Every sample is predicted by the straight line through the two before it. One that is
too far from the prediction waits for those after it. When they return to where the line leads and
do not go on from it, it was damaged and is left out; otherwise the arm has changed, and all are
used. So damage costs the samples that are damaged, and no change is lost, however large.

Three things say how far is too far; the largest of them counts. The noise: what predictions
usually miss by, as much as in the loudest part of the last minute, since an arm at rest must not
forget what it is like in motion, times the quantile of a normal distribution at the chance of one
false alarm in `false_alarm_time`. The resolution, times the same: the smallest step that a signal
makes. The consequence (``floor``): what one sample has to be off by to move what is estimated from
it by as much as noise does.

"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
import math
from typing import NamedTuple

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import stats

#: Samples from which noise and period are learned before the first one is judged.
FIRST = 20
#: Predictions whose usual error is measured together.
WINDOW = 100
#: Such windows that are remembered: a minute at 1 kHz.
_REMEMBERED = 600
#: Share of predictions that tells the usual error. The others may be steps of friction, or damage.
_USUAL = 0.95
#: The same for the first few samples: one damaged sample spoils three predictions.
_USUAL_FIRST = 0.75
#: How often a step has to be seen to be one that the signal makes.
_SEEN = 3
#: A sample goes on from others that are nearer by this factor than where the line leads.
_NEARER = 0.5
#: What is divided by is at least this.
_TINY = 1e-300


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

    """

    t: float
    x: FloatArray


class _Missed(NamedTuple):
    """
    What a prediction missed a sample by.

    Attributes
    ----------
    error : ndarray, shape (m,)
        Absolute values.
    growth : float
        How much more a prediction over this time misses usually than one over a period.

    """

    error: FloatArray
    growth: float


class SpikeGate:
    """
    Pass on the samples of a stream without those that are damaged.

    Parameters
    ----------
    turning : array_like of bool, shape (m,)
        Signals that may jump by full turns, which is no damage.
    max_gap : int
        Successive samples that may be damaged; what lasts longer is real.
    false_alarm_time : float
        Mean time between two good samples that are left out, in normal noise [s].

    Attributes
    ----------
    spikes : Counter of int
        Samples left out, by the signal that was furthest off.
    rejected : Counter of str
        Samples left out, by reason: spike; stamp, which alone was off; erratic, which followed
        neither what was before nor each other; out_of_order.

    """

    def __init__(
        self, turning: npt.ArrayLike, *, max_gap: int = 10, false_alarm_time: float = 360000.0
    ) -> None:
        if not (max_gap >= 1 and false_alarm_time > 0.0):
            raise IdentificationError(
                f'damage of up to {max_gap} samples and a false alarm every '
                f'{false_alarm_time} s: both have to be above 0'
            )
        self._turn = np.where(np.asarray(turning, dtype=bool), 2.0 * np.pi, 0.0)
        self._max_gap = max_gap
        self._false_alarm_time = false_alarm_time
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.spikes: Counter[int] = Counter()
        self.rejected: Counter[str] = Counter()
        count = len(self._turn)
        self._steps = np.full((_SEEN, count), np.inf)
        self._usual: deque[FloatArray] = deque(maxlen=_REMEMBERED)
        self._errors: list[FloatArray] = []
        self._moves: list[FloatArray] = []
        self._scale = np.zeros(count)
        self._restart([])

    def take(self, t: float, x: FloatArray, floor: FloatArray | float = 0.0) -> list[StreamSample]:
        """
        Take in a sample, and return those that are known to be good by now, oldest first.

        Parameters
        ----------
        t : float
            Stamp [s].
        x : ndarray, shape (m,)
            Finite numbers.
        floor : ndarray, shape (m,), or float
            What a sample may be off by without consequence.

        """
        sample = StreamSample(t, self._unwrapped(x))
        if not self._in_time(sample):
            return []
        if self._first is None:
            return self._judge(sample, floor)
        self._first.append(sample)
        return self._begin(floor) if len(self._first) == FIRST else []

    def rest(self) -> list[StreamSample]:
        """Return the samples that still wait, at the end of a stream."""
        waiting = self._first if self._first is not None else self._held
        self._restart([])
        return waiting

    def furthest_off(
        self, t: FloatArray, x: FloatArray, floor: FloatArray | float = 0.0
    ) -> FloatArray:
        """
        Return how far off its prediction every sample of a whole stream is, over the limit.

        Quick, for streams of which most have no damage: where nothing is above 1 by the noise of
        the loudest part of the whole, there is none.

        Parameters
        ----------
        t : ndarray, shape (N,)
            Stamps [s].
        x : ndarray, shape (N, m)
            Signals.
        floor : ndarray, shape (m,), or float
            As for `take`.

        Returns
        -------
        ndarray, shape (N, m)

        """
        dt, moves = np.diff(t), np.diff(x, axis=0)
        turn = np.where(self._turn > 0.0, self._turn, np.inf)
        moves -= np.rint(moves / turn) * self._turn
        ratio, period = dt[1:] / dt[:-1], float(np.median(dt))
        noise = np.sqrt((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0)
        growth = np.maximum(noise, 0.5 * dt[1:] * (dt[1:] + dt[:-1]) / period**2)
        error = np.abs(moves[1:] - ratio[:, np.newaxis] * moves[:-1]) / growth[:, np.newaxis]
        limit = np.maximum(self._quantile_of(period) * _loudest(error), floor)
        off = np.zeros(x.shape)
        off[2:] = error / np.maximum(limit, _TINY)
        return off

    def _quantile_of(self, period: float) -> float:
        """Return how many standard deviations normal noise exceeds with so small a chance."""
        chance = period / self._false_alarm_time / len(self._turn)
        return float(stats.norm.isf(min(chance, 0.5) / 2.0))

    def _restart(self, first: list[StreamSample]) -> None:
        """Begin a new stretch with some samples; what is usual stays known."""
        self._first: list[StreamSample] | None = first
        self._known: tuple[StreamSample, ...] = ()
        self._held: list[StreamSample] = []
        self._went_on, self._suspect = 0, np.empty(0, dtype=np.intp)
        self._off = np.zeros(len(self._turn))
        self._stray: StreamSample | None = None
        self._period = np.inf
        self._quantile = 0.0

    def _unwrapped(self, x: FloatArray) -> FloatArray:
        """Undo the jump by a full turn with which some drivers keep a joint within +-pi."""
        tail = self._tail
        if tail is None:
            return x
        turns = np.rint(np.divide(x - tail.x, self._turn, where=self._turn > 0.0, out=0.0 * x))
        return np.asarray(x - turns * self._turn)

    @property
    def _tail(self) -> StreamSample | None:
        """The newest sample that is not damaged for sure."""
        return next((part[-1] for part in (self._held, self._first, self._known) if part), None)

    def _in_time(self, sample: StreamSample) -> bool:
        """Return whether a stamp continues the stream; two that do not begin a new one."""
        tail, stray, self._stray = self._tail, self._stray, None
        dt = 0.0 if tail is None else sample.t - tail.t
        longest = self._max_gap * self._period
        if tail is None or 0.0 < dt <= longest:
            if stray is not None:
                self.rejected['stamp'] += 1
            return True
        if dt == 0.0 or (math.isfinite(longest) and -longest <= dt < 0.0):
            self.rejected['out_of_order'] += 1
            self._stray = stray
        elif stray is None:
            self._stray = sample
        else:
            if stray.t >= sample.t:
                self.rejected['stamp'] += 1
            self._restart([stray] if stray.t < sample.t else [])
            return True
        return False

    def _begin(self, floor: FloatArray | float) -> list[StreamSample]:
        """Learn from the first samples, and judge them."""
        first, self._first = self._first or [], None
        self._period = float(np.median(np.diff([s.t for s in first])))
        self._quantile = self._quantile_of(self._period)
        missed = [self._missed(first[k : k + 2], first[k + 2]) for k in range(FIRST - 2)]
        self._see_steps(np.abs(np.diff([s.x for s in first], axis=0)))
        if not self._usual:
            errors = [m.error / m.growth for m in missed]
            self._scale = np.maximum(_usual_size(errors, _USUAL_FIRST), self._resolution)
        limit = self._limit(floor)
        straight = [bool(np.all(m.error <= m.growth * limit)) for m in missed]
        if not any(straight):  # or the noise is not what it was: it is learned anew
            self.rejected['erratic'] += len(first)
            self._usual.clear()
            self._restart([])
            return []
        start = straight.index(True)
        self._known = first[start], first[start + 1]
        self._leave_out(first[:start], missed[0].error / np.maximum(limit, _TINY))
        good = list(self._known)
        for sample in first[start + 2 :]:
            good += self._judge(sample, floor)
        return good

    def _judge(self, sample: StreamSample, floor: FloatArray | float) -> list[StreamSample]:
        """Return what is known to be good with another sample."""
        if self._first is not None:  # what came before it was erratic
            self._first.append(sample)
            return []
        missed = self._missed(self._known, sample)
        off = missed.error / np.maximum(self._limit(floor), _TINY)
        if not self._held:
            if float(np.max(off)) <= missed.growth:
                return self._accept([sample], missed)
            self._held, self._went_on, self._off = [sample], 0, off
            self._suspect = np.flatnonzero(off > missed.growth)
            return []
        goes_on = self._goes_on(sample, off, floor)
        if not goes_on and float(np.max(off[self._suspect])) <= missed.growth:
            self._leave_out(self._held, self._off)
            self._held = []
            return self._judge(sample, floor)
        self._held.append(sample)
        self._went_on += goes_on
        if len(self._held) <= self._max_gap:
            return []
        if 2 * self._went_on > self._max_gap:
            return self._accept(self._held)
        self.rejected['erratic'] += len(self._held)
        self._restart([])
        return []

    def _goes_on(self, sample: StreamSample, off: FloatArray, floor: FloatArray | float) -> bool:
        """Return whether a sample goes on from what is held, as well as from what was before."""
        last = self._held[-1]
        before = self._held[-2] if len(self._held) > 1 else self._known[1]
        first, second = self._known
        slope = (second.x - first.x) / (second.t - first.t)
        as_before = StreamSample(before.t, last.x - slope * (last.t - before.t))
        limit = np.maximum(self._limit(floor), _TINY)[self._suspect]
        far_enough = max(1.0, _NEARER * float(np.max(off[self._suspect])))
        for one in (as_before, before):
            rest = self._missed((one, last), sample)
            if float(np.max(rest.error[self._suspect] / limit)) < rest.growth * far_enough:
                return True
        return False

    def _missed(self, known: Sequence[StreamSample], sample: StreamSample) -> _Missed:
        """Return what a straight line through two samples misses another one by."""
        before, last = known
        step, ahead = last.t - before.t, sample.t - last.t
        ratio = ahead / step
        noise = math.sqrt((1.0 + (1.0 + ratio) ** 2 + ratio**2) / 6.0)
        curvature = 0.5 * ahead * (ahead + step) / self._period**2
        error = np.abs(sample.x - last.x - ratio * (last.x - before.x))
        return _Missed(error, max(noise, curvature))

    def _accept(
        self, samples: list[StreamSample], missed: _Missed | None = None
    ) -> list[StreamSample]:
        """Pass samples on, and learn from them."""
        self._held = []
        for sample in samples:
            one = missed or self._missed(self._known, sample)
            self._errors.append(one.error / one.growth)
            self._moves.append(sample.x - self._known[1].x)
            self._known = self._known[1], sample
        if len(self._errors) >= WINDOW:
            self._learn()
        return samples

    def _leave_out(self, samples: Sequence[StreamSample], off: FloatArray) -> None:
        if samples:
            self.rejected['spike'] += len(samples)
            self.spikes[int(np.argmax(off))] += len(samples)
            signals = [self._known[1].x, *(sample.x for sample in samples)]
            self._see_steps(np.abs(np.diff(signals, axis=0)))

    def _limit(self, floor: FloatArray | float) -> FloatArray:
        return np.maximum(self._quantile * self._scale, floor)

    def _learn(self) -> None:
        """Learn what is usual from a window of errors."""
        self._usual.append(_usual_size(self._errors, _USUAL))
        self._see_steps(np.abs(self._moves))
        self._errors, self._moves = [], []
        self._scale = np.maximum(np.max(self._usual, axis=0), self._resolution)

    def _see_steps(self, steps: FloatArray) -> None:
        """Learn the resolution from steps of shape (k, m)."""
        steps = np.concatenate([self._steps, np.where(steps > 0.0, steps, np.inf)])
        self._steps = np.partition(steps, _SEEN - 1, axis=0)[:_SEEN]

    @property
    def _resolution(self) -> FloatArray:
        """The smallest step of every signal, 0 where it is not known."""
        return np.where(np.isfinite(self._steps[-1]), self._steps[-1], 0.0)


def _loudest(errors: FloatArray) -> FloatArray:
    """Return the largest usual size of all windows of errors (N, m), shape (m,)."""
    windows = max(1, len(errors) // WINDOW)
    size, longer = divmod(len(errors), windows)
    signals, cut = errors.shape[1], longer * (size + 1)
    first = errors[:cut].reshape(longer, size + 1, signals)
    rest = errors[cut:].reshape(windows - longer, size, signals)
    usual = [_usual_size(part.swapaxes(0, 1), _USUAL) for part in (first, rest) if len(part)]
    return np.asarray(np.max(np.concatenate(usual), axis=0))


def _usual_size(missed: Sequence[FloatArray] | FloatArray, share: float) -> FloatArray:
    """Return the standard deviation of which a normal variable exceeds so few of the errors."""
    size = np.quantile(np.array(missed), share, axis=0)
    return np.asarray(size / _normal_quantile(share))


@cache
def _normal_quantile(share: float) -> float:
    """Return what so few normal variables exceed in size; scipy takes longer than the rest."""
    return float(stats.norm.ppf(0.5 + share / 2.0))
