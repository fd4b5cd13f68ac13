# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Watch for changes while learning: a load picked up, friction risen.

Rows are summed up in blocks of a quarter of a second. After each block windows of half a second to
two seconds that end with it are tested (``change_evidence``). When a test is positive, all begins
of the change are compared, and it is named as soon as nothing else explains the torques as well,
or when time is up. The estimator then returns to what it knew before, forgets what may have
changed, and only that, and learns from the rows since then again.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.online.change import Candidate, Change
from armid_ros.identification.online.change_evidence import Block, Evidence, evidence
from armid_ros.identification.online.loudness import Loudness
from armid_ros.identification.online.recursive import Learned, RecursiveLeastSquares
from armid_ros.identification.online.usual_size import UsualSize, Weighed
from armid_ros.motion import FloatArray
import numpy as np

#: Length of a block [s].
BLOCK = 0.25
#: Lengths of the windows that are tested, in blocks.
_LENGTHS = (2, 4, 8)
#: Blocks that are kept: the longest window, and one before it.
_KEPT = 9
#: Blocks since the change before which it is not named, and after which it is in any case.
_EARLIEST = 4
_LATEST = 6
#: Share of an assumed noise, of which only the ratios between joints are known, below which no
#: torque is measured: a hundredth of a hundredth of its range.
_LEAST_NOISE = 0.01
#: Logarithm of the likelihood ratio by which the best explanation is clear.
_CLEAR = 5.0
#: Of two begins of a change that differ by less the later one is taken: soon after a change any
#: begin before it will do, and all that can be told apart by then is not much.
_ALIKE = 4.0
#: Blocks whose residuals are remembered: a minute of four a second.
_REMEMBERED = 240
#: For so long after a change its size is still being learned [s]; what is less likely than this
#: share of it corrects the size.
_LEARNING = 10.0
_CORRECTION = 0.3


@dataclass(frozen=True)
class ChangeSettings:
    """
    How readily a change is believed.

    Attributes
    ----------
    false_alarm_time : float
        Mean time between two alarms of an arm that does not change [s].

    """

    false_alarm_time: float = 100.0 * 3600.0

    def __post_init__(self) -> None:
        """Refuse times that are none."""
        if not self.false_alarm_time > 0.0:
            raise IdentificationError(
                f'time between false alarms {self.false_alarm_time} s: has to be above 0'
            )


