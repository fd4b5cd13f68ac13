# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Search the latest samples for a change of the arm, its onset and its cause.

The samples are summed in blocks. After each block, the windows of 0.5, 1 and 2 s that end with it
are tested by the likelihood ratio of a change in the window. After a positive test, all possible
onsets are compared. The change is named when no rival explains the torques equally well, or after
six blocks with its torque.

The estimate before a window is theta0, with the information A = R^T R. The rows W of the window,
of unit noise, give M = W^T W and c = W^T tau. The hypothesis theta = theta0 + D delta in the
window, with theta0 as uncertain as before, has

    S = D^T A (A + M)^-1 M D    and    s = D^T A (A + M)^-1 (c - M theta0)

as information on delta and its score. The estimate of delta is S^-1 s, and s^T S^-1 s is twice
the logarithm of the likelihood ratio. A change with A D = 0 is not detectable.
Source: Willsky and Jones 1976, the generalised likelihood ratio test.

This statistic is chi-square with p degrees of freedom if noise is white and the model is exact.
Its true null distribution is measured while nothing changes (``null_calibration``).

"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.estimate import Estimate
from armid_ros.identification.online.background import Background, Pieces
from armid_ros.identification.online.change import Change, ChangeCandidate
from armid_ros.identification.online.null_calibration import NullCalibration
from armid_ros.identification.online.recursive import RecursiveLeastSquares, WeightedSample
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy.linalg import lapack

#: Lengths of the tested windows [blocks].
_WINDOW_LENGTHS = (2, 4, 8)
#: Eigenvalues of an information matrix below this share of the largest count as zero [-].
_MIN_EIGENVALUE = 1e-9


@dataclass(frozen=True, eq=False)
class Block:
    """
    Normal equations of the samples of a quarter of a second, scaled to unit noise.

    Attributes
    ----------
    begin, end : float
        First and last time of the block [s].
    information : ndarray, shape (P, P)
        M = W^T W.
    right : ndarray, shape (P,)
        c = W^T tau.
    moved : ndarray, shape (P, Q)
        M D, with the directions D of all candidate changes.
    known : ndarray, shape (P, P)
        Information before the block, A = R^T R.
    known_along : ndarray, shape (P, Q)
        A D, with the same D.
    before : RecursiveLeastSquares
        Estimator with nuisance parameters at the begin of the block.
    samples : tuple of WeightedSample
        Samples of the block, which are processed again after a change.

    """

    begin: float
    end: float
    information: FloatArray
    right: FloatArray
    moved: FloatArray
    known: FloatArray
    known_along: FloatArray
    before: RecursiveLeastSquares
    samples: tuple[WeightedSample, ...]


@dataclass(frozen=True, eq=False)
class ScoreStatistics:
    """
    Information matrix and scores of Q possible changes, from a window of blocks.

    Attributes
    ----------
    information : ndarray, shape (Q, Q)
        Information S on the changes.
    score : ndarray, shape (Q,)
        Score s of the changes.
    strength : ndarray, shape (Q,)
        Sum of squared torques in the window per unit of each change.

    """

    information: FloatArray
    score: FloatArray
    strength: FloatArray

    def ratios(self, sets: npt.NDArray[np.intp]) -> FloatArray:
        """
        Return twice the log likelihood ratio for each of G sets of changes, shape (G,).

        Parameters
        ----------
        sets : ndarray of int, shape (G, p)
            Changes of each set; a set of fewer changes repeats one of them.

        """
        squares = np.diag(self.information)
        # the ratio is 0 for a change without torque in the window
        scale = np.where(squares > 0.0, np.abs(squares), np.inf) ** -0.5
        score, information = scale * self.score, np.outer(scale, scale) * self.information
        own = information[sets[:, :, np.newaxis], sets[:, np.newaxis, :]]
        own += _MIN_EIGENVALUE * np.eye(sets.shape[1])
        values = np.linalg.solve(own, score[sets][:, :, np.newaxis])
        return np.asarray(np.einsum('gp,gp->g', score[sets], values[:, :, 0]))

    def size(self, selection: slice) -> tuple[FloatArray, FloatArray]:
        """
        Return the estimated sizes of selected changes, with their covariance for white noise.

        The variance of a change is infinite if this window alone does not determine the change.

        """
        information = self.information[selection, selection]
        covariance = np.linalg.pinv(information, hermitian=True)
        values = np.asarray(covariance @ self.score[selection])
        shown = np.einsum('pq,qp->p', covariance, information)  # 1 for a change that is determined
        hidden = np.flatnonzero(shown < 1.0 - 1e-6)
        covariance[hidden, hidden] = np.inf
        return values, np.asarray(covariance)


