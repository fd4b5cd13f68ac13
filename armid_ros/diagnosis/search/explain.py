# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One explanation of a gap: causes taken one after the other, in an arm as given or fitted anew.

The cause that takes most of the held-out squares is taken first, and the rest is asked again.
Friction and offsets that nobody gave values of are fitted beside every cause, and those that
matter are named in the end.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import make_problem, Problem
from armid_ros.diagnosis.search.candidates import Group
from armid_ros.diagnosis.search.fit import fit, Fitted, Start, Told
from armid_ros.diagnosis.search.forward import Search, Taken
from armid_ros.diagnosis.search.held_out import held_out, Trial
from armid_ros.diagnosis.search.memoized_arm import memoized_arm, plain_arm
from armid_ros.diagnosis.search.patch import Named
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.refine import Workspace
from armid_ros.diagnosis.search.resampled import widened
from armid_ros.diagnosis.search.round import acceptable, Beside, beyond_chance, material, Round
from armid_ros.diagnosis.search.step import Step, Survey
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Explanation:
    """
    What a search came to.

    Attributes
    ----------
    given : ArmModel
        The arm as given.
    base : BaseParameters or None
        What was free of it; None where nothing was.
    fitted : Fitted
        The arm with all that was named.
    reference : Fitted
        The same without.
    steps : tuple of Step
        The names, in the order of those in ``fitted``.
    survey : Survey or None
        The first look at all groups.
    evidence : Evidence
        The data.
    minor : tuple of Trial
        Causes of the last look that are there beyond chance and do not matter.
    told : Told or None
        What other data tell of what was free.
    by_chance : float
        Squares that a value of any cause takes of what the names leave.
    considered : frozenset of str
        Names without which something else could have been found.
    baseline : Baseline or None
        Recordings since which the names have changed.

    """

    given: ArmModel
    base: BaseParameters | None
    fitted: Fitted
    reference: Fitted
    steps: tuple[Step, ...]
    survey: Survey | None
    evidence: Evidence
    minor: tuple[Trial, ...] = ()
    told: Told | None = None
    by_chance: float = 0.0
    considered: frozenset[str] = frozenset()
    baseline: Baseline | None = None

    def without(self, name: int) -> Explanation:
        """Return the explanation without one of its names, the others fitted anew."""
        fewer = self.only([k for k in range(len(self.steps)) if k != name])
        return replace(fewer, minor=(*self.minor, self.steps[name].trial))

    def only(self, keep: Sequence[int]) -> Explanation:
        """Return the explanation with some of its names, in this order, fitted anew."""
        fitted = fit(
            self.given,
            [self.fitted.named[k] for k in keep],
            self.evidence.data,
            self.evidence.sigma,
            self.base,
            Start([self.fitted.values[k] for k in keep], self.fitted.change),
            self.told,
        )
        fitted = widened(fitted, self.evidence, self.told, self.by_chance)
        return replace(self, fitted=fitted, steps=tuple(self.steps[k] for k in keep))

    def forgetting(self) -> Explanation:
        """Return the same with arms that do not hold what they have computed."""
        return replace(
            self,
            given=plain_arm(self.given),
            fitted=replace(self.fitted, arm=plain_arm(self.fitted.arm)),
            reference=replace(self.reference, arm=plain_arm(self.reference.arm)),
        )

    @property
    def chi2_per_row(self) -> FloatArray:
        """Loss of each joint with the patched arm, shape (n,)."""
        return self.evidence.chi2_per_row(self.fitted.residual)


