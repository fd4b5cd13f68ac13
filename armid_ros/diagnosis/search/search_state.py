# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A round of the search: its data, what a candidate is worth in it, and which one is preferred."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import Problem, Products, project, Projection
from armid_ros.diagnosis.data.trajectory import Trajectory, Workspace
from armid_ros.diagnosis.search.trial import Candidate, Key, lead, ROUNDING, Trial
from armid_ros.diagnosis.search.variance import Changed
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Places in the catalogue that an effect is set back where it is seldom: a delay of one joint,
#: which is a lag as a rule, and a lag of the whole arm, which is a delay.
_ELSEWHERE = 1.5


@dataclass(frozen=True)
class Nuisance:
    """
    Nuisance parameters: what is fitted jointly with every candidate.

    These are base parameters, friction and offsets without given values, and accepted effects.

    Attributes
    ----------
    free : tuple of int
        Their columns of the problem.
    prior : NormalEquations
        Their prior.
    discrepancy : tuple of (int, float)
        Places of a model discrepancy among them, and its present values [N m].

    """

    free: tuple[int, ...]
    prior: NormalEquations
    discrepancy: tuple[tuple[int, float], ...] = ()

    def and_columns(self, candidate: Candidate) -> Nuisance:
        """Return the nuisance parameters and those of a candidate."""
        span = range(candidate.columns.start, candidate.columns.stop)
        prior = self.prior.and_zeros(candidate.precision)
        return replace(self, free=(*self.free, *span), prior=prior)


@dataclass(frozen=True)
class UnseenRows:
    """
    Weighted recordings of the day in question that nothing is fitted to.

    Attributes
    ----------
    evidence : Evidence
        The recordings.
    free : tuple of ndarray, each (S, f)
        Nuisance columns of each recording.
    residual : tuple of ndarray, each (S,)
        Residual of each recording.

    """

    evidence: Evidence
    free: tuple[FloatArray, ...]
    residual: tuple[FloatArray, ...]

    @classmethod
    def of(
        cls, evidence: Evidence, columns: Sequence[FloatArray], residual: Sequence[FloatArray]
    ) -> UnseenRows:
        """Weight columns (M, n, f) and residuals (M, n) of trajectories."""
        free = [rows.reshape(-1, rows.shape[2]) for rows in evidence.weighted(columns)]
        rest = [rows.ravel() for rows in evidence.weighted(residual)]
        return cls(
            evidence, _by_recording(evidence.data, free), _by_recording(evidence.data, rest)
        )

    def own(self, arm: ArmModel, candidate: Candidate) -> list[FloatArray]:
        """Return the weighted columns of a candidate, each (S, p)."""
        kept = list(candidate.kept)
        rows = [part.columns(arm, candidate.effect)[:, :, kept] for part in self.evidence.data]
        flat = [part.reshape(-1, len(kept)) for part in self.evidence.weighted(rows)]
        return list(_by_recording(self.evidence.data, flat))

    def and_columns(self, arm: ArmModel, candidate: Candidate) -> UnseenRows:
        """Return the same with a candidate among the nuisance parameters."""
        pairs = zip(self.free, self.own(arm, candidate), strict=True)
        return replace(self, free=tuple(np.concatenate(pair, axis=1) for pair in pairs))


def _by_recording(
    data: Sequence[Trajectory], rows: Sequence[FloatArray]
) -> tuple[FloatArray, ...]:
    """Return rows of trajectories, those of one recording together."""
    folds = [part.fold for part in data]
    return tuple(
        np.concatenate([own for own, fold in zip(rows, folds, strict=True) if fold == one])
        for one in sorted(set(folds))
    )


@dataclass(frozen=True)
class BaselineRows:
    """
    The baseline under a fitted arm, and further recordings of the day in question.

    Attributes
    ----------
    baseline : Baseline
        Recordings from when nothing was wrong.
    prior : Prior
        Their information about the base parameters.
    change : ndarray, shape (r,)
        Change of the base parameters in the fit.
    later : UnseenRows or None
        Recordings of the day in question that nothing is fitted to.

    """

    baseline: Baseline
    prior: Prior
    change: FloatArray
    later: UnseenRows | None = None

    def and_columns(self, arm: ArmModel, candidate: Candidate) -> BaselineRows:
        """Return the same with a candidate among the nuisance parameters."""
        later = None if self.later is None else self.later.and_columns(arm, candidate)
        return replace(self, later=later)

    def information(
        self, candidates: Sequence[Candidate], arm: ArmModel, nuisance: Nuisance
    ) -> NormalEquations:
        """Return the prior of the baseline values of candidates and of the nuisance parameters."""
        own = np.concatenate(
            [
                self.baseline.columns(arm, candidate.effect, candidate.kept)
                for candidate in candidates
            ],
            axis=1,
        )
        precision = np.concatenate([candidate.precision for candidate in candidates])
        residual = self.prior.residual - self.prior.columns @ self.change
        size, known = own.shape[1], self.prior.columns.shape[1]
        whole = size + len(nuisance.free)
        matrix, vector = np.zeros((whole, whole)), np.zeros(whole)
        matrix[size:, size:], vector[size:] = nuisance.prior.matrix, nuisance.prior.vector
        matrix[:size, :size] = own.T @ own + np.diag(precision)
        matrix[:size, size : size + known] = own.T @ self.prior.columns
        matrix[size : size + known, :size] = matrix[:size, size : size + known].T
        vector[:size] = own.T @ residual
        return NormalEquations(matrix, vector)