def score_statistics(
    window: Sequence[Block],
    before: Block,
    directions: FloatArray,
    residual_scale: float = 1.0,
) -> Pieces[ScoreStatistics]:
    """
    Compute information and scores of possible changes in a window, in short pieces of work.

    Parameters
    ----------
    window : sequence of Block
        Blocks of the window.
    before : Block
        Block whose initial estimate is tested against the window.
    directions : ndarray, shape (P, Q)
        Change of the parameters per unit of each candidate quantity.
    residual_scale : float
        Noise of the rows over the noise that the earlier information assumes.

    """
    first = window[0]
    information, right, moved = first.information, first.right, first.moved
    for one in window[1:]:
        information = information + one.information
        right, moved = right + one.right, moved + one.moved
    yield
    both = before.known / residual_scale**2 + information
    scale = 1.0 / np.sqrt(np.diag(both))
    both *= scale * scale[:, np.newaxis]
    np.fill_diagonal(both, 1.0 + _MIN_EIGENVALUE)
    yield
    factor, _ = lapack.dpotrf(both, lower=1, clean=0)
    score = right - information @ before.before.values
    scaled = np.asfortranarray(np.column_stack([moved, score]) * scale[:, np.newaxis])
    yield
    solved, _ = lapack.dpotrs(factor, scaled, lower=1, overwrite_b=1)
    yield
    along = scale[:, np.newaxis] * before.known_along / residual_scale**2
    shared = along.T @ solved
    strength = np.einsum('pq,pq->q', directions, moved)
    return ScoreStatistics((shared[:, :-1] + shared[:, :-1].T) / 2.0, shared[:, -1], strength)


#: A significant change with its covariance; the last block before the change, and the blocks that
#: lie entirely after it.
FoundChange = tuple[Change, Block, Sequence[Block]]


