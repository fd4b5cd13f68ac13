# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A round of the search: what it knows, what a cause is worth in it, and which one is taken."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import Problem, Products, project, Projection
from armid_ros.diagnosis.data.trajectory import Workspace
from armid_ros.diagnosis.search.trial import Candidate, lead, ROUNDING, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Places in the catalogue that an effect is behind where it is seldom: a delay of one joint, which
#: is a lag as a rule, and a lag of the whole arm, which is a delay.
_ELSEWHERE = 1.5


@dataclass(frozen=True)
class Nuisance:
    """
    What is fitted beside every cause.

    Attributes
    ----------
    free : tuple of int
        Columns of the problem.
    prior : NormalEquations
        What is known of their values.

    """

    free: tuple[int, ...]
    prior: NormalEquations

    def and_columns(self, candidate: Candidate) -> Nuisance:
        """Return the same with the columns of a candidate."""
        span = range(candidate.columns.start, candidate.columns.stop)
        return Nuisance((*self.free, *span), self.prior.and_zeros(candidate.precision))


@dataclass(frozen=True)
class Later:
    """
    Recordings of the day in question that nothing is fitted to, over the unit of the gap.

    Attributes
    ----------
    evidence : Evidence
        The recordings.
    free : tuple of ndarray, each (S, f)
        Columns of what is fitted beside every cause, of each recording.
    residual : tuple of ndarray, each (S,)
        What is left of it.

    """

    evidence: Evidence
    free: tuple[FloatArray, ...]
    residual: tuple[FloatArray, ...]

    @classmethod
    def of(
        cls, evidence: Evidence, columns: Sequence[FloatArray], residual: Sequence[FloatArray]
    ) -> Later:
        """Weight columns (M, n, f) and residuals (M, n) of trajectories."""
        free = evidence.weighted(columns)
        left = evidence.weighted(residual)
        return cls(
            evidence,
            tuple(rows.reshape(-1, rows.shape[2]) for rows in free),
            tuple(rows.ravel() for rows in left),
        )

    def own(self, arm: ArmModel, candidate: Candidate) -> list[FloatArray]:
        """Return the columns of a candidate, each (S, p)."""
        kept = list(candidate.kept)
        rows = [part.columns(arm, candidate.effect)[:, :, kept] for part in self.evidence.data]
        return [part.reshape(-1, len(kept)) for part in self.evidence.weighted(rows)]

    def and_columns(self, arm: ArmModel, candidate: Candidate) -> Later:
        """Return the same with the columns of a candidate."""
        pairs = zip(self.free, self.own(arm, candidate), strict=True)
        return replace(self, free=tuple(np.concatenate(pair, axis=1) for pair in pairs))


@dataclass(frozen=True)
class Before:
    """
    Recordings in which nothing was wrong, beside an arm of which something is free.

    Attributes
    ----------
    baseline : Baseline
        The recordings.
    prior : Prior
        What they tell of what is free.
    change : ndarray, shape (r,)
        What was added to that.
    later : Later or None
        Recordings of the day in question that nothing is fitted to.

    """

    baseline: Baseline
    prior: Prior
    change: FloatArray
    later: Later | None = None

    def and_columns(self, arm: ArmModel, candidate: Candidate) -> Before:
        """Return the same where a candidate is fitted beside every cause."""
        later = None if self.later is None else self.later.and_columns(arm, candidate)
        return replace(self, later=later)

    def information(
        self, candidates: Sequence[Candidate], arm: ArmModel, nuisance: Nuisance
    ) -> NormalEquations:
        """Return what is known of the values some had before already, and of what is free."""
        own = np.concatenate(
            [
                self.baseline.columns(arm, candidate.effect, candidate.kept)
                for candidate in candidates
            ],
            axis=1,
        )
        precision = np.concatenate([candidate.precision for candidate in candidates])
        left = self.prior.residual - self.prior.columns @ self.change
        size, known = own.shape[1], self.prior.columns.shape[1]
        whole = size + len(nuisance.free)
        matrix, vector = np.zeros((whole, whole)), np.zeros(whole)
        matrix[size:, size:], vector[size:] = nuisance.prior.matrix, nuisance.prior.vector
        matrix[:size, :size] = own.T @ own + np.diag(precision)
        matrix[:size, size : size + known] = own.T @ self.prior.columns
        matrix[size : size + known, :size] = matrix[:size, size : size + known].T
        vector[:size] = own.T @ left
        return NormalEquations(matrix, vector)


