# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Detection of damaged samples in a stream of joint states.

One damaged sample of a torque or an encoder can bias an estimate more than thousands of good
samples correct. Each sample is predicted by the straight line through the two samples before it;
for a smooth signal, the prediction includes the curvature. A sample too far from the prediction is
held until the next samples arrive. If the next samples return to the line and do not continue from
the held sample, the held sample is damaged and left out. Otherwise the motion has changed, and all
samples are used. A real change is therefore never lost, however large it is.

Positions are continuous. A position that steps and continues from the new value means that a clock
was set or an encoder zeroed, and a new stretch begins (``StreamSample.begins``). A torque may jump
and return, for example when free play is crossed. The usual range of the torque distinguishes such
pulses from damage. A stream leaves them out unreported, as the range is known too late; a
recording keeps them.

The largest allowed error is the largest of three. The first is the typical prediction error in the
noisiest window of the last minute, times the normal quantile for one false alarm in
`FALSE_ALARM_TIME`. The second is the resolution, the smallest step of a signal, times the same
quantile. The third is the negligible error (``floor``): the error of one sample that changes an
estimate as much as noise does. Across a gap, errors are larger: errors by an acceleration grow
with the square of time, errors by noise hardly. Successive errors show which of the two dominates:
their correlation is -2/3 for white noise and 1 for an acceleration.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
import math