@dataclass(frozen=True)
class SearchState:
    """
    The state of a round of the search.

    Attributes
    ----------
    evidence : Evidence
        The data.
    work : Workspace
        Arm and data that columns of other shapes are computed from.
    settings : DiagnosisSettings
        Library and thresholds.
    problem : Problem
        All weighted columns, those of the candidates first.
    nuisance : Nuisance
        Nuisance parameters of every candidate.
    total : float or None
        Held-out squares that shares are of; those of this round if None.
    power : float
        Held-out squares of this round without any candidate, and without a model discrepancy: what
        is to be explained, whatever explains it.
    since : bool
        Whether what has changed is asked, and not what was always there.
    tried : int
        Candidates that were tried, every shape for itself.
    before : BaselineRows or None
        Recordings from when nothing was wrong.
    known : Products or None
        Products of the nuisance columns, common to all trials of the round.
    tested : Changed or None
        Test of the changes of candidates; None where nothing tells.

    """

    evidence: Evidence
    work: Workspace
    settings: DiagnosisSettings
    problem: Problem
    nuisance: Nuisance
    total: float | None = None
    tried: int = 1
    before: BaselineRows | None = None
    known: Products | None = None
    power: float = 1.0
    since: bool = False
    tested: Changed | None = None

    @property
    def currency(self) -> float:
        """
        Squares of which each value of a candidate costs a share.

        Where a change is asked, those that are left in this round: a small change counts whatever
        larger one was named. Where the description may be off in everything, those of the whole
        gap.

        """
        assert self.total is not None
        return max(self.power if self.since else self.total, 1e-300)

    @cached_property
    def free(self) -> FloatArray:
        """Nuisance columns, shape (R, n, f)."""
        return self.problem.x[:, :, list(self.nuisance.free)]

    @cached_property
    def projection(self) -> Projection:
        """Projection that removes the nuisance columns, as far as their prior lets them act."""
        return project(self.problem, self.nuisance.free, self.nuisance.prior)

    @cached_property
    def residual(self) -> FloatArray:
        """Residual without its projection on the nuisance columns, shape (R, n)."""
        return self.projection.rest(self.problem.y)

    def without(self, place: int, value: float) -> SearchState:
        """Return the round without a nuisance column; its torque is added to the residual."""
        free = self.nuisance.free
        kept = [k for k in range(len(free)) if k != place]
        column = self.problem.x[:, :, free[place]]
        problem = replace(self.problem, y=self.problem.y + value * column)
        nuisance = Nuisance(tuple(free[k] for k in kept), self.nuisance.prior.among(kept))
        return replace(self, problem=problem, nuisance=nuisance, known=None)

    def own(self, candidate: Candidate) -> FloatArray:
        """Return the columns of a candidate, shape (R, n, p)."""
        return self.problem.x[:, :, candidate.columns]

    def rows_of(
        self, candidate: Candidate
    ) -> tuple[FloatArray, npt.NDArray[np.intp], FloatArray, FloatArray]:
        """Return residual, blocks, columns of a candidate and nuisance columns of all rows."""
        return self.problem.y, self.problem.block, self.own(candidate), self.free

    def gaps(self, residual: FloatArray) -> npt.NDArray[np.bool_]:
        """Return in which joints a residual (R, n) is a gap, shape (n,)."""
        rows = self.evidence.split(residual, self.problem.weight)
        return self.problem.chi2_per_row(residual) > self.evidence.limits(rows, self.settings)


def worth(trial: Trial, state: SearchState) -> float:
    """Return the share of a trial less the price of its values."""
    price = state.settings.thresholds.price * cost(trial, state.settings)
    return trial.gain / state.currency - price


def cost(trial: Trial, settings: DiagnosisSettings) -> float:
    """Return the number of values and shapes that the data choose, more for external effects."""
    effect = trial.candidate.effect
    shapes = len(effect.shapes) / max(len(effect.traits.separate), 1)
    outside = settings.thresholds.outside if effect.traits.external else 0.0
    return trial.freedom + shapes + outside


def beaten(other: Trial, first: Trial, state: SearchState) -> bool:
    """
    Return whether one trial is so far behind another that it is no rival.

    A lead is what is left of it when the values of both are paid for.

    """
    thresholds = state.settings.thresholds
    gains, z = lead(first, other)
    squares = (worth(first, state) - worth(other, state)) * state.currency
    z *= squares / gains if gains else 0.0
    if squares <= 0.0:
        return False
    often = (
        frequency(other, state) is Frequency.OFTEN and not other.candidate.effect.traits.external
    )
    if frequency(first, state) > Frequency.OFTEN and often:
        return squares > thresholds.far * first.gain
    if squares <= thresholds.tie * state.currency * 0.5 and squares <= thresholds.far * first.gain:
        return False
    return z >= thresholds.rival_z or squares > thresholds.far * first.gain


