# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Damaged samples in a stream of joint states, told from what the arm really does.

A torque or an encoder that is off in one sample bends an estimate by as much as thousands of good
samples mend. Every sample is predicted by the straight line through the two before it, which
bends on as it did where a signal is smooth. One that is too far from the prediction waits for
those after it. When they return to where the line leads and do not go on from it, it was damaged
and is left out; otherwise the arm has changed, and all are used. So damage costs the samples that
are damaged, and no change is lost, however large.

Positions are continuous. One that steps and goes on from there is of a clock that was set or of an
encoder that was zeroed, and what follows is a new stretch (``StreamSample.begins``). A torque may
jump and come back, as where free play is crossed; such pulses are told from damage by what the
torque reaches otherwise. In a stream they are left out and not called damage, as what the torque
reaches is known too late; in a recording they are kept.

Three things say how far is too far; the largest of them counts. The noise: what predictions
usually miss by, as much as in the loudest part of the last minute, since an arm at rest must not
forget what it is like in motion, times the quantile of a normal distribution at the chance of one
false alarm in `false_alarm_time`. The resolution, times the same: the smallest step that a signal
makes. The consequence (``floor``): what one sample has to be off by to move what is estimated from
it by as much as noise does. Across a gap the line misses by more: an acceleration takes the signal
off it with the square of time, noise hardly. Which of them a signal has is seen in its errors:
successive ones of white noise have the correlation -2/3, those of an acceleration 1.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
import math

