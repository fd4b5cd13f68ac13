# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which of the causes that were accepted one after the other stand jointly.

A fitted arm is a linear problem, in which every name can be tried again.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import make_problem, Problem
from armid_ros.diagnosis.data.trajectory import Trajectory, Workspace
from armid_ros.diagnosis.search.acceptance import acceptable, beyond_chance, material
from armid_ros.diagnosis.search.candidates import Question
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.held_out import held_out
from armid_ros.diagnosis.search.search_state import Nuisance, SearchState
from armid_ros.diagnosis.search.trial import AcceptedCause, Candidate, SelectedEffect, Step, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.motion import FloatArray
import numpy as np


class JointTrial(NamedTuple):
    """
    Trial of a fitted effect, as if it were a candidate now.

    Attributes
    ----------
    trial : Trial or None
        What it explains; None where nothing of it is visible.
    problem : Problem
        The problem, its columns first.
    nuisance : Nuisance
        All that is fitted jointly with it.
    power : float
        Held-out squares without it.

    """

    trial: Trial | None
    problem: Problem
    nuisance: Nuisance
    power: float


@dataclass(frozen=True)
class LinearFit:
    """
    A fitted arm as a linear problem, from which names and nuisance columns can be removed again.

    Attributes
    ----------
    problem : Problem
        All Jacobian columns of the fit, those of the base parameters first, and those of ``more``.
    fitted : Fitted
        The arm.
    more : tuple of SelectedEffect
        Effects that were not fitted, at values of zero.

    """

    problem: Problem
    fitted: Fitted
    more: tuple[SelectedEffect, ...] = ()

    @classmethod
    def of(
        cls, fitted: Fitted, evidence: Evidence, more: Sequence[SelectedEffect] = ()
    ) -> LinearFit:
        """Make the problem of a fitted arm, and of further effects."""
        columns = [
            np.concatenate([own, *(columns_of(one, fitted.arm, part) for one in more)], axis=2)
            for part, own in zip(evidence.data, fitted.columns, strict=True)
        ]
        problem = make_problem(evidence.data, evidence.sigma, fitted.residual, columns)
        return cls(problem, fitted, tuple(more))

    @property
    def power(self) -> FloatArray:
        """Held-out squares of each block, shape (B,)."""
        _, free, prior = self.without((), ())
        return held_out(self.problem, free, [], prior)[1]

    @property
    def fitted_columns(self) -> int:
        """Return the number of the columns that were fitted."""
        return int(self.fitted.columns[0].shape[2])

    def columns(self, name: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return the columns of the values of a name, fitted or further, and of its shapes."""
        fitted = len(self.fitted.named)
        if name < fitted:
            first = self.fitted_columns - len(self.fitted.estimate.values)
            values, shapes = self.fitted.places[name]
            return tuple(first + k for k in values), tuple(first + k for k in shapes)
        sizes = [len(one.kept) for one in self.more[: name - fitted + 1]]
        stop = self.fitted_columns + sum(sizes)
        return tuple(range(stop - sizes[-1], stop)), ()

    def value(self, column: int) -> float:
        """Return the fitted value of a column of a name; zero of further ones."""
        place = column - self.fitted_columns
        return float(self.fitted.estimate.values[place]) if place < 0 else 0.0

    def without(
        self, columns: Sequence[int], values: Sequence[float], gone: Sequence[int] = ()
    ) -> tuple[Problem, tuple[int, ...], NormalEquations]:
        """
        Return the problem as if some columns had a value of zero.

        Parameters
        ----------
        columns : sequence of int
            Columns to be put first; the torque of their values is added to the residual.
        values : sequence of float
            Their values.
        gone : sequence of int
            Columns that are removed; their values were zero.

        Returns
        -------
        problem : Problem
        free : tuple of int
            All other columns, as nuisance columns.
        prior : NormalEquations
            Prior of these.

        """
        size = self.problem.x.shape[2]
        away = {*columns, *gone}
        others = [c for c in range(size) if c not in away]
        x = self.problem.x
        y = self.problem.y + x[:, :, list(columns)] @ np.asarray(values, dtype=float)
        moved = replace(self.problem, x=x[:, :, [*columns, *others]], y=y)
        free = tuple(range(len(columns), len(columns) + len(others)))
        return moved, free, self.fitted.prior.among(others)

    def dropped(self, column: int, value: float) -> LinearFit:
        """Return the view as if a column had a value of zero."""
        y = self.problem.y + self.problem.x[:, :, column] * value
        return replace(self, problem=replace(self.problem, y=y))

    def trial(
        self,
        candidate: Candidate,
        columns: Sequence[int],
        values: Sequence[float],
        gone: Sequence[int] = (),
    ) -> JointTrial:
        """Try fitted columns as if they belonged to a candidate now."""
        problem, free, prior = self.without(columns, values, gone)
        moved = replace(candidate, columns=slice(0, len(columns)))
        trials, power = held_out(problem, free, [moved], prior)
        trial = trials[0] if trials else None
        return JointTrial(trial, problem, Nuisance(free, prior), float(power.sum()))

    def trial_of(self, name: int) -> JointTrial:
        """Try a name as if it were a candidate now, jointly with those that were fitted."""
        own = (*self.fitted.named, *self.more)[name]
        columns, shapes = self.columns(name)
        further = range(self.fitted_columns, self.problem.x.shape[2])
        gone = [*shapes, *(c for c in further if c not in columns)]
        span = slice(0, len(columns))
        candidate = Candidate(own.effect, span, own.kept, self.fitted.arm.robot)
        return self.trial(candidate, columns, [self.value(c) for c in columns], gone)


def columns_of(own: SelectedEffect, arm: ArmModel, part: Trajectory) -> FloatArray:
    """Return the columns of a name in rows, shape (M, n, p)."""
    return part.columns(arm, own.effect)[:, :, list(own.kept)]


def doubtful(trial: Trial | None) -> tuple[float, float]:
    """Return a sort key: larger for likelier chance, then for less gain; largest for None."""
    return (np.inf, np.inf) if trial is None else (trial.p, -trial.gain)


@dataclass(frozen=True)
class BackwardElimination:
    """
    Tries each accepted cause again, jointly with the others, under the conditions of its step.

    Attributes
    ----------
    question : Question
        What is asked of which arm.
    evidence : Evidence
        The data.
    settings : DiagnosisSettings
        Library and thresholds.

    """

    question: Question
    evidence: Evidence
    settings: DiagnosisSettings

    @cached_property
    def work(self) -> Workspace:
        """Arm and data that columns of other shapes are computed from."""
        return Workspace(memoized_arm(self.question.arm), self.evidence.data)

    @cached_property
    def reference(self) -> Fitted:
        """Return the arm with nothing named."""
        return self.fitted((), None)

    @cached_property
    def gap(self) -> float:
        """Held-out squares with nothing named."""
        return float(LinearFit.of(self.reference, self.evidence).power.sum())

    def stands(self, step: Step, again: JointTrial) -> bool:
        """
        Return whether a cause is significant, and material where it has to be.

        Offsets that a fold alone does not determine make the held-out squares of the first look
        larger than the gap is without them.

        """
        if again.trial is None:
            return False
        state = SearchState(
            self.evidence,
            self.work,
            self.settings,
            again.problem,
            again.nuisance,
            min(step.total, self.gap),
            step.tried,
            power=again.power,
            since=self.question.since,
        )
        if step.misfit_share is None:
            return beyond_chance(again.trial, state)
        gains = again.trial.joint_gains(*state.rows_of(again.trial.candidate))
        return acceptable(again.trial, state) and material(gains, state, step.misfit_share)

    def fitted(self, names: Sequence[AcceptedCause], change: FloatArray | None) -> Fitted:
        """Fit all names jointly, from their values and a change of the base parameters on."""
        question, evidence = self.question, self.evidence
        return fit(
            question.arm,
            [one.named for one in names],
            evidence,
            question.base,
            Start([one.values for one in names], change),
            question.prior,
        )

    def least_significant(self, fitted: Fitted, names: Sequence[AcceptedCause]) -> int | None:
        """Return the name that is likeliest to be chance given the others; None if all stand."""
        if not names:
            return None
        view = LinearFit.of(fitted, self.evidence)
        judged = [view.trial_of(k) for k in range(len(names))]
        weak = [
            (doubtful(again.trial), k)
            for k, again in enumerate(judged)
            if not self.stands(names[k].step, again)
        ]
        return max(weak)[1] if weak else None

    def significant_again(
        self, fitted: Fitted, dropped: Sequence[AcceptedCause]
    ) -> tuple[int, FloatArray] | None:
        """Return the dropped name that gains most given those that stay, and its values."""
        if not dropped:
            return None
        view = LinearFit.of(fitted, self.evidence, [one.named for one in dropped])
        found: dict[int, Trial] = {}
        for k, one in enumerate(dropped):
            again = view.trial_of(len(fitted.named) + k)
            if again.trial is not None and self.stands(one.step, again):
                found[k] = again.trial
        if not found:
            return None
        most = max(found, key=lambda k: found[k].gain)
        values = np.zeros_like(dropped[most].values)
        values[list(dropped[most].named.kept)] = found[most].values
        return most, values


def pruned(
    retrial: BackwardElimination, taken: Sequence[AcceptedCause], change: FloatArray | None = None
) -> tuple[tuple[Step, ...], Fitted]:
    """
    Fit all names jointly, and drop those that the others make needless.

    A name that made another one needless may be dropped after it: each dropped name is tried once
    more jointly with those that stay.

    Returns
    -------
    steps : tuple of Step
        Those of the names that stay.
    fitted : Fitted
        The arm with these names.

    """
    alive, dropped = list(taken), list[AcceptedCause]()
    back: list[Step] = []
    while True:
        fitted = retrial.fitted(alive, change)
        steps, change = tuple(one.step for one in alive), fitted.change
        rows = zip(fitted.named, steps, fitted.values, strict=True)
        alive = [AcceptedCause(*row) for row in rows]
        least_significant = retrial.least_significant(fitted, alive)
        if least_significant is not None:
            gone = alive.pop(least_significant)
            if not any(gone.step is step for step in back):
                dropped.append(gone)
            continue
        needed = retrial.significant_again(fitted, dropped)
        if needed is None:
            return steps, fitted
        again = dropped.pop(needed[0])._replace(values=needed[1])
        back.append(again.step)
        alive.append(again)