class Frequency(IntEnum):
    """How seldom an effect changes between two days."""

    OFTEN, SELDOM, NEVER = range(3)


def frequency(trial: Trial, state: SearchState) -> Frequency:
    """Return how seldom a cause changes: a link never does, an inner one hardly has a load."""
    effect = trial.candidate.effect
    if state.since and effect.traits.corrects:
        return Frequency.NEVER
    seldom = state.since and effect.changes_body and not _usual(trial)
    return Frequency.SELDOM if seldom else Frequency.OFTEN


def most_plausible(
    tied: Sequence[Trial], closing: Mapping[Key, bool], state: SearchState
) -> Trial:
    """
    Return the simplest of the tied causes that leave no gap, or the best where each leaves one.

    Of several that are as good it is the commonest.

    One cause that explains everything is preferred to two that do it together, and one that
    changes often to one that never or seldom does. What does not exclude a cause that seldom
    changes may be excluded by another one that often does.

    """
    of_arm = [
        frequency(trial, state) for trial in tied if not trial.candidate.effect.traits.external
    ]
    least = min(of_arm, default=Frequency.NEVER)
    first, *others = (trial for trial in tied if frequency(trial, state) <= least)
    tied = [first, *(trial for trial in others if not beaten(trial, first, state))]
    if len(tied) == 1:
        return first
    able = [trial for trial in tied if closing[trial.candidate.key]]
    if able:
        return simplest(able, state)
    return simplest([t for t in tied if t.gain >= (1.0 - ROUNDING) * first.gain], state)


def _usual(trial: Trial) -> bool:
    return trial.candidate.effect.in_usual_place(trial.candidate.robot)


def closes(trial: Trial, state: SearchState) -> bool:
    """Return whether the held-out residual with a candidate has no gap."""
    _, rest = trial.left_out(*state.rows_of(trial.candidate))
    return not state.gaps(rest).any()


def simplest(tied: Sequence[Trial], state: SearchState) -> Trial:
    """
    Return the cause of least cost.

    Of causes of equal cost it is the one that gains more, and of those that gain the same the
    first in the catalogue, which goes from the common to the rare.

    """
    least = min(cost(trial, state.settings) for trial in tied)
    simple = [t for t in tied if cost(t, state.settings) < least + 0.5]
    most = max(trial.gain for trial in simple)
    close = (1.0 - state.settings.thresholds.tie) * most
    return min((t for t in simple if t.gain >= close), key=rarity)


def rarity(trial: Trial) -> float:
    """Return the place in the catalogue, from common to rare; behind it in an unusual place."""
    names, name = list(CATALOGUE), trial.candidate.effect.said_as
    place = names.index(name) if name in CATALOGUE else len(names)
    return place + (0.0 if _usual(trial) else _ELSEWHERE)


def contains(big: Trial, small: Trial, state: SearchState) -> bool:
    """
    Return whether a cause has more freedom than another and reproduces its torque.

    Where a change is asked, a cause that does not come and go also contains an equal one that
    does. A cause of the whole arm that resembles one of a joint is another cause: a tilted base,
    and the zero of the first encoder of a planar arm.

    """
    if not big.candidate.effect.joints and small.candidate.effect.joints:
        return False
    columns, others = (state.projection.rest(state.own(one.candidate)) for one in (big, small))
    flat, target = columns.reshape(-1, big.candidate.size), (others @ small.values).ravel()
    thresholds, squares = state.settings.thresholds, float(target @ target)
    apart = np.sum((flat @ big.values - target) ** 2)
    if apart < thresholds.same * squares or _same_body(big, small):
        if not state.since:
            return False
        if (
            small.candidate.effect.traits.comes_and_goes
            and not big.candidate.effect.traits.comes_and_goes
        ):
            return True  # links do not change; a description of them may be off
    if cost(big, state.settings) <= cost(small, state.settings):
        return False
    fit = np.linalg.lstsq(flat, target, rcond=1e-6)[0]
    return bool(np.sum((target - flat @ fit) ** 2) < thresholds.tie * squares)


def _same_body(one: Trial, other: Trial) -> bool:
    """Return whether two causes add to the same inertial parameters of a link."""
    added = [trial.candidate.effect.adds_to(trial.candidate.robot) for trial in (one, other)]
    return bool(added[0]) and added[0] == added[1]


def is_redundant(big: Trial, small: Trial, state: SearchState) -> bool:
    """Return whether a cause contains another one and is not worth significantly more."""
    if not contains(big, small, state):
        return False
    thresholds = state.settings.thresholds
    more, (_, z) = worth(big, state) - worth(small, state), lead(big, small)
    return more <= 0.5 * thresholds.tie or z < thresholds.rival_z
