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
from armid_ros.diagnosis.search.candidates import Group
from armid_ros.diagnosis.search.fit import fit, Fitted, Start, Told
from armid_ros.diagnosis.search.forward import Search
from armid_ros.diagnosis.search.held_out import Trial
from armid_ros.diagnosis.search.memoized_arm import memoized_arm, plain_arm
from armid_ros.diagnosis.search.patch import Named
from armid_ros.diagnosis.search.prune import doubtful, pruned, stands
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.refine import Workspace
from armid_ros.diagnosis.search.resampled import widened
from armid_ros.diagnosis.search.round import Round
from armid_ros.diagnosis.search.step import Step, Survey, Taken
from armid_ros.diagnosis.search.view import View
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
    survey, last = way.first, way.last
    minor = () if last is None else last.there
    whole = None if survey is None else survey.total, 1 if survey is None else survey.tried
    taken = [*way.taken, *_friction(question, way.taken, evidence, settings, whole)]
    reference = fit(
        question.arm, (), evidence.data, evidence.sigma, question.base, None, question.told
    )
    change = way.change if question.beside is question.arm else None
    steps, fitted = pruned(question, taken, evidence, settings, change)
    by_chance = 0.0 if last is None else last.by_chance
    fitted = widened(fitted, evidence, question.told, by_chance)
    said = {own.effect.name for own in fitted.named}
    small = tuple(trial for trial in minor if trial.group.effect.name not in said)
    return Explanation(
        question.arm,
        question.base,
        fitted,
        reference,
        steps,
        survey,
        evidence,
        small,
        question.told,
        by_chance,
        way.considered,
        baseline,
    )


def _friction(
    question: Question,
    taken: Sequence[Taken],
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
    named, start = [one.named for one in taken], Start([one.values for one in taken])
    fitted = fit(arm, named, evidence.data, evidence.sigma, base, start, question.beside_told)
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
                weak[k] = doubtful(trial)
                continue
            total = power if whole[0] is None else whole[0]
            steps[k] = Step(trial, (), (trial,), total, whole[1], least)
            here = Round(evidence, work, settings, problem, beside, total, whole[1])
            if not stands(steps[k], here):
                weak[k] = doubtful(trial)
        if not weak:
            break
        _, column, value = alive.pop(max(weak, key=lambda k: weak[k]))
        view = view.dropped(column, value)
        gone.append(column)
    return [
        Taken(Named(effect, (0,)), steps[k], np.array([value]))
        for k, (effect, _, value) in alive.items()
    ]