from armid_ros.identification.samples.straight_line import (
    all_unwrapped,
    ErrorModel,
    Excursion,
    Innovation,
    innovation_of,
    MAX_GAP,
    NoiseLevel,
    StreamSample,
    unwrapped,
    WINDOW,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Number of samples from which noise and period are measured before the first check.
N_FIRST = 20


class SpikeGate:
    """
    Filter that leaves damaged samples out of a stream of joint states.

    Parameters
    ----------
    prismatic : array_like of bool, shape (n,)
        Whether each joint is prismatic; the angles of the others may jump by full turns.
    signals : str
        Signals of a sample, each for all joints, as in 'qt': q for positions, which never step; v
        for velocities; t for torques, which may jump and return. A sample has m signals.
    torque_limit : array_like, shape (n,), optional
        Largest torque of each joint [N m or N], infinite where unknown.

    Attributes
    ----------
    spikes : Counter of int
        Number of samples left out as damaged, by the signal with the largest error.
    rejected : Counter of str
        Number of samples left out, by reason: spike; pulse, possibly a real pulse; stamp, a wrong
        time stamp; erratic, without continuity to earlier or later samples; out_of_order.
    left_out : list of Excursion
        Samples that the last call to `take` left out as spike, pulse or erratic.
    lowest, highest : ndarray, shape (m,)
        Range of the good samples, except the first two of each stretch.

    """

    def __init__(
        self,
        prismatic: npt.ArrayLike,
        signals: str,
        *,
        torque_limit: npt.ArrayLike = 0.0,
    ) -> None:
        turning = ~np.asarray(prismatic, dtype=bool)
        kind = np.repeat(list(signals), len(turning))
        self._continuous, self._pulsing = kind == 'q', kind == 't'
        revolute = np.tile(turning, len(signals))
        self._turn = np.where(self._continuous & revolute, 2.0 * np.pi, 0.0)
        limit = np.broadcast_to(np.asarray(torque_limit, dtype=float), turning.shape)
        finite = limit[np.isfinite(limit)]
        limit = np.where(np.isfinite(limit), limit, finite.min() if len(finite) else 0.0)
        scale = np.where(self._pulsing, np.tile(limit, len(signals)), 1.0)
        # Best resolution of a position [rad or m], of a velocity (per second), and of a torque as
        # a share of its limit: an encoder of 22 bits, a torque sensor of 17 bits. A simulation
        # without noise and an arm at rest have less noise. Limits from that noise would reject
        # valid data.
        finest = {'q': 1e-6, 'v': 1e-5, 't': 1e-5}
        # A position that never changed may have an encoder of 12 bits. Limits from a better one
        # would reject the first steps of a motion.
        coarsest = np.tile(np.where(turning, 1.5e-3, 1e-4), len(signals))
        self._coarsest = np.where(self._continuous, coarsest, 0.0)
        # second derivative of each signal when an arm at rest begins to move, in these units per
        # second squared: 2 rad/s^2, a jerk of 50 rad/s^3, and a torque at its limit at 1 Hz
        onset = {'q': 2.0, 'v': 50.0, 't': 50.0}
        self._finest = scale * np.array([finest[one] for one in kind])
        self._onset = scale * np.array([onset[one] for one in kind])
        self.reset()

    def reset(self) -> None:
        """Clear samples, counters and noise levels."""
        self.spikes: Counter[int] = Counter()
        self.rejected: Counter[str] = Counter()
        self.left_out: list[Excursion] = []
        self._floor: FloatArray | float = 0.0
        self._delayed: StreamSample | None = None
        self._last: FloatArray | None = None  # last good sample, also of an earlier stretch
        count = len(self._turn)
        self.lowest, self.highest = np.full(count, np.inf), np.full(count, -np.inf)
        self._level = NoiseLevel(self._finest, self._coarsest, self._onset)
        self._restart([])

    def take(self, t: float, x: FloatArray, floor: FloatArray | float = 0.0) -> list[StreamSample]:
        """
        Add a sample; return the samples that are now known to be undamaged, oldest first.

        Parameters
        ----------
        t : float
            Time stamp [s].
        x : ndarray, shape (m,)
            Measured signals, finite numbers.
        floor : ndarray, shape (m,), or float
            Negligible error of each signal.

        """
        self.left_out, self._floor = [], floor
        delayed, self._delayed, tail = self._delayed, None, self._tail
        good: list[StreamSample] = []
        if delayed is not None and tail is not None:
            if tail.t < t < delayed.t:  # the sample that continues the earlier ones is kept
                self.rejected['out_of_order'] += 1
            else:
                good = self._take(delayed)
        ahead = 0.0 if self._tail is None else t - self._tail.t
        if 1.5 * self._period < ahead <= MAX_GAP * self._period < math.inf:
            # samples seem to be lost before this one; the next one may prove its stamp wrong
            self._delayed = StreamSample(t, x)
            return good
        return good + self._take(StreamSample(t, x))

    def _take(self, sample: StreamSample) -> list[StreamSample]:
        """Unwrap and classify a sample with a confirmed time stamp; return undamaged samples."""
        if self._reference:
            self._last = self._reference[1].x
        if self._last is not None:
            x = unwrapped(sample.x, self._last, self._turn)
            sample = sample if x is sample.x else replace(sample, x=x)
        if not self._in_time(sample):
            return []
        if self._first is None:
            return self._classify(sample)
        self._first.append(sample)
        return self._begin() if len(self._first) == N_FIRST else []

    def settle(self) -> bool:
        """Update prediction errors early, from a nearly full window; return whether updated."""
        return self._level.settle(self._period, WINDOW - 4)

    def begin(
        self,
        model: ErrorModel,
        reference: Sequence[StreamSample] = (),
        curvature: FloatArray | float = 0.0,
    ) -> None:
        """
        Start within a recording whose typical prediction errors are already known.

        Parameters
        ----------
        model : ErrorModel
            Usual prediction errors of the recording.
        reference : sequence of StreamSample
            The two undamaged samples before; none at the begin of a stretch.
        curvature : ndarray, shape (m,)
            Prediction error of the last known sample, scaled to one period.

        """
        self._level.set(model)
        self._restart(None if reference else [], reference, curvature)
        if reference:
            self._period = model.period

    def possible(self, excursion: Excursion, lowest: FloatArray, highest: FloatArray) -> bool:
        """
        Return whether an excursion of signals can be a real torque pulse instead of damage.

        A position cannot jump and return. A torque can exceed its typical range, from `lowest` to
        `highest`, when free play is crossed, but by no more than the width of that range: an
        impact is of the order of the driving torque.

        """
        values = np.stack([sample.x for sample in excursion.samples])
        beyond = np.maximum(lowest - values, values - highest).max(axis=0)
        far = beyond > np.maximum(excursion.limit, highest - lowest)
        return not bool(np.any((excursion.ratio > 1.0) & (far | ~self._pulsing)))

    def _restart(
        self,
        first: list[StreamSample] | None,
        reference: Sequence[StreamSample] = (),
        curvature: FloatArray | float = 0.0,
    ) -> None:
        """Start a new section with given samples; keep the typical prediction errors."""
        self._first, self._reference = first, tuple(reference)
        self._curvature = curvature
        self._pending: list[StreamSample] = []
        self._n_continuing, self._suspects = 0, np.empty(0, dtype=np.intp)
        self._ratio = self._limit = np.zeros(len(self._turn))
        self._jumped: StreamSample | None = None
        self._delayed = None
        self._period = np.inf

    @property
    def _tail(self) -> StreamSample | None:
        """Return the newest sample that is not known to be damaged."""
        latest = self._pending or self._first or self._reference
        return latest[-1] if latest else None

    def _in_time(self, sample: StreamSample) -> bool:
        """Return whether a sample's stamp follows the stream, or confirms a clock jump."""
        tail, stray, self._jumped = self._tail, self._jumped, None
        dt = 0.0 if tail is None else sample.t - tail.t
        longest = MAX_GAP * self._period
        if tail is None or 0.0 < dt <= longest:
            if stray is not None:
                self.rejected['stamp'] += 1
            return True
        if dt == 0.0 or (math.isfinite(longest) and -longest <= dt < 0.0):  # noqa: RUF069 - equal stamps differ by zero
            self.rejected['out_of_order'] += 1
            self._jumped = stray
        elif stray is None:
            self._jumped = sample
        else:
            if stray.t >= sample.t:
                self.rejected['stamp'] += 1
            self._restart([stray] if stray.t < sample.t else [])
            return True
        return False

    def _begin(self) -> list[StreamSample]:
        """Measure noise and period from the first samples; return the undamaged samples."""
        raw, self._first = self._first or [], None
        first = all_unwrapped(raw, self._turn)
        self._period = float(np.median(np.diff([s.t for s in first])))
        innovations = self._lines_through(first)
        self._level.begin(innovations, np.diff([s.x for s in first], axis=0), self._period)
        straight = [bool(np.all(self._ratio_to_limit(m) <= 1.0)) for m in innovations]
        if not any(straight):  # erratic, or the noise has changed: measure it again
            ratio = np.max([self._ratio_to_limit(m) for m in innovations], axis=0)
            self._leave_out(Excursion(tuple(first), ratio, self._limits(innovations[0])), True)
            self._level.forget()
            self._restart([])
            return []
        start = straight.index(True)
        first = first[:start] + all_unwrapped(raw[start:], self._turn)  # from undamaged samples
        self._reference = first[start], first[start + 1]
        self._leave_out_ahead(first[:start], innovations[0])
        good = list(self._reference)
        for sample in first[start + 2 :]:
            good += self._classify(sample)
        return good

    def _classify(self, sample: StreamSample) -> list[StreamSample]:
        """Compare a sample with its prediction; return the samples now known to be undamaged."""
        if self._first is not None:  # the earlier samples were erratic
            self._first.append(sample)
            return []
        innovation = innovation_of(self._reference, sample, self._period)
        # a smooth signal keeps its curvature
        curvature = self._level.model.correlation * self._curvature * innovation.acceleration
        error = innovation.error - curvature
        # Limits grow with `noise` and `acceleration`, and in proportion if both grow alike. They
        # are at least the limits over one period times the smaller factor: a fast test.
        growth = min(innovation.noise, innovation.acceleration)
        least = np.maximum(growth * self._level.model.limits_of_a_period, self._floor)
        if not self._pending and (np.abs(error) <= least).all():
            return self._accept([sample], innovation)
        ratio = self._ratio_to_limit(innovation._replace(error=error))
        if not self._pending:
            if float(np.max(ratio)) <= 1.0:
                return self._accept([sample], innovation)
            self._pending, self._n_continuing, self._ratio = [sample], 0, ratio
            self._limit = self._limits(innovation)
            self._suspects = np.flatnonzero(ratio > 1.0)
            return []
        continues = self._continues(sample, ratio)
        if not continues and float(np.max(ratio[self._suspects])) <= 1.0:
            self._leave_out(Excursion(tuple(self._pending), self._ratio, self._limit))
            self._pending = []
            return self._classify(sample)
        self._pending.append(sample)
        self._ratio = np.maximum(self._ratio, ratio)
        self._n_continuing += continues
        if len(self._pending) <= MAX_GAP:
            return []
        if 2 * self._n_continuing > MAX_GAP:
            if len(self._pending) > 1 and self._stepped():
                self._pending[0] = replace(self._pending[0], begins=True)
            return self._release()
        self._leave_out(Excursion(tuple(self._pending), self._ratio, self._limit), True)
        self._restart([])
        return []

    def _release(self) -> list[StreamSample]:
        """Check the held-back samples again; return the undamaged samples."""
        held, self._pending = self._pending, []
        innovations = self._lines_through(held)
        steady = ~self._pulsing
        straight = [bool(np.all(self._ratio_to_limit(one)[steady] <= 1.0)) for one in innovations]
        if all(straight) or not any(straight):
            return self._accept(held)
        start = straight.index(True)
        self._leave_out_ahead(held[:start], innovations[0])
        held[start] = replace(held[start], begins=held[0].begins)
        if all(straight[start:]):
            return self._accept(held[start:])
        good = self._accept(held[start : start + 2])
        for sample in held[start + 2 :]:
            good = good + self._classify(sample)
        return good

    def _continues(self, sample: StreamSample, ratio: FloatArray) -> bool:
        """Return whether a sample is on a line from held-back samples, with old or new slope."""
        last = self._pending[-1]
        before = self._pending[-2] if len(self._pending) > 1 else self._reference[1]
        first, second = self._reference
        slope = (second.x - first.x) / (second.t - first.t)
        as_before = StreamSample(before.t, last.x - slope * (last.t - before.t))
        # the error from the continued samples is at most half of that from the old line
        max_ratio = max(1.0, 0.5 * float(np.max(ratio[self._suspects])))
        for one in (as_before, before):
            rest = self._ratio_to_limit(innovation_of((one, last), sample, self._period))
            if float(np.max(rest[self._suspects])) < max_ratio:
                return True
        return False

    def _stepped(self) -> bool:
        """Return whether a position jumped between undamaged and held-back samples."""
        # The lines before and after a step do not intersect in between. The lines before and
        # after a collision do.
        ahead = innovation_of(self._reference, self._pending[0], self._period)
        back = innovation_of(
            (self._pending[1], self._pending[0]), self._reference[1], self._period
        )
        far = np.minimum(self._ratio_to_limit(ahead), self._ratio_to_limit(back))
        return bool(np.any(far[self._continuous & (ahead.error * back.error < 0.0)] > 1.0))

    def _limits(self, innovation: Innovation) -> FloatArray:
        """Return the largest allowed prediction error of each signal, shape (m,)."""
        limits = self._level.model.limits(innovation.noise, innovation.acceleration)
        return np.maximum(limits, self._floor)

    def _ratio_to_limit(self, innovation: Innovation) -> FloatArray:
        """Return each signal's prediction error over its largest allowed error, shape (m,)."""
        limit = np.maximum(self._limits(innovation), 1e-300)
        return np.asarray(np.abs(innovation.error) / limit)

    def _accept(
        self, samples: list[StreamSample], innovation: Innovation | None = None
    ) -> list[StreamSample]:
        """Update the typical prediction errors with undamaged samples; return the samples."""
        self._pending = []
        for sample in samples:
            one = innovation or innovation_of(self._reference, sample, self._period)
            self._level.learn(one, sample.x - self._reference[1].x)
            self._curvature = one.error / one.acceleration
            np.minimum(self.lowest, sample.x, out=self.lowest)
            np.maximum(self.highest, sample.x, out=self.highest)
            self._reference = self._reference[1], sample
        self._level.settle(self._period)
        return samples

    def _lines_through(self, samples: Sequence[StreamSample]) -> list[Innovation]:
        """Return each sample's prediction error from the line through the two previous samples."""
        pairs = range(len(samples) - 2)
        return [innovation_of(samples[k : k + 2], samples[k + 2], self._period) for k in pairs]

    def _leave_out_ahead(self, samples: Sequence[StreamSample], innovation: Innovation) -> None:
        """Leave out `samples`, which precede the first three samples on a straight line."""
        if samples:
            ratio, limit = self._ratio_to_limit(innovation), self._limits(innovation)
            self._leave_out(Excursion(tuple(samples), ratio, limit))

    def _leave_out(self, excursion: Excursion, erratic: bool = False) -> None:
        """Leave out the samples of an excursion, and count them by reason."""
        self.left_out.append(excursion)
        count = len(excursion.samples)
        if erratic:
            self.rejected['erratic'] += count
            return
        if self.possible(excursion, self.lowest, self.highest):
            self.rejected['pulse'] += count
        else:
            self.rejected['spike'] += count
            self.spikes[int(np.argmax(excursion.ratio))] += count
        values = np.stack([sample.x for sample in excursion.samples])
        before = self._reference[1].x[np.newaxis] if self._reference else values[:1]
        self._level.add_steps(np.diff(values, axis=0, prepend=before))