class ChangeSearch:
    """
    Search for changes of the arm in successive blocks, with a calibrated false-alarm rate.

    Parameters
    ----------
    candidates : sequence of ChangeCandidate
        Candidate changes to search for.
    directions : ndarray, shape (P, Q)
        Change of the parameters per unit of each quantity of the candidates.
    chance : float
        Probability of a false alarm in a block.
    work : Background
        Queue of the computations that calibrate the statistics.

    Attributes
    ----------
    directions : ndarray, shape (P, Q)
        Same as the parameter `directions`.

    """

    def __init__(
        self,
        candidates: Sequence[ChangeCandidate],
        directions: FloatArray,
        chance: float,
        work: Background,
    ) -> None:
        self._candidates = tuple(candidates)
        self.directions = directions
        self._work = work
        sizes = [len(c.parameters) for c in self._candidates]
        self._sizes, ends = np.array(sizes), np.cumsum(sizes)
        self._slices = [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]
        members = np.minimum(np.arange(max(sizes)), self._sizes[:, np.newaxis] - 1)
        self._sets = (ends - self._sizes)[:, np.newaxis] + members
        self.set_chance(chance)
        places = {c.joint for c in self._candidates}
        self._calibrations = {m: NullCalibration(sizes, m, len(places)) for m in _WINDOW_LENGTHS}
        self._latest_change = -np.inf, 0.0
        self.interrupt()

    def set_chance(self, chance: float) -> None:
        """Set the false-alarm probability of a block; 0 switches the detection off."""
        self._chance = chance / (len(self._sizes) * len(_WINDOW_LENGTHS))

    def interrupt(self) -> None:
        """Discard all blocks at an interruption of the stream."""
        self._blocks: deque[Block] = deque(maxlen=_WINDOW_LENGTHS[-1] + 1)
        self._waiting: deque[dict[int, tuple[FloatArray, FloatArray]]] = deque()

    def take(self, block: Block, residual_scale: float) -> Pieces[FoundChange | None]:
        """
        Add a block; return a significant change of the arm, or None.

        Parameters
        ----------
        block : Block
            Block with rows in units of their noise.
        residual_scale : float
            Noise of the rows over the noise that the earlier information assumes.

        """
        self._blocks.append(block)
        blocks = list(self._blocks)
        statistics, positive = {}, False
        for m in (m for m in _WINDOW_LENGTHS if m <= len(blocks)):
            window = yield from score_statistics(
                blocks[-m:], blocks[-m], self.directions, residual_scale
            )
            yield
            statistics[m] = window.ratios(self._sets), window.strength
            yield
            if self._chance > 0.0:
                excess = self._calibrations[m].excess(*statistics[m], self._chance)
                positive = positive or bool(np.any(excess > 1.0))
        if positive:
            found = yield from self._find_onset(residual_scale)
            if found is not None:
                self.interrupt()
                return found
        self._waiting.append(statistics)
        if len(self._waiting) > _WINDOW_LENGTHS[-1]:  # a change would have been named before
            for m, values in self._waiting.popleft().items():
                self._work.begin(self._calibrations[m].update(*values))
        return None

    def size(
        self,
        candidate: ChangeCandidate,
        before: Block,
        after: Sequence[Block],
        residual_scale: float,
    ) -> Pieces[Estimate]:
        """Return the estimated size of a candidate change between a block and later blocks."""
        window = yield from score_statistics(after, before, self.directions, residual_scale)
        yield
        number = self._candidates.index(candidate)
        values, covariance = window.size(self._slices[number])
        usual = np.fmax.reduce(
            [u.factors[number] for u in self._calibrations.values()], initial=1.0
        )
        return Estimate(candidate.parameters, values, covariance * usual)

    def _find_onset(self, residual_scale: float) -> Pieces[FoundChange | None]:
        """Return a change with onset and cause; None while onset or cause is ambiguous."""
        # difference of log-likelihoods from which one explanation is clearly better
        clear = 5.0
        rows, blocks = [], list(self._blocks)
        for k, block in enumerate(blocks[:-1]):
            window = yield from score_statistics(
                blocks[k:], block, self.directions, residual_scale
            )
            yield
            rows.append(window.ratios(self._sets))
            yield
        # log-likelihoods, with a penalty for each free parameter
        usual = np.nanmedian(np.concatenate([u.factors for u in self._calibrations.values()]))
        observations = sum(len(block.samples) for block in blocks)
        likelihood = np.array(rows) / (2.0 * usual) - 0.5 * self._sizes * np.log(observations)
        largest = likelihood.max(axis=0)
        best = int(np.argmax(largest))
        # Soon after a change, the data cannot distinguish onsets: every onset before the change
        # fits. The choice is the last onset whose log-likelihood is less than 4 below the best.
        first = int(np.flatnonzero(likelihood[:, best] > largest[best] - 4.0)[-1])
        # Number of blocks since the onset that contain the torque of the candidate: at least 5 %
        # of the squared torque of the largest block. Blocks at rest have no friction torque. An
        # arm that stops has its largest errors in the last slow motion, and these raise no alarm.
        some = self._slices[best]
        directions = self.directions[:, some]
        moved = [block.moved[:, some] for block in blocks]
        strength = np.array([np.einsum('pq,pq->q', directions, one) for one in moved])
        has_torque = np.any(strength > 0.05 * strength.max(axis=0), axis=1)
        n_blocks = int(np.count_nonzero(has_torque[first:]))
        # The size of a change is learned for 10 s. During this time, another change needs 0.3
        # times the log-likelihood of the first change. With less, it is a correction of the size.
        t, before = self._latest_change
        least = max(clear, 0.3 * before) if blocks[-1].end - t < 10.0 else clear
        if not (largest[best] > least and n_blocks >= 4):
            return None
        likely = [
            self._candidates[k] for k in np.flatnonzero(largest > max(largest[best] - clear, 0.0))
        ]
        # a load is preferred among equally likely candidates: arms often pick things up
        named = next((c for c in likely if c.common), self._candidates[best])
        rivals = tuple(c for c in likely if not (c.includes(named) or named.includes(c)))
        if rivals and n_blocks < 6:  # after six blocks, the change is named despite rivals
            return None
        earlier, later = blocks[max(first - 1, 0)], blocks[min(first + 1, len(blocks) - 1) :]
        size = yield from self.size(named, earlier, later, residual_scale)
        self._latest_change = blocks[-1].end, float(largest[best])
        return Change(named, rivals, blocks[first].begin, size), earlier, later