class ChangeWatch:
    """
    Lets an estimator learn, and tells when what it learns has changed.

    Parameters
    ----------
    estimator : RecursiveLeastSquares
        Learns.
    beside : sequence of ParameterName
        What the rows hold behind its parameters, which is learned for the tests alone.
    candidates : sequence of Candidate
        What may change.
    settings : ChangeSettings, optional
        How readily a change is believed.

    Attributes
    ----------
    changes : list of Change
        What has changed since the last reset.

    """

    def __init__(
        self,
        estimator: RecursiveLeastSquares,
        beside: tuple[ParameterName, ...],
        candidates: Sequence[Candidate],
        settings: ChangeSettings | None = None,
    ) -> None:
        settings = settings or ChangeSettings()
        self._estimator = estimator
        self._wider = estimator.with_more(beside)
        self._asked = len(estimator.parameters)
        self._candidates = tuple(candidates)
        sizes = [len(c.parameters) for c in self._candidates]
        ends = np.cumsum(sizes)
        self._slices = [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]
        self._sizes = np.array(sizes, dtype=float)
        self._directions = self._among_all(np.hstack([c.directions for c in self._candidates]))
        tests = len(sizes) * len(_LENGTHS)
        self._chance = BLOCK / settings.false_alarm_time / tests
        self.reset()

    def reset(self) -> None:
        """Forget what noise usually does, and all changes."""
        self.changes: list[Change] = []
        self._wider.reset()
        self._loudness = Loudness(_LEAST_NOISE if self._estimator.noise_is_relative else 1.0)
        sizes, places = self._sizes.astype(int).tolist(), {c.joint for c in self._candidates}
        self._left: deque[float] = deque(maxlen=_REMEMBERED)
        self._usual = {m: UsualSize(sizes, m, len(places)) for m in _LENGTHS}
        self._fresh = -np.inf, 0.0
        self.interrupt()

    def interrupt(self) -> None:
        """Begin a new stretch of rows, which does not continue the one before."""
        self._blocks: deque[Block] = deque(maxlen=_KEPT)
        self._waiting: deque[dict[int, Weighed]] = deque()
        self._samples: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        self._before: tuple[Learned, Learned] | None = None
        self._begin = 0.0

    def update(
        self, t: float, rows: FloatArray, tau: FloatArray, weights: FloatArray
    ) -> FloatArray:
        """
        Let the estimator take in one sample; see ``RecursiveLeastSquares.update``.

        Parameters
        ----------
        t : float
            Time of the sample [s].
        rows : ndarray, shape (m, P + K)
            Sensitivities to its parameters and to those beside them.
        tau, weights : ndarray, shapes (m,), (m,)
            As for the estimator.

        """
        if self._before is not None and t - self._begin >= BLOCK:
            self._end_block(t)
        if self._before is None:
            self._before, self._begin = (self._wider.learned(), self._estimator.learned()), t
        self._samples.append((rows, tau, weights))
        return self._learn(rows, tau, weights)

    def _learn(self, rows: FloatArray, tau: FloatArray, weights: FloatArray) -> FloatArray:
        self._wider.update(rows, tau, weights)
        return self._estimator.update(rows[:, : self._asked], tau, weights)

    def _among_all(self, directions: FloatArray) -> FloatArray:
        """Return directions in the parameters of the estimator in those of the wider one."""
        more = len(self._wider.parameters) - self._asked
        return np.vstack([directions, np.zeros((more, directions.shape[1]))])

    def _end_block(self, t: float) -> None:
        assert self._before is not None
        rows, tau, weights = (np.stack(part) for part in zip(*self._samples, strict=True))
        w, y = self._scaled(rows, weights), self._scaled(tau, weights)
        loudness = self._loudness.value
        residual = y - w @ self._before[0].values
        self._loudness.learn(residual, weights)
        if weights.any():
            self._left.append(float(np.sum((residual / loudness) ** 2) / np.sum(weights)))
        sums = _normal(w / loudness[:, np.newaxis], y / loudness)
        block = Block(self._begin, t, *sums, *self._before, tuple(self._samples))
        self._blocks.append(block)
        self._samples, self._before = [], None
        weighed = {m: self._weigh(m) for m in _LENGTHS if m <= len(self._blocks)}
        if any(np.any(self._usual[m].excess(r, self._chance) > 1.0) for m, r in weighed.items()):
            self._judge()
        if self._blocks:
            self._waiting.append(weighed)
            if len(self._waiting) > _LENGTHS[-1]:  # by now a change in it would have been named
                for m, values in self._waiting.popleft().items():
                    self._usual[m].learn(values)

    def _window(self, first: int, before: int | None = None) -> Evidence:
        """Weigh the blocks from one on against what was known before it, or another one."""
        blocks = list(self._blocks)
        known = blocks[first if before is None else before].before
        usual = float(np.exp(np.mean(np.log(self._loudness.value))))
        return evidence(blocks[first:], known, self._directions, usual)

    def _weigh(self, length: int) -> Weighed:
        """Return how large the statistics of a window of blocks are, and what it can show."""
        window = self._window(len(self._blocks) - length)
        return Weighed(self._ratios(window), window.strength)

    def _ratios(self, window: Evidence) -> FloatArray:
        return np.array([window.ratio(some) for some in self._slices])

    def _judge(self) -> None:
        """Find when the change was and what it is; name it if that is clear or time is up."""
        count = len(self._blocks)
        starts = range(count - 1)
        likelihood = np.array([self._likelihood(self._ratios(self._window(k))) for k in starts])
        at = likelihood.max(axis=0)
        best = int(np.argmax(at))
        first = int(np.flatnonzero(likelihood[:, best] > at[best] - _ALIKE)[-1])
        seen = count - first
        near = np.flatnonzero(at > max(at[best] - _CLEAR, 0.0))
        if at[best] > self._least_likelihood() and seen >= _EARLIEST:
            alike = [self._candidates[k] for k in near]
            named = self._most_common(self._candidates[best], alike)
            rivals = [c for c in alike if not (c.includes(named) or named.includes(c))]
            if not rivals or seen >= _LATEST:
                self._name(first, named, rivals, float(at[best]))

    def _least_likelihood(self) -> float:
        """Return what counts as a change: soon after one, no mere correction of its size."""
        t, likelihood = self._fresh
        soon = self._blocks[-1].end - t < _LEARNING
        return max(_CLEAR, _CORRECTION * likelihood) if soon else _CLEAR

    @staticmethod
    def _most_common(best: Candidate, alike: Sequence[Candidate]) -> Candidate:
        """Return the load where it explains the torques as well: arms pick things up all day."""
        return next((c for c in alike if c.common), best)

    def _likelihood(self, ratios: FloatArray) -> FloatArray:
        """Return logarithms of likelihoods, each free parameter being charged for."""
        factors = np.concatenate([u.factors for u in self._usual.values()])
        usual = float(np.nanmedian(factors))
        observations = sum(len(block.samples) for block in self._blocks)
        return np.asarray(ratios / (2.0 * usual) - 0.5 * self._sizes * np.log(observations))

    def _name(
        self, first: int, best: Candidate, rivals: list[Candidate], likelihood: float
    ) -> None:
        """Report a change in a block, and learn anew what it concerns."""
        blocks = list(self._blocks)
        before = max(first - 1, 0)
        after = min(first + 1, len(blocks) - 1)
        some = self._slices[self._candidates.index(best)]
        values, covariance = self._window(after, before).size(some)
        usual = np.nanmax([u.factors[self._candidates.index(best)] for u in self._usual.values()])
        size = Estimate(best.parameters, values, covariance * usual)
        change = Change(best, tuple(rivals), blocks[first].begin, blocks[-1].end, size)
        self._learn_again(blocks[before], blocks[after:], change.reopened)
        louder = self._louder(blocks[after:], change.reopened.shape[1])
        self.changes.append(
            replace(change, size=replace(size, covariance=louder * size.covariance))
        )
        self._fresh = change.detected, likelihood
        self.interrupt()

    def _learn_again(self, last: Block, since: Sequence[Block], reopened: FloatArray) -> None:
        """Return to what was known when a block began, and learn what may have changed anew."""
        self._wider.restore(last.before)
        self._wider.reopen(self._among_all(reopened))
        self._estimator.restore(last.asked)
        self._estimator.reopen(reopened)
        for block in since:
            for sample in block.samples:
                self._learn(*sample)

    def _louder(self, blocks: Sequence[Block], free: int) -> float:
        """
        Return how much larger squares of residuals are than usual, 1 at least.

        A change shakes the arm, and its motion is none that the parameters were learned from.

        """
        squares = count = 0.0
        for block in blocks:
            rows, tau, weights = (np.stack(part) for part in zip(*block.samples, strict=True))
            residual = self._scaled(tau - rows @ self._wider.values, weights)
            squares += float(np.sum((residual / self._loudness.value) ** 2))
            count += float(np.sum(weights))
        if not self._left or count <= free:
            return 1.0
        return max(1.0, squares / (count - free) / float(np.median(self._left)))

    def _scaled(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Return torques (k, m) or rows (k, m, P) in units of the assumed noise."""
        scale = np.array([self._estimator.scale(w) for w in weights])
        return np.asarray(values * scale.reshape(*scale.shape, *[1] * (values.ndim - scale.ndim)))


def _normal(rows: FloatArray, tau: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the normal equations of rows of shape (k, m, P)."""
    w = rows.reshape(-1, rows.shape[2])
    return w.T @ w, w.T @ tau.reshape(-1)
