# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Detection of changes during online estimation, such as a load or more friction.

Samples are summed in blocks of a quarter of a second, which are searched (``change_search``).
When a change is named, an estimator with nuisance parameters returns to its state before the
change. It forgets the information on the directions that may have changed, and processes the
later samples again. The estimator of the arm then copies this state, without nuisance parameters.

Only the update of the estimator runs at once. A change is therefore named some samples after the
block that made it significant. Until the later samples are processed again, the estimator
continues as without a change.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeVar

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE
from armid_ros.identification.online.background import at_once, Background, Job, Pieces
from armid_ros.identification.online.change import Change, ChangeCandidate
from armid_ros.identification.online.change_search import Block, ChangeSearch, FoundChange
from armid_ros.identification.online.null_calibration import MAX_BLOCKS, ResidualScale
from armid_ros.identification.online.recursive import RecursiveLeastSquares, WeightedSample
from armid_ros.identification.rows.causal import CausalMotion, TripleLag
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Length of a block [s].
BLOCK_LENGTH = 0.25
#: Samples in one piece of work; fewer arrive in the meantime, so that the queue shrinks.
_SAMPLES_PER_PIECE = 8
#: Arrays of a `Motion`.
_OF_MOTION = 't', 'q', 'dq', 'ddq'
Item = TypeVar('Item')


class Row(NamedTuple):
    """
    Filtered sample for the estimator, with the filtered motion for friction columns.

    Attributes
    ----------
    t : float
        Time of the sample [s].
    sample : WeightedSample
        Rows, torques and weights for the estimator.
    motion : CausalMotion
        Output of the motion filter.
    step : float
        Time since the previous sample [s].
    gain : float
        Divisor of the regressor rows: gain of the filters for white noise [-].
    begins : bool
        Whether the sample is the first after an interruption.

    """

    t: float
    sample: WeightedSample
    motion: CausalMotion
    step: float
    gain: float
    begins: bool = False


class NuisanceRows:
    """
    Regressor columns for friction that the model lacks, fitted as nuisance parameters.

    Such friction biases the identified parameters, and the bias varies with the motion. A search
    for changes would attribute this variation to a change. The friction law itself does not vary,
    so it is estimated as well: viscous and Coulomb friction, if the model lacks them, and friction
    in proportion to the load. Bell-shaped functions at low velocities add up to a curve.

    Parameters
    ----------
    arm : ArmModel
        The arm, whose own effects are left out.
    cutoff : float
        Cut-off frequency of the row filter [Hz].

    Attributes
    ----------
    parameters : tuple of ParameterName
        Nuisance parameters, by quantity and then by joint.

    """

    def __init__(self, arm: ArmModel, cutoff: float) -> None:
        known = {effect.name for effect in arm.effects}
        self._arm = arm
        self._filter = TripleLag(cutoff)
        self._effects = [
            kind.on(arm.robot).with_shape(shape) if shape else kind.on(arm.robot)
            for kind in CATALOGUE.values()
            for shape in kind.traits.nuisance
            if kind.name not in known
        ]
        self.parameters = tuple(
            replace(name, name=f'{name.name}_beside_{number}')
            for number, effect in enumerate(self._effects)
            for name in effect.parameters(arm.robot)
        )

    def columns(self, rows: Sequence[Row]) -> Pieces[FloatArray]:
        """Compute friction columns of N samples, (N, n, K n), in short pieces of work."""
        motion = Motion(
            self._arm.robot.joints,
            *(np.array([getattr(row.motion, name) for row in rows]) for name in _OF_MOTION),
        )
        # friction per unit of each quantity; every quantity acts on its own joint only
        torques = np.empty((len(rows), motion.n_joints, len(self._effects)))
        for k, effect in enumerate(self._effects):
            if k % 2 == 0:  # two effects in one piece of work
                yield
            torques[:, :, k] = np.diagonal(effect.columns(motion, self._arm), axis1=1, axis2=2)
        columns = np.zeros((*torques.shape, motion.n_joints))
        own = np.einsum('sjkj->sjk', columns)
        for k, (row, raw, place) in enumerate(zip(rows, torques, own, strict=True)):
            if k % _SAMPLES_PER_PIECE == 0:
                yield
            if row.begins:
                self._filter.reset()
            smooth = self._filter.update(row.step, raw.reshape(-1))[2]
            np.divide(smooth.reshape(raw.shape), row.gain, out=place)
        return columns.reshape(len(rows), motion.n_joints, -1)


