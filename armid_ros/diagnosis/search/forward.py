# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Causes taken one after the other: the one that explains most, until none passes.

What nothing explains is known in the end only. Where it shows that a lead decides nothing, the
way is gone again; places that were reached before are not looked at again.

"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.candidates import Candidates, candidates
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.memoized_arm import memoized_arm
from armid_ros.diagnosis.search.patch import Named
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.refine import Workspace
from armid_ros.diagnosis.search.rivals import undecided
from armid_ros.diagnosis.search.round import Before, beside_fit, Later, Round
from armid_ros.diagnosis.search.step import Look, look_at, Step, Survey, Taken
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Way:
    """
    Causes in the order in which they were taken.

    Attributes
    ----------
    taken : tuple of Taken
        The causes.
    first, last : Survey or None
        The first look at all causes, and the last one.
    change : ndarray, shape (r,), or None
        What was added to what is free of the arm in the last fit.
    considered : frozenset of str
        Names without which the search could have gone another way.

    """

    taken: tuple[Taken, ...]
    first: Survey | None
    last: Survey | None
    change: FloatArray | None = None
    considered: frozenset[str] = frozenset()


@dataclass(frozen=True)
class _Place:
    """What was taken on a way, the fit beside which it goes on, and a look at all causes there."""

    named: tuple[Named, ...]
    values: tuple[FloatArray, ...]
    current: Fitted
    found: Candidates
    before: Before | None
    look: Look
    next: dict[Hashable, _Place] = field(default_factory=dict)


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
        Recordings in which nothing was wrong.
    unseen : Evidence or None
        More data of the same day, which nothing is fitted to.

    """

    question: Question
    evidence: Evidence
    settings: DiagnosisSettings
    baseline: Baseline | None = None
    unseen: Evidence | None = None

    def forward(self, start: Sequence[Taken] = ()) -> Way:
        """Take causes beside those to start with as long as any passes."""
        if not self.question.most:
            return Way(tuple(start), None, None)
        steps = [one.step for one in start]
        named, values = [one.named for one in start], [one.values for one in start]
        first = self._fitted_place(named, values, None)
        way = self._way(first, steps, 0.0)
        assert way.last is not None
        width, considered = way.last.most, self._considered(way)
        here = replace(first.look.here, total=None, before=None, width=width)
        found = [one.step for one in way.taken[len(start) :]]
        if any(undecided(step.trial, step.ranking, here) for step in found):
            way = self._way(first, steps, width)
        return replace(way, considered=considered | self._considered(way))

    def _considered(self, way: Way) -> frozenset[str]:
        """Return what was taken or could have been, and what takes most of the rest."""
        arm = self.question.arm
        trials = [trial for one in way.taken for trial in (one.step.trial, *one.step.rivals)]
        trials += [] if way.last is None else way.last.ranking[:1]
        effects = [trial.group.effect for trial in trials]
        zeros = [np.zeros(len(effect.parameters(arm.robot))) for effect in effects]
        words = [e.named_as(values, arm) for e, values in zip(effects, zeros, strict=True)]
        names = {word.name for said in words for word, _ in said}
        return frozenset(names | {effect.name for effect in self.question.unknown})

    def _way(self, place: _Place, steps: Sequence[Step], width: float) -> Way:
        """Go from a place, where a lead of less than some squares decides nothing."""
        first, taken = place.look.survey, list(steps)
        named, values = list(place.named), list(place.values)
        for left in range(self.question.most, 0, -1):
            step = place.look.step(width)
            if step is None:
                break
            taken.append(step)
            named, values = self._and_named(place, step)
            if left > 1:
                place = self._after(place, step)
                named, values = list(place.named), list(place.values)
        rows = zip(named, taken, values, strict=True)
        return Way(
            tuple(Taken(*row) for row in rows), first, place.look.survey, place.current.change
        )

    def _after(self, place: _Place, step: Step) -> _Place:
        """Return the place behind a step."""
        group = step.trial.group
        way = group.key, group.effect.shape
        if way not in place.next:
            named, values = self._and_named(place, step)
            if group.effect.linear:
                arm = place.current.arm
                before = None if place.before is None else place.before.and_columns(arm, group)
                here = place.look.here
                beside = here.beside.and_columns(group)
                here = replace(here, beside=beside, before=before, known=None)
                others = tuple(one for one in place.found.groups if one.key != group.key)
                found = replace(place.found, groups=others)
                look = look_at(others, here)
                after = replace(place, found=found, before=before, look=look, next={})
                place.next[way] = replace(after, named=tuple(named), values=tuple(values))
            else:
                total, change = place.look.survey.total, place.current.change
                place.next[way] = self._fitted_place(named, values, total, change)
        return place.next[way]

    def _and_named(self, place: _Place, step: Step) -> tuple[list[Named], list[FloatArray]]:
        group = step.trial.group
        start = np.zeros(len(group.effect.parameters(self.question.arm.robot)))
        start[list(group.kept)] = step.trial.values
        return [*place.named, Named(group.effect, group.kept)], [*place.values, start]

    def _fitted_place(
        self,
        named: Sequence[Named],
        values: Sequence[FloatArray],
        total: float | None,
        change: FloatArray | None = None,
    ) -> _Place:
        """Fit what is named, from values and a change of the body on, and look beside it."""
        question, data, sigma = self.question, self.evidence.data, self.evidence.sigma
        arm, base = question.beside, question.beside_base
        told = question.beside_told
        current = fit(arm, named, data, sigma, base, Start(values, change), told)
        found = candidates(current, data, sigma, question.kinds(self.settings.kinds))
        problem, beside = beside_fit(found, current, self.evidence)
        before = self._before(current)
        work = Workspace(memoized_arm(current.arm), data)
        here = Round(self.evidence, work, self.settings, problem, beside, total, before=before)
        look = look_at(found.groups, here)
        if named:
            named, values = current.named, current.values
        return _Place(tuple(named), tuple(values), current, found, before, look)

    def _before(self, current: Fitted) -> Before | None:
        """Return what other recordings show beside an arm: those from before, and unseen ones."""
        question, unseen = self.question, self.unseen
        told = question.beside_told
        if self.baseline is None or told is None:
            return None
        before = Before(self.baseline, told, current.change)
        if unseen is None:
            return before
        there = fit(
            question.beside,
            current.named,
            unseen.data,
            unseen.sigma,
            question.beside_base,
            Start(current.values),
            told,
            known=current.estimate,
        )
        rank = len(current.change)
        pairs = zip(there.residual, there.columns, strict=True)
        left = [rest - columns[:, :, :rank] @ current.change for rest, columns in pairs]
        return replace(before, later=Later.of(unseen, there.columns, left))