def explain(
    question: Question,
    evidence: Evidence,
    settings: DiagnosisSettings,
    start: Sequence[Taken] = (),
    baseline: Baseline | None = None,
    unseen: Evidence | None = None,
) -> Explanation:
    """Take causes as long as any passes, then name the friction that matters, and prune."""
    way = Search(question, evidence, settings, baseline, unseen).forward(start)
    named, steps, values, survey, last = way.named, way.steps, way.values, way.first, way.last
    minor = () if last is None else last.there
    whole = None if survey is None else survey.total, 1 if survey is None else survey.tried
    kept = _friction(question, named, values, evidence, settings, whole)
    named = [*named, *(own for own, _, _ in kept)]
    steps = [*steps, *(step for _, step, _ in kept)]
    values = [*values, *(value for _, _, value in kept)]
    reference = fit(
        question.arm, (), evidence.data, evidence.sigma, question.base, None, question.told
    )
    change = way.change if question.beside is question.arm else None
    named, steps, fitted = _pruned(question, named, steps, values, evidence, settings, change)
    by_chance = 0.0 if last is None else last.by_chance
    fitted = widened(fitted, evidence, question.told, by_chance)
    said = {own.effect.name for own in named}
    small = tuple(trial for trial in minor if trial.group.effect.name not in said)
    return Explanation(
        question.arm,
        question.base,
        fitted,
        reference,
        tuple(steps),
        survey,
        evidence,
        small,
        question.told,
        by_chance,
        way.considered,
        baseline,
    )