@dataclass(eq=False)
class _RawBlock:
    """Samples of a block before the search for changes; `end` is None before an interruption."""

    begin: float
    end: float | None = None
    rows: list[Row] = field(default_factory=list)


class ChangeWatch:
    """
    Recursive estimator that also detects changes of the parameters.

    Parameters
    ----------
    estimator : RecursiveLeastSquares
        Estimator of the parameters of the arm.
    nuisance : NuisanceRows
        Source of the friction columns, which only the search for changes uses.
    candidates : sequence of ChangeCandidate
        Candidate changes to search for.
    false_alarm_time : float or None
        Mean time between two alarms of an arm that does not change [s]; None disables the
        detection.
    work : Background
        Queue for long computations.

    Attributes
    ----------
    changes : list of Change
        Detected changes.

    """

    def __init__(
        self,
        estimator: RecursiveLeastSquares,
        nuisance: NuisanceRows,
        candidates: Sequence[ChangeCandidate],
        false_alarm_time: float | None,
        work: Background,
    ) -> None:
        self._estimator = estimator
        self._nuisance = nuisance
        self._wider = estimator.with_more(nuisance.parameters)
        self._count = len(estimator.parameters)
        self._work = work
        self._search = ChangeSearch(
            candidates,
            self._with_nuisance(np.hstack([c.directions for c in candidates])),
            _chance_of_block(false_alarm_time),
            self._work,
        )
        self.changes: list[Change] = []
        # smallest residual scale where only the ratios of the noise between joints are known: 0.01
        # of the assumed noise, which is 1e-4 of the torque limit [-]
        self._residual_scale = ResidualScale(0.01 if self._estimator.noise_is_relative else 1.0)
        self._fit_ratios: deque[float] = deque(maxlen=MAX_BLOCKS)
        self._open: _RawBlock | None = None
        self._queued: deque[_RawBlock] = deque()
        self._searching = False

    def use(self, false_alarm_time: float | None, forgetting: float) -> None:
        """
        Set mean time between false alarms and forgetting factor; the estimate is kept.

        Parameters
        ----------
        false_alarm_time : float or None
            Mean time between two false alarms [s]; None disables the detection.
        forgetting : float
            Forgetting factor of the estimator.

        """
        self._search.set_chance(_chance_of_block(false_alarm_time))
        self._wider.forgetting = forgetting

    def interrupt(self) -> None:
        """Begin a new block after an interruption of the stream."""
        self._open = self._open or _RawBlock(0.0)
        self._queue(None)

    def update(self, row: Row) -> None:
        """Update the estimator with a sample, and queue the sample for the change search."""
        if self._open is not None and row.t - self._open.begin >= BLOCK_LENGTH:
            self._queue(row.t)
        if self._open is None:
            self._open = _RawBlock(row.t)
        self._open.rows.append(row)
        self._estimator.update(*row.sample)

    def _with_nuisance(self, directions: FloatArray) -> FloatArray:
        """Return directions in parameter space, with zeros appended for nuisance parameters."""
        more = len(self._wider.parameters) - self._count
        return np.vstack([directions, np.zeros((more, directions.shape[1]))])

    def _queue(self, end: float | None) -> None:
        """Queue the present block for the change search; start the search if it is idle."""
        assert self._open is not None
        self._open.end = end
        self._queued.append(self._open)
        self._open = None
        if not self._searching:
            self._searching = True
            self._work.begin(self._search_queue(), urgent=True)

    def _search_queue(self) -> Job:
        try:
            while self._queued:
                stretch = self._queued.popleft()
                samples = yield from self._widened(stretch.rows)
                before = self._wider.copied()
                yield
                yield from self._learn(self._wider, samples)
                if stretch.end is None:
                    self._search.interrupt()
                    continue
                block = yield from self._block(stretch, stretch.end, samples, before)
                mean = float(np.exp(np.mean(np.log(self._residual_scale.value))))
                found = yield from self._search.take(block, mean)
                if found is not None:
                    yield from self._apply(found)
        finally:
            self._searching = False

    def _unsearched(self) -> list[Row]:
        """Remove and return all samples that have not been searched for changes."""
        stretches = (*self._queued, *([self._open] if self._open else ()))
        self._queued.clear()
        self._open = None
        return [row for part in stretches for row in part.rows]

    def _learn(self, estimator: RecursiveLeastSquares, samples: Sequence[WeightedSample]) -> Job:
        """Update an estimator with several samples, in short pieces of work."""
        for part in _parts(samples, self._samples_per_update):
            estimator.update_together(part)
            yield

    @property
    def _samples_per_update(self) -> int:
        # with forgetting, samples are learned one by one; otherwise, this is the longest piece
        return 4 if self._estimator.forgetting < 1.0 else 6

    def _widened(self, rows: Sequence[Row]) -> Pieces[list[WeightedSample]]:
        """Return samples whose regressor rows include the columns of nuisance parameters."""
        samples: list[WeightedSample] = []
        if not rows:
            return samples
        columns = yield from self._nuisance.columns(rows)
        for first in range(0, len(rows), _SAMPLES_PER_PIECE):
            yield
            part, more = (x[first : first + _SAMPLES_PER_PIECE] for x in (rows, columns))
            wide = np.concatenate([np.stack([row.sample.rows for row in part]), more], axis=2)
            samples += [
                row.sample._replace(rows=both) for row, both in zip(part, wide, strict=True)
            ]
        return samples

    def _block(
        self,
        stretch: _RawBlock,
        end: float,
        samples: Sequence[WeightedSample],
        before: RecursiveLeastSquares,
    ) -> Pieces[Block]:
        """Compute the normal equations of a block of samples; update the residual scale."""
        residual_scale, residuals, squares = self._residual_scale.value, [], 0.0
        size = len(self._wider.parameters)
        information, right = np.zeros((size, size)), np.zeros(size)
        for part in _parts(samples, _SAMPLES_PER_PIECE):
            rows, tau, weights = (np.stack(some) for some in zip(*part, strict=True))
            scale = self._estimator.scale(weights)
            residuals.append(scale * (tau - rows @ before.values))
            squares += float(np.sum((residuals[-1] / residual_scale) ** 2))
            w = (rows * (scale / residual_scale)[:, :, np.newaxis]).reshape(-1, size)
            information += w.T @ w
            right += w.T @ (tau * scale / residual_scale).reshape(-1)
            yield
        weights = np.stack([sample.weights for sample in samples])
        self._residual_scale.learn(np.concatenate(residuals), weights)
        if weights.any():
            self._fit_ratios.append(squares / float(np.sum(weights)))
        yield
        moved = information @ self._search.directions
        known = before.root.T @ before.root
        yield
        return Block(
            begin=stretch.begin,
            end=end,
            information=information,
            right=right,
            moved=moved,
            known=known,
            known_along=known @ self._search.directions,
            before=before,
            samples=tuple(samples),
        )

    def _apply(self, found: FoundChange) -> Job:
        """Restore the estimate before a change, forget changed directions, redo later samples."""
        change, before, after = found
        size, directions = change.size, change.changed_directions
        self._wider.restore(before.before)
        self._wider.forget_directions(self._with_nuisance(directions))
        yield
        yield from self._learn(self._wider, [x for block in after for x in block.samples])
        while len(rows := self._unsearched()) > self._samples_per_update:
            yield from self._learn(self._wider, (yield from self._widened(rows)))
        at_once(self._learn(self._wider, at_once(self._widened(rows))))
        self._estimator.restore(self._wider.restricted(self._count))
        # A change causes unusual motion that no earlier row contains. The covariance is
        # therefore multiplied by the ratio of squared residuals to usual squared residuals.
        squares = count = 0.0
        for block in after:
            columns, tau, weights = (np.stack(part) for part in zip(*block.samples, strict=True))
            residual = self._estimator.scale(weights) * (tau - columns @ self._wider.values)
            squares += float(np.sum((residual / self._residual_scale.value) ** 2))
            count += float(np.sum(weights))
            yield
        factor, free = 1.0, directions.shape[1]
        if self._fit_ratios and count > free:
            factor = max(1.0, squares / (count - free) / float(np.median(self._fit_ratios)))
        self.changes.append(
            replace(change, size=replace(size, covariance=factor * size.covariance))
        )


def _chance_of_block(false_alarm_time: float | None) -> float:
    """Return the probability of a false alarm in a block; 0 if the detection is off."""
    return 0.0 if false_alarm_time is None else BLOCK_LENGTH / false_alarm_time


def _parts(items: Sequence[Item], size: int) -> Iterator[Sequence[Item]]:
    """Yield successive slices of a sequence, each of at most `size` items."""
    for first in range(0, len(items), size):
        yield items[first : first + size]