@dataclass(frozen=True)
class Round:
    """
    What a round of the search needs to know.

    Attributes
    ----------
    evidence : Evidence
        The data.
    work : Workspace
        What columns of other shapes are computed from.
    settings : DiagnosisSettings
        Library and thresholds.
    problem : Problem
        All columns over the unit, those of the candidates first.
    nuisance : Nuisance
        What is fitted beside every cause.
    total : float or None
        Held-out squares that shares are of; those of this round if None.
    power : float
        Held-out squares of this round.
    since : bool
        Whether what has changed is asked, and not what was always there.
    tried : int
        Candidates that were tried, every shape for itself.
    before : Before or None
        Recordings in which nothing was wrong.
    width : float
        Squares that any cause takes of what nothing explains: a lead of less decides nothing.
    known : Products or None
        Of what is free, which all that is tried in the round stands beside.

    """

    evidence: Evidence
    work: Workspace
    settings: DiagnosisSettings
    problem: Problem
    nuisance: Nuisance
    total: float | None = None
    tried: int = 1
    before: Before | None = None
    width: float = 0.0
    known: Products | None = None
    power: float = 1.0
    since: bool = False

    @property
    def currency(self) -> float:
        """
        Squares that a cause pays for its values with.

        Those that are left where a change is asked: a small one counts beside any large one. Where
        the description may be off in everything, those of the whole gap.

        """
        assert self.total is not None
        return max(self.power if self.since else self.total, 1e-300)

    @cached_property
    def free(self) -> FloatArray:
        """Columns that are fitted beside every cause, shape (R, n, f)."""
        return self.problem.x[:, :, list(self.nuisance.free)]

    @cached_property
    def projection(self) -> Projection:
        """What these leave of others."""
        return project(self.problem, self.nuisance.free, self.nuisance.prior)

    @cached_property
    def residual(self) -> FloatArray:
        """What these leave of the residual, shape (R, n)."""
        return self.projection.rest(self.problem.y)

    def within(self, width: float) -> Round:
        """Return the same where a lead of less than some squares decides nothing."""
        return self if width == self.width else replace(self, width=width)

    def without(self, place: int, value: float) -> Round:
        """Return the same where one of the free columns is not there, and had a value."""
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
        """Return what is to be explained, its blocks, columns of a candidate and free ones."""
        return self.problem.y, self.problem.block, self.own(candidate), self.free

    def gaps(self, left: FloatArray) -> npt.NDArray[np.bool_]:
        """Return in which joints what is left (R, n) is a gap, shape (n,)."""
        rows = self.evidence.split(left, self.problem.weight)
        return self.problem.chi2_per_row(left) > self.evidence.limits(rows, self.settings)


def worth(trial: Trial, here: Round) -> float:
    """Return the share of what is left that a trial takes, its freedom paid for."""
    price = here.settings.thresholds.price * cost(trial, here.settings)
    return trial.gain / here.currency - price


def cost(trial: Trial, settings: DiagnosisSettings) -> float:
    """Return how many values and shapes the data chose, those of what is outlandish more."""
    effect = trial.candidate.effect
    shapes = len(effect.shapes) / max(len(effect.separate), 1)
    outside = settings.thresholds.outside if effect.external else 0.0
    return trial.freedom + shapes + outside


def beaten(other: Trial, first: Trial, here: Round) -> bool:
    """Return whether one trial is so far behind another that it is no rival."""
    thresholds = here.settings.thresholds
    squares, z = lead(first, other)
    if squares <= here.width:
        return False
    often = frequency(other, here) is Frequency.OFTEN and not other.candidate.effect.external
    if frequency(first, here) > Frequency.OFTEN and often:
        return squares > thresholds.far * first.gain
    if squares <= thresholds.tie * here.currency * 0.5 and squares <= thresholds.far * first.gain:
        return False
    return z >= thresholds.rival_z or squares > thresholds.far * first.gain


class Frequency(IntEnum):
    """How seldom a cause comes between two days."""

    OFTEN, SELDOM, NEVER = range(3)


def frequency(trial: Trial, here: Round) -> Frequency:
    """Return how seldom a cause comes: a link never changes, an inner one hardly has a load."""
    effect = trial.candidate.effect
    if here.since and effect.corrects:
        return Frequency.NEVER
    seldom = here.since and effect.changes_body and not _usual(trial)
    return Frequency.SELDOM if seldom else Frequency.OFTEN