from armid_ros.identification.samples.noise_level import line_errors, LineErrors, NoiseLevel
from armid_ros.identification.samples.straight_line import (
    all_unwrapped,
    Excursion,
    Missed,
    missed_by,
    StreamSample,
    unwrapped,
    Usual,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import stats

#: Samples from which noise and period are learned before the first one is judged.
FIRST = 20
#: A sample goes on from others that are nearer by this factor than where the line leads.
_NEARER = 0.5
#: Periods without a sample after which one waits for the next, which may contradict its stamp.
_LEAP = 1.5


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
    continuous : array_like of bool, shape (m,), optional
        Signals that never step, as positions; none by default.
    pulsing : array_like of bool, shape (m,), optional
        Signals that may jump and come back, as torques; none by default.
    finest : array_like, shape (m,), optional
        Resolution of the signals at best, in their units. A simulation without noise and an arm
        at rest have less noise than that, and a limit that follows it would leave out sound data.
    onset : array_like, shape (m,), optional
        Second derivative of the signals that is usual before any motion was seen, per second
        squared: an arm that was at rest so far begins to move.

    Attributes
    ----------
    spikes : Counter of int
        Samples left out as damaged, by the signal that was furthest off.
    rejected : Counter of str
        Samples left out, by reason: spike; pulse, which the arm may have made; stamp, which alone
        was off; erratic, which followed neither what was before nor other ones; out_of_order.
    left_out : list of Excursion
        What the last call to `take` left out as spike, pulse or erratic.
    lowest, highest : ndarray, shape (m,)
        From where to where the good samples range, but for the two that a stretch begins with.

    """

    def __init__(
        self,
        turning: npt.ArrayLike,
        *,
        max_gap: int = 10,
        false_alarm_time: float = 360000.0,
        continuous: npt.ArrayLike = False,
        pulsing: npt.ArrayLike = False,
        finest: npt.ArrayLike = 0.0,
        onset: npt.ArrayLike = 0.0,
    ) -> None:
        self._turn = np.where(np.asarray(turning, dtype=bool), 2.0 * np.pi, 0.0)
        self._continuous = np.broadcast_to(np.asarray(continuous, dtype=bool), self._turn.shape)
        self._pulsing = np.broadcast_to(np.asarray(pulsing, dtype=bool), self._turn.shape)
        self._least_seen = tuple(np.broadcast_to(one, self._turn.shape) for one in (finest, onset))
        self._max_gap = max_gap
        self._false_alarm_time = false_alarm_time
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.spikes: Counter[int] = Counter()
        self.rejected: Counter[str] = Counter()
        self.left_out: list[Excursion] = []
        self._early: StreamSample | None = None
        self._last: FloatArray | None = None  # of the good samples, across stretches
        count = len(self._turn)
        self.lowest, self.highest = np.full(count, np.inf), np.full(count, -np.inf)
        self._level = NoiseLevel(count, self._max_gap + 1, *self._least_seen)
        self._least: tuple[Usual, float, FloatArray] | None = None
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
        self.left_out = []
        early, self._early, tail = self._early, None, self._tail
        good: list[StreamSample] = []
        if early is not None and tail is not None:
            if tail.t < t < early.t:  # what goes on from before is kept, for there is more of it
                self.rejected['out_of_order'] += 1
            else:
                good = self._take(early, floor)
        ahead = 0.0 if self._tail is None else t - self._tail.t
        if _LEAP * self._period < ahead <= self._max_gap * self._period < math.inf:
            # something seems to be lost before it
            self._early = StreamSample(t, x)
            return good
        return good + self._take(StreamSample(t, x), floor)

    def _take(self, sample: StreamSample, floor: FloatArray | float) -> list[StreamSample]:
        """Judge a sample whose stamp the next one does not contradict."""
        if self._known:
            self._last = self._known[1].x
        if self._last is not None:
            x = unwrapped(sample.x, self._last, self._turn)
            sample = sample if x is sample.x else replace(sample, x=x)
        if not self._in_time(sample):
            return []
        if self._first is None:
            return self._judge(sample, floor)
        self._first.append(sample)
        return self._begin(floor) if len(self._first) == FIRST else []

    def begin(
        self, usual: Usual, known: Sequence[StreamSample] = (), bent: FloatArray | float = 0.0
    ) -> None:
        """
        Begin somewhere in a recording of which is known what is usual of the whole.

        Parameters
        ----------
        usual : Usual
            What is usual of its signals.
        known : sequence of StreamSample
            The two good samples before; none where a stretch begins.
        bent : ndarray, shape (m,)
            What the prediction of the last of them missed, over a period.

        """
        self._level.set(usual)
        self._restart(None if known else [], known, bent)
        if known:
            self._period, self._quantile = usual.period, self._quantile_of(usual.period)

    def line_errors(self, t: FloatArray, x: FloatArray, floor: FloatArray) -> LineErrors:
        """Return how far off the samples of a whole recording are, as `take` would predict."""
        return line_errors(t, x, floor, self._turn, self._max_gap, self._quantile_of)

    def possible(self, excursion: Excursion, lowest: FloatArray, highest: FloatArray) -> bool:
        """
        Return whether the arm itself may have caused an excursion of a signal.

        A position cannot jump and come back. A torque can, and where free play is crossed it goes
        beyond what it reaches otherwise, from `lowest` to `highest`, but by no more than that
        spans: an impact is of the order of what drives it.

        """
        values = np.stack([sample.x for sample in excursion.samples])
        beyond = np.maximum(lowest - values, values - highest).max(axis=0)
        far = beyond > np.maximum(excursion.limit, highest - lowest)
        return not bool(np.any((excursion.off > 1.0) & (far | ~self._pulsing)))

    def _quantile_of(self, period: float) -> float:
        """Return how many standard deviations noise exceeds at one false alarm in that time."""
        chance = period / self._false_alarm_time / len(self._turn)
        return float(stats.norm.isf(min(chance, 0.5) / 2.0))

    def _restart(
        self,
        first: list[StreamSample] | None,
        known: Sequence[StreamSample] = (),
        bent: FloatArray | float = 0.0,
    ) -> None:
        """Begin a new stretch with some samples; what is usual stays known."""
        self._first, self._known = first, tuple(known)
        self._bent = bent
        self._held: list[StreamSample] = []
        self._went_on, self._suspect = 0, np.empty(0, dtype=np.intp)
        self._off = self._limit = np.zeros(len(self._turn))
        self._stray: StreamSample | None = None
        self._early = None
        self._period = np.inf
        self._quantile = 0.0

    @property
    def _tail(self) -> StreamSample | None:
        """Return the newest sample that is not damaged for sure."""
        latest = self._held or self._first or self._known
        return latest[-1] if latest else None

    def _in_time(self, sample: StreamSample) -> bool:
        """Return whether a stamp continues the stream; two that do not begin a new one."""
        tail, stray, self._stray = self._tail, self._stray, None
        dt = 0.0 if tail is None else sample.t - tail.t
        longest = self._max_gap * self._period
        if tail is None or 0.0 < dt <= longest:
            if stray is not None:
                self.rejected['stamp'] += 1
            return True
        if dt == 0.0 or (math.isfinite(longest) and -longest <= dt < 0.0):  # noqa: RUF069 - equal stamps differ by zero
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
        raw, self._first = self._first or [], None
        first = all_unwrapped(raw, self._turn)
        self._period = float(np.median(np.diff([s.t for s in first])))
        self._quantile = self._quantile_of(self._period)
        missed = self._lines_through(first)
        self._level.begin(missed, np.diff([s.x for s in first], axis=0), self._period)
        straight = [bool(np.all(self._off_by(m, floor) <= 1.0)) for m in missed]
        if not any(straight):  # or the noise is not what it was: it is learned anew
            off = np.max([self._off_by(m, floor) for m in missed], axis=0)
            self._leave_out(Excursion(tuple(first), off, self._limits(missed[0], floor)), True)
            self._level.forget()
            self._restart([])
            return []
        start = straight.index(True)
        first = first[:start] + all_unwrapped(raw[start:], self._turn)  # not from what is damaged
        self._known = first[start], first[start + 1]
        self._leave_out_ahead(first[:start], missed[0], floor)
        good = list(self._known)
        for sample in first[start + 2 :]:
            good += self._judge(sample, floor)
        return good

    def _judge(self, sample: StreamSample, floor: FloatArray | float) -> list[StreamSample]:
        """Return what is known to be good with another sample."""
        if self._first is not None:  # what came before it was erratic
            self._first.append(sample)
            return []
        missed = missed_by(self._known, sample, self._period)
        # a smooth signal goes on bending as it does
        bent = self._level.usual.smoothness * self._bent * missed.bend
        judged = missed._replace(error=missed.error - bent)
        if not self._held and self._surely_in_line(judged, floor):
            return self._accept([sample], missed)
        off = self._off_by(judged, floor)
        if not self._held:
            if float(np.max(off)) <= 1.0:
                return self._accept([sample], missed)
            self._held, self._went_on, self._off = [sample], 0, off
            self._limit = self._limits(missed, floor)
            self._suspect = np.flatnonzero(off > 1.0)
            return []
        goes_on = self._goes_on(sample, off, floor)
        if not goes_on and float(np.max(off[self._suspect])) <= 1.0:
            self._leave_out(Excursion(tuple(self._held), self._off, self._limit))
            self._held = []
            return self._judge(sample, floor)
        self._held.append(sample)
        self._off = np.maximum(self._off, off)
        self._went_on += goes_on
        if len(self._held) <= self._max_gap:
            return []
        if 2 * self._went_on > self._max_gap:
            if len(self._held) > 1 and self._stepped(floor):
                self._held[0] = replace(self._held[0], begins=True)
            return self._go_on(floor)
        self._leave_out(Excursion(tuple(self._held), self._off, self._limit), True)
        self._restart([])
        return []

    def _go_on(self, floor: FloatArray | float) -> list[StreamSample]:
        """Pass on the held samples, as they are real; damaged ones among them are judged again."""
        held, self._held = self._held, []
        missed = self._lines_through(held)
        steady = ~self._pulsing
        straight = [bool(np.all(self._off_by(one, floor)[steady] <= 1.0)) for one in missed]
        if all(straight) or not any(straight):
            return self._accept(held)
        start = straight.index(True)
        self._leave_out_ahead(held[:start], missed[0], floor)
        held[start] = replace(held[start], begins=held[0].begins)
        if all(straight[start:]):
            return self._accept(held[start:])
        good = self._accept(held[start : start + 2])
        for sample in held[start + 2 :]:
            good = good + self._judge(sample, floor)
        return good

    def _goes_on(self, sample: StreamSample, off: FloatArray, floor: FloatArray | float) -> bool:
        """Return whether a sample goes on from what is held, as well as from what was before."""
        last = self._held[-1]
        before = self._held[-2] if len(self._held) > 1 else self._known[1]
        first, second = self._known
        slope = (second.x - first.x) / (second.t - first.t)
        as_before = StreamSample(before.t, last.x - slope * (last.t - before.t))
        far_enough = max(1.0, _NEARER * float(np.max(off[self._suspect])))
        for one in (as_before, before):
            rest = self._off_by(missed_by((one, last), sample, self._period), floor)
            if float(np.max(rest[self._suspect])) < far_enough:
                return True
        return False

    def _stepped(self, floor: FloatArray | float) -> bool:
        """Return whether a signal that never steps has stepped between what is known and held."""
        # The lines before and behind a step do not meet in between; those of a turn, as in a
        # collision, do.
        ahead = missed_by(self._known, self._held[0], self._period)
        back = missed_by((self._held[1], self._held[0]), self._known[1], self._period)
        far = np.minimum(self._off_by(ahead, floor), self._off_by(back, floor))
        return bool(np.any(far[self._continuous & (ahead.error * back.error < 0.0)] > 1.0))

    def _limits(self, missed: Missed, floor: FloatArray | float) -> FloatArray:
        """Return what a sample may be off its prediction by, shape (m,)."""
        limits = self._level.usual.limits(self._quantile, missed.noise, missed.bend)
        return np.maximum(limits, floor)

    def _off_by(self, missed: Missed, floor: FloatArray | float) -> FloatArray:
        """Return how far off its prediction a sample is, over the limit, shape (m,)."""
        limit = np.maximum(self._limits(missed, floor), 1e-300)
        return np.asarray(np.abs(missed.error) / limit)

    def _surely_in_line(self, missed: Missed, floor: FloatArray | float) -> bool:
        """Return whether a sample is within less than its limits, in a third of the time."""
        # Limits grow with both times over which the prediction is made, and as fast as they do
        # where both grow alike; so they are at least those over a period times the smaller of the
        # two.
        least, usual = self._least, self._level.usual
        if least is None or least[0] is not usual or least[1] != self._quantile:
            over_a_period = usual.limits(self._quantile, 1.0, 1.0)
            self._least = least = usual, self._quantile, over_a_period
        limits = np.maximum(min(missed.noise, missed.bend) * least[2], floor)
        return bool((np.abs(missed.error) <= limits).all())

    def _accept(
        self, samples: list[StreamSample], missed: Missed | None = None
    ) -> list[StreamSample]:
        """Pass samples on, and learn from them."""
        self._held = []
        for sample in samples:
            one = missed or missed_by(self._known, sample, self._period)
            self._level.learn(one, sample.x - self._known[1].x)
            self._bent = one.error / one.bend
            np.minimum(self.lowest, sample.x, out=self.lowest)
            np.maximum(self.highest, sample.x, out=self.highest)
            self._known = self._known[1], sample
        self._level.settle(self._period)
        return samples

    def _lines_through(self, samples: Sequence[StreamSample]) -> list[Missed]:
        """Return the errors of each sample against the line through the two before."""
        pairs = range(len(samples) - 2)
        return [missed_by(samples[k : k + 2], samples[k + 2], self._period) for k in pairs]

    def _leave_out_ahead(
        self, samples: Sequence[StreamSample], missed: Missed, floor: FloatArray | float
    ) -> None:
        """Count samples, if any, ahead of the first ones that are in line."""
        if samples:
            off, limit = self._off_by(missed, floor), self._limits(missed, floor)
            self._leave_out(Excursion(tuple(samples), off, limit))

    def _leave_out(self, excursion: Excursion, erratic: bool = False) -> None:
        """Count what is left out, by its reason."""
        self.left_out.append(excursion)
        count = len(excursion.samples)
        if erratic:
            self.rejected['erratic'] += count
            return
        if self.possible(excursion, self.lowest, self.highest):
            self.rejected['pulse'] += count
        else:
            self.rejected['spike'] += count
            self.spikes[int(np.argmax(excursion.off))] += count
        values = np.stack([sample.x for sample in excursion.samples])
        before = self._known[1].x[np.newaxis] if self._known else values[:1]
        self._level.see_steps(np.diff(values, axis=0, prepend=before))