@dataclass(frozen=True)
class View:
    """
    A fitted arm as a linear problem, from which names and free values can be taken away again.

    Attributes
    ----------
    problem : Problem
        All columns that were free, those of the base parameters first.
    fitted : Fitted
        The arm.

    """

    problem: Problem
    fitted: Fitted

    @classmethod
    def of(cls, fitted: Fitted, evidence: Evidence) -> View:
        """Make the problem of a fitted arm."""
        problem = make_problem(
            evidence.data, evidence.sigma, fitted.residual, list(fitted.columns)
        )
        return cls(problem, fitted)

    @property
    def first(self) -> int:
        """The first column of a name."""
        return int(self.problem.x.shape[2]) - len(self.fitted.estimate.values)

    def columns(self, name: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return the columns of the values of a name, and those of its shapes."""
        values, shapes = self.fitted.places[name]
        return tuple(self.first + k for k in values), tuple(self.first + k for k in shapes)

    def value(self, column: int) -> float:
        """Return the value of a column of a name."""
        return float(self.fitted.estimate.values[column - self.first])

    def without(
        self, columns: Sequence[int], values: Sequence[float], gone: Sequence[int] = ()
    ) -> tuple[Problem, tuple[int, ...], FloatArray, FloatArray]:
        """
        Return the problem as if some columns had a value of zero.

        Parameters
        ----------
        columns : sequence of int
            Columns to be put first, and their values given back to the residual.
        values : sequence of float
            Their values.
        gone : sequence of int
            Columns that are not there at all; their values were zero.

        Returns
        -------
        problem : Problem
        free : tuple of int
            The other columns.
        hold, pull : ndarray
            How these are held.

        """
        size = self.problem.x.shape[2]
        away = {*columns, *gone}
        others = [c for c in range(size) if c not in away]
        x = self.problem.x
        y = self.problem.y + x[:, :, list(columns)] @ np.asarray(values, dtype=float)
        moved = replace(self.problem, x=x[:, :, [*columns, *others]], y=y)
        hold = self.fitted.hold[np.ix_(others, others)]
        free = tuple(range(len(columns), len(columns) + len(others)))
        return moved, free, hold, self.fitted.pull[others]

    def dropped(self, column: int, value: float) -> View:
        """Return the view as if a column had a value of zero."""
        y = self.problem.y + self.problem.x[:, :, column] * value
        return replace(self, problem=replace(self.problem, y=y))

    def trial(
        self,
        group: Group,
        columns: Sequence[int],
        values: Sequence[float],
        gone: Sequence[int] = (),
    ) -> tuple[Trial | None, Problem, Beside, float]:
        """Judge what is there already as if it were asked for now."""
        problem, free, hold, pull = self.without(columns, values, gone)
        moved = replace(group, columns=slice(0, len(columns)))
        trials, power = held_out(problem, free, [moved], hold, pull)
        beside = Beside(free, hold, pull)
        return (trials[0] if trials else None), problem, beside, float(power.sum())

    def trial_of(self, name: int) -> tuple[Trial | None, Problem, Beside, float]:
        """Judge a name as if it were asked for now, beside the others."""
        own = self.fitted.named[name]
        columns, shapes = self.columns(name)
        span = slice(0, len(columns))
        group = Group.of(own.effect, span, own.kept, self.fitted.arm.robot)
        return self.trial(group, columns, [self.value(c) for c in columns], shapes)


def _friction(
    question: Question,
    named: Sequence[Named],
    values: Sequence[FloatArray],
    evidence: Evidence,
    settings: DiagnosisSettings,
    whole: tuple[float | None, int],
) -> list[Taken]:
    """
    Return the friction of unknown value that is there, beside what was named.

    All of it was free beside every cause. What is likeliest to be chance goes first, as what is
    needless bends what the others take, until all that is left is there beyond it, however little
    that takes: the values of causes lean on what is left out. What has changed has to matter, too.

    """
    if not question.unknown:
        return []
    arm, base = question.beside, question.beside_base
    assert base is not None
    fitted = fit(
        arm, named, evidence.data, evidence.sigma, base, Start(values), question.beside_told
    )
    view = View.of(fitted, evidence)
    where = {int(column): k for k, column in enumerate(base.independent)}
    names = [(p.name, p.joint) for p in arm.parameters]
    theta, left = fitted.arm.theta, []
    for effect in question.unknown:
        parameter = effect.parameters(arm.robot)[0]
        column = names.index((parameter.name, parameter.joint))
        if column in where:
            left.append((effect, where[column], float(theta[column])))
    least = settings.thresholds.misfit_share if question.since else None
    work = Workspace(memoized_arm(arm), evidence.data)
    gone: list[int] = []
    alive = dict(enumerate(left))
    while True:
        steps: dict[int, Step] = {}
        weak: dict[int, tuple[float, float]] = {}
        for k, (effect, column, value) in alive.items():
            group = Group.of(effect, slice(0, 1), (0,), arm.robot)
            trial, problem, beside, power = view.trial(group, [column], [value], gone)
            if trial is None:
                weak[k] = _doubtful(trial)
                continue
            total = power if whole[0] is None else whole[0]
            steps[k] = Step(trial, (), (trial,), total, whole[1], least)
            here = Round(evidence, work, settings, problem, beside, total, whole[1])
            if not _stands(steps[k], here):
                weak[k] = _doubtful(trial)
        if not weak:
            break
        _, column, value = alive.pop(max(weak, key=lambda k: weak[k]))
        view = view.dropped(column, value)
        gone.append(column)
    return [
        (Named(effect, (0,)), steps[k], np.array([value]))
        for k, (effect, _, value) in alive.items()
    ]


def _doubtful(trial: Trial | None) -> tuple[float, float]:
    """Return an order of causes: likelier to be chance, and taking less; None is not seen."""
    return (np.inf, np.inf) if trial is None else (trial.p, -trial.gain)


def _stands(step: Step, here: Round) -> bool:
    """Return whether a cause, whose columns come first, is there, and matters if it has to."""
    trial = step.trial
    if step.misfit_share is None:
        return beyond_chance(trial, here)
    gains = trial.joint_gains(here.problem, here.own(trial.group), here.free)
    return acceptable(trial, here) and material(gains, here, step.misfit_share)


def _pruned(
    question: Question,
    named: Sequence[Named],
    steps: Sequence[Step],
    values: Sequence[FloatArray],
    evidence: Evidence,
    settings: DiagnosisSettings,
    change: FloatArray | None = None,
) -> tuple[list[Named], list[Step], Fitted]:
    """Fit all names together, and drop those that the others make needless."""
    data, sigma = evidence.data, evidence.sigma
    named, steps, values = list(named), list(steps), list(values)
    base, told = question.base, question.told
    while True:
        fitted = fit(question.arm, named, data, sigma, base, Start(values, change), told)
        if not named:
            return named, steps, fitted
        view = View.of(fitted, evidence)
        work = Workspace(memoized_arm(question.arm), data)
        needless: list[tuple[tuple[float, float], int]] = []
        for k, step in enumerate(steps):
            trial, problem, beside, _ = view.trial_of(k)
            here = Round(evidence, work, settings, problem, beside, step.total, step.tried)
            if trial is None:
                needless.append((_doubtful(trial), k))
            elif not _stands(replace(step, trial=trial), here):
                needless.append((_doubtful(trial), k))
        if not needless:
            return list(fitted.named), steps, fitted
        gone, change = max(needless)[1], fitted.change
        named = [own for k, own in enumerate(fitted.named) if k != gone]
        values = [own for k, own in enumerate(fitted.values) if k != gone]
        steps.pop(gone)