def what_happens_first(passing: Sequence[Trial], here: Round) -> list[Trial]:
    """Return causes, best first: before one that never happens what happens and says the same."""
    first, *others = passing
    if frequency(first, here) is Frequency.NEVER:
        for other in others:
            happens = (
                frequency(other, here) < Frequency.NEVER and not other.candidate.effect.external
            )
            if happens and not beaten(other, first, here) and contains(first, other, here):
                return [other, first, *(trial for trial in others if trial is not other)]
    return list(passing)


def likeliest(tied: Sequence[Trial], closing: Mapping[int, bool], here: Round) -> Trial:
    """
    Return the simplest of the causes that leave no gap, or the best where each leaves one.

    Of several that are as good it is the commonest.

    One cause that explains everything goes before two that do it together, and what happens goes
    before what never or seldom does.

    """
    of_arm = [frequency(trial, here) for trial in tied if not trial.candidate.effect.external]
    least = min(of_arm, default=Frequency.NEVER)
    tied = [trial for trial in tied if frequency(trial, here) <= least]
    if len(tied) == 1:
        return tied[0]
    able = [trial for trial in tied if closing[id(trial)]]
    if able:
        return simplest(able, here)
    alike = [t for t in tied if t.gain >= (1.0 - ROUNDING) * tied[0].gain]
    return min(alike, key=rarity)


def _usual(trial: Trial) -> bool:
    return trial.candidate.effect.in_usual_place(trial.candidate.robot)


def closes(trial: Trial, here: Round) -> bool:
    """Return whether a cause leaves no gap of data left out."""
    _, rest = trial.left_out(*here.rows_of(trial.candidate))
    return not here.gaps(rest).any()


def simplest(tied: Sequence[Trial], here: Round) -> Trial:
    """
    Return the cause with the least freedom.

    Of causes as free as each other the one that takes more, and of those that take the same the
    first in the catalogue, which goes from the common to the rare.

    """
    least = min(cost(trial, here.settings) for trial in tied)
    simple = [t for t in tied if cost(t, here.settings) < least + 0.5]
    most = max(trial.gain for trial in simple)
    close = max(here.settings.thresholds.tie * most, here.width)
    return min((t for t in simple if t.gain >= most - close), key=rarity)


def undecided(first: Trial, ranking: Sequence[Trial], here: Round) -> bool:
    """Tell whether a cause was taken for a lead over a likelier one that decides nothing."""
    close = [t for t in ranking if t.gain > 0.0 and 0.0 <= first.gain - t.gain <= here.width]
    own = round(cost(first, here.settings)), rarity(first)
    return any((round(cost(t, here.settings)), rarity(t)) < own for t in close)


def rarity(trial: Trial) -> float:
    """Return the position in the catalogue, which goes from the common to the rare."""
    names, name = list(CATALOGUE), trial.candidate.effect.said_as
    place = names.index(name) if name in CATALOGUE else len(names)
    return place + (0.0 if _usual(trial) else _ELSEWHERE)


def contains(big: Trial, small: Trial, here: Round) -> bool:
    """
    Return whether a cause says the same, or is freer and can make what another one makes.

    A cause of the whole arm that looks like one of a joint is another cause: a base that leans,
    and the zero of the first encoder of an arm that moves in a plane.

    """
    if not big.candidate.effect.joints and small.candidate.effect.joints:
        return False
    columns, others = (here.projection.rest(here.own(one.candidate)) for one in (big, small))
    flat, target = columns.reshape(-1, big.candidate.size), (others @ small.values).ravel()
    thresholds, squares = here.settings.thresholds, float(target @ target)
    apart = np.sum((flat @ big.values - target) ** 2)
    if apart < thresholds.same * squares or _same_body(big, small):
        if not here.since:
            return False
        if small.candidate.effect.comes_and_goes and not big.candidate.effect.comes_and_goes:
            return True  # links do not change; a description of them may be off
    if cost(big, here.settings) <= cost(small, here.settings):
        return False
    fit = np.linalg.lstsq(flat, target, rcond=1e-6)[0]
    return bool(np.sum((target - flat @ fit) ** 2) < thresholds.tie * squares)


def _same_body(one: Trial, other: Trial) -> bool:
    """Return whether two causes are the body of one link in other words."""
    added = [trial.candidate.effect.adds_to(trial.candidate.robot) for trial in (one, other)]
    return bool(added[0]) and added[0] == added[1]


def says_no_more(big: Trial, small: Trial, here: Round) -> bool:
    """Return whether a cause contains another one and, its freedom paid for, explains no more."""
    if not contains(big, small, here):
        return False
    thresholds = here.settings.thresholds
    more, (_, z) = worth(big, here) - worth(small, here), lead(big, small)
    return more <= 0.5 * thresholds.tie or z < thresholds.rival_z
