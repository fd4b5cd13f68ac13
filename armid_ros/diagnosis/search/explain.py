# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One explanation of a gap: causes accepted one after the other, in an arm as given or fitted anew.

The candidate with the largest held-out gain is accepted first, and the search is repeated on what
it leaves. Friction and offsets without given values are nuisance parameters of every candidate,
and those that matter are named in the end.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.discrepancy import Discrepancy
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import Workspace
from armid_ros.diagnosis.search.candidates import Candidates, candidates, nuisance_of, Question
from armid_ros.diagnosis.search.elimination import BackwardElimination, doubtful, LinearFit, pruned
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.fit import fit, Fitted, Start, with_values_of
from armid_ros.diagnosis.search.held_out import with_jackknife_std
from armid_ros.diagnosis.search.screening import screen_candidates, Screening
from armid_ros.diagnosis.search.search_state import BaselineRows, SearchState, UnseenRows
from armid_ros.diagnosis.search.trial import (
    AcceptedCause,
    Candidate,
    SelectedEffect,
    Step,
    Survey,
    Trial,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import Effect
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np


def explain(
    question: Question,
    evidence: Evidence,
    settings: DiagnosisSettings,
    start: Sequence[AcceptedCause] = (),
    baseline: Baseline | None = None,
    unseen: Evidence | None = None,
) -> Explanation:
    """Accept causes as long as any passes, then name the friction that matters, and prune."""
    search = Search(question, evidence, settings, baseline, unseen)
    path = search.forward(start)
    if question.since:
        path = search.exchanged(path)
    survey, last = path.first, None if path.last is None else path.last.screening.survey
    whole = None if survey is None else survey.total, 1 if survey is None else survey.tried
    retrial = BackwardElimination(question, evidence, settings)
    friction, tried = _friction(retrial, path.taken, whole)
    taken, minor = [*path.taken, *friction], () if last is None else last.there
    instead = search.replacing_offsets(friction, path)
    if instead:
        others, _ = _friction(retrial, [*path.taken, *instead], whole)
        fewer = len(instead) + len(_offsets(others)) < len(_offsets(friction))
        if fewer or not question.body_is_free:
            taken, minor = [*path.taken, *instead, *others], ()
    if survey is not None:
        survey = survey.and_nuisance(tried, settings.thresholds.least_visible)
    change = path.change if question.nuisance_arm is question.arm else None
    steps, fitted = pruned(retrial, taken, change)
    steps = steps if question.since else without_later(steps)
    by_chance = 0.0 if last is None else last.by_chance
    fitted = with_jackknife_std(fitted, evidence, question.prior, by_chance)
    said = {own.effect.name for own in fitted.named}
    small = tuple(trial for trial in minor if trial.candidate.effect.name not in said)
    return Explanation(
        question.arm,
        question.base,
        fitted,
        retrial.reference,
        steps,
        survey,
        evidence,
        small,
        question.prior,
        by_chance,
        baseline,
    )


def without_later(steps: Sequence[Step]) -> tuple[Step, ...]:
    """
    Return steps without rivals that are a name accepted later, or a rival of one.

    They explain what that name explains, which nothing explained yet in the earlier step.

    """
    result: list[Step] = []
    later: set[tuple[str, tuple[str, ...]]] = set()
    for step in reversed(steps):
        rivals = tuple(trial for trial in step.rivals if trial.candidate.key[:2] not in later)
        result.append(replace(step, rivals=rivals))
        later.update(trial.candidate.key[:2] for trial in (step.trial, *step.rivals))
    return tuple(result[::-1])


@dataclass(frozen=True)
class SearchPoint:
    """A place of the search: the accepted causes, the fit with them, and a look at all others."""

    named: tuple[SelectedEffect, ...]
    values: tuple[FloatArray, ...]
    current: Fitted
    found: Candidates
    before: BaselineRows | None
    screening: Screening


@dataclass(frozen=True)
class SelectionPath:
    """
    Causes in the order in which they were accepted.

    Attributes
    ----------
    taken : tuple of AcceptedCause
        The causes.
    first : Survey or None
        What the first look at all candidates showed.
    last : SearchPoint or None
        The place of the last look.
    change : ndarray, shape (r,), or None
        Change of the base parameters of the arm in the last fit.

    """

    taken: tuple[AcceptedCause, ...]
    first: Survey | None
    last: SearchPoint | None
    change: FloatArray | None = None

    @property
    def left(self) -> float:
        """Held-out squares that the last look was to explain."""
        return np.inf if self.last is None else self.last.screening.state.power


@dataclass(frozen=True)
class Search:
    """
    A search for the causes of a gap.

    Attributes
    ----------
    question : Question
        What is asked of which arm.
    evidence : Evidence
        The data.
    settings : DiagnosisSettings
        Library and thresholds.
    baseline : Baseline or None
        Recordings from when nothing was wrong.
    unseen : Evidence or None
        Further data of the day in question, which nothing is fitted to.

    """

    question: Question
    evidence: Evidence
    settings: DiagnosisSettings
    baseline: Baseline | None = None
    unseen: Evidence | None = None

    def forward(
        self, start: Sequence[AcceptedCause] = (), total: float | None = None
    ) -> SelectionPath:
        """Accept causes in addition to those to start with as long as any passes."""
        if not self.question.most:
            return SelectionPath(tuple(start), None, None)
        point = self.first_point(start, total)
        first, steps = point.screening.survey, [one.step for one in start]
        named, values = point.named, point.values
        for remaining in range(self.question.most, 0, -1):
            step = point.screening.step()
            if step is None:
                break
            steps.append(step)
            one = _of(step, self.question)
            named, values = (*point.named, one.named), (*point.values, one.values)
            if remaining > 1:
                point = self._after(point, step, named, values)
                named, values = point.named, point.values
        rows = zip(named, steps, values, strict=True)
        return SelectionPath(
            tuple(AcceptedCause(*row) for row in rows), first, point, point.current.change
        )

    def exchanged(self, path: SelectionPath, most: int = 1) -> SelectionPath:
        """
        Ask anew for each cause but the last, beside those that were accepted after it.

        The cause that is accepted first is compared with others while all the rest is unexplained:
        one that takes a part of the rest as well is ahead of the right one, and causes of the rest
        are its rivals. Each has the rivals that it has beside the others. So many are exchanged at
        the most, for what leaves no more in the end. To ask for one takes as long as a first look.

        """
        taken = list(path.taken)
        for k in range(len(taken) - 1):
            assert path.first is not None
            others = [*taken[:k], *taken[k + 1 :]]
            step = self.first_point(others, path.first.total).screening.step()
            same = step is None or step.trial.candidate.key[:2] == taken[k].key
            if step is not None and not same and most:
                start = [*others, _of(step, self.question)]
                again = self.forward(start, path.first.total)
                if again.left <= path.left:
                    return self.exchanged(replace(again, first=path.first), most - 1)
            rivals = step.rivals if step is not None and same else ()
            taken[k] = taken[k]._replace(step=replace(taken[k].step, rivals=rivals))
        return replace(path, taken=tuple(taken))

    def first_point(
        self, start: Sequence[AcceptedCause] = (), total: float | None = None
    ) -> SearchPoint:
        """Fit the causes to start with, and look at all others; see `SearchState.total`."""
        return self._fitted_point(
            [one.named for one in start], [one.values for one in start], total
        )

    def replacing_offsets(
        self, friction: Sequence[AcceptedCause], path: SelectionPath
    ) -> list[AcceptedCause]:
        """
        Return the causes that win where the named offsets are no longer nuisance parameters.

        A gain of a joint that holds much weight is an offset and a little more. Every joint has
        friction, but not every joint has an offset: what takes the place of one has to win among
        all candidates. A free body hides most of these: where it is free, the causes are used only
        if they make more offsets needless than they are themselves.

        """
        question, point = self.question, path.last
        asked = _offsets(friction)
        if not asked or point is None or point.before is not None:
            return []
        arm, base = question.nuisance_arm, question.nuisance_base
        assert base is not None
        names = [(p.name, p.joint) for p in arm.parameters]
        where = [
            names.index((p.name, p.joint)) for one in asked for p in one.parameters(arm.robot)
        ]
        state, values = point.screening.state, _base_values(point.current, base)
        for column in sorted(np.flatnonzero(np.isin(base.independent, where)), reverse=True):
            state = state.without(int(column), float(values[column]))
        assert path.first is not None
        state = replace(state, total=max(path.first.total, float(np.sum(state.residual**2))))
        found: list[AcceptedCause] = []
        others = point.found.candidates
        for _ in range(min(len(asked), self.settings.thresholds.few_causes)):
            screening = screen_candidates(others, state)
            step = screening.step()
            if step is None:
                break
            found.append(_of(step, question))
            taken = step.trial.candidate
            state = replace(
                screening.state, nuisance=state.nuisance.and_columns(taken), known=None
            )
            others = tuple(one for one in others if one.key != taken.key)
        return found

    def _after(
        self,
        point: SearchPoint,
        step: Step,
        named: Sequence[SelectedEffect],
        values: Sequence[FloatArray],
    ) -> SearchPoint:
        """Return the place after a step, with the names that there are then, and their values."""
        candidate = step.trial.candidate
        if not candidate.effect.linear or named[-1].effect is not candidate.effect:
            return self._fitted_point(
                named, values, point.screening.survey.total, point.current.change
            )
        arm, state = point.current.arm, point.screening.state
        before = None if point.before is None else point.before.and_columns(arm, candidate)
        nuisance = state.nuisance.and_columns(candidate)
        others = tuple(one for one in point.found.candidates if one.key != candidate.key)
        return replace(
            point,
            named=tuple(named),
            values=tuple(values),
            found=replace(point.found, candidates=others),
            before=before,
            screening=screen_candidates(
                others, replace(state, nuisance=nuisance, before=before, known=None)
            ),
        )

    def _fitted_point(
        self,
        named: Sequence[SelectedEffect],
        values: Sequence[FloatArray],
        total: float | None,
        change: FloatArray | None = None,
    ) -> SearchPoint:
        """Fit what is named, from values and a change of the body on, and try all candidates."""
        question = self.question
        arm, base = question.nuisance_arm, question.nuisance_base
        prior = question.nuisance_prior
        current = fit(arm, named, self.evidence, base, Start(values, change), prior)
        found = candidates(current, self.evidence, question.kinds(self.settings.kinds))
        problem, nuisance = nuisance_of(found, current, self.evidence)
        nuisance = replace(nuisance, discrepancy=_discrepancy(current, base))
        before = self._before(current)
        work = Workspace(memoized_arm(current.arm), self.evidence.data)
        state = SearchState(
            self.evidence,
            work,
            self.settings,
            problem,
            nuisance,
            total,
            before=before,
            since=question.since,
        )
        screening = screen_candidates(found.candidates, state)
        if named:
            named, values = current.named, current.values
        return SearchPoint(tuple(named), tuple(values), current, found, before, screening)

    def _before(self, current: Fitted) -> BaselineRows | None:
        """Return the baseline and unseen recordings, with their residuals of a fitted arm."""
        question, unseen = self.question, self.unseen
        prior = question.nuisance_prior
        if self.baseline is None or prior is None:
            return None
        before = BaselineRows(self.baseline, prior, current.change)
        if unseen is None:
            return before
        arm, base = question.nuisance_arm, question.nuisance_base
        there = with_values_of(current, arm, unseen, base, prior)
        rank = len(current.change)
        pairs = zip(there.residual, there.columns, strict=True)
        residual = [rest - columns[:, :, :rank] @ current.change for rest, columns in pairs]
        return replace(before, later=UnseenRows.of(unseen, there.columns, residual))


def _discrepancy(current: Fitted, base: BaseParameters | None) -> tuple[tuple[int, float], ...]:
    """Return the places of a model discrepancy among the base parameters, and its values."""
    if base is None:
        return ()
    names = {quantity.name for quantity in Discrepancy.quantities}
    values = _base_values(current, base)
    return tuple(
        (point, float(values[point]))
        for point, column in enumerate(base.independent)
        if base.standard[column].name in names
    )


def _base_values(fitted: Fitted, base: BaseParameters) -> FloatArray:
    """Return the values of the base parameters, which standard ones share, shape (r,)."""
    return base.values(fitted.arm.theta[: len(base.standard)])


def _offsets(friction: Sequence[AcceptedCause]) -> list[Effect]:
    """Return those of the effects without given values that are no friction."""
    return [one.named.effect for one in friction if not one.named.effect.traits.friction]


def _of(step: Step, question: Question) -> AcceptedCause:
    """Return a step as an accepted effect, with the values of its trial."""
    candidate = step.trial.candidate
    values = np.zeros(len(candidate.effect.parameters(question.arm.robot)))
    values[list(candidate.kept)] = step.trial.values
    effect, first = candidate.effect.when_found(values)
    kept = candidate.kept if effect is candidate.effect else tuple(range(len(first)))
    return AcceptedCause(SelectedEffect(effect, kept), step, first)


def _friction(
    retrial: BackwardElimination, taken: Sequence[AcceptedCause], whole: tuple[float | None, int]
) -> tuple[list[AcceptedCause], list[Trial]]:
    """
    Return the friction and offsets without given values that stand, and the first trials of all.

    All of them were nuisance parameters of every candidate. The one that is likeliest to be chance
    is dropped first, as a needless one distorts the values of the others, until all that remain
    are significant, however small their gain: what is left out biases the values of causes. Where
    a change is asked, they have to be material as well.

    """
    question, evidence = retrial.question, retrial.evidence
    if not question.unknown:
        return [], []
    arm, base = question.nuisance_arm, question.nuisance_base
    assert base is not None
    named, start = [one.named for one in taken], Start([one.values for one in taken])
    fitted = fit(arm, named, evidence, base, start, question.nuisance_prior)
    view = LinearFit.of(fitted, evidence)
    where = {int(column): k for k, column in enumerate(base.independent)}
    names = [(p.name, p.joint) for p in arm.parameters]
    values = _base_values(fitted, base)
    alive = []
    for effect in question.unknown:
        parameter = effect.parameters(arm.robot)[0]
        column = names.index((parameter.name, parameter.joint))
        if column in where:
            alive.append((effect, where[column], float(values[where[column]])))
    least = retrial.settings.thresholds.misfit_share if question.since else None
    gone: list[int] = []
    tried: list[Trial] = []
    while True:
        there: list[AcceptedCause] = []
        weak: list[tuple[tuple[float, float], int]] = []
        seen: list[Trial] = []
        for k, (effect, column, value) in enumerate(alive):
            candidate = Candidate(effect, slice(0, 1), (0,), arm.robot)
            again = view.trial(candidate, [column], [value], gone)
            if again.trial is None:
                weak.append((doubtful(None), k))
                continue
            seen.append(again.trial)
            total = again.power if whole[0] is None else whole[0]
            step = Step(again.trial, (), (again.trial,), total, whole[1], least)
            if retrial.stands(step, again):
                there.append(AcceptedCause(SelectedEffect(effect, (0,)), step, np.array([value])))
            else:
                weak.append((doubtful(again.trial), k))
        tried = tried or seen
        if not weak:
            return there, tried
        _, column, value = alive.pop(max(weak)[1])
        view = view.dropped(column, value)
        gone.append(column)
