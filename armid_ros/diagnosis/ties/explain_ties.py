# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an arm lacks that is tied to a machine beside it: the ties first, then what they leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Evidence, Workspace
from armid_ros.diagnosis.data.prepare import Prepared
from armid_ros.diagnosis.data.rows import make_problem
from armid_ros.diagnosis.search.candidates import candidates
from armid_ros.diagnosis.search.explain import explain
from armid_ros.diagnosis.search.explanation import Chosen, Explanation, NOISE
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.held_out import held_out
from armid_ros.diagnosis.search.look import look_at
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.round import Nuisance, Round
from armid_ros.diagnosis.search.trial import Candidate, Step, Survey, Taken, Trial
from armid_ros.diagnosis.search.view import View
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.ties.regression import rightly_described, TieRegression, without_bias
from armid_ros.diagnosis.ties.ties import Ties
from armid_ros.effects.tied import Tied
from armid_ros.model import BaseParameters
from armid_ros.recording import Recording
import numpy as np

#: Losses of two explanations that are as good as each other where masses are known or fitted.
_ALIKE = 1.05


def diagnose_ties(
    arm: ArmModel, recordings: Sequence[Recording], prepared: Prepared, settings: DiagnosisSettings
) -> Chosen | None:
    """
    Explain a gap by ties to a machine beside the arm, and by what is named in what they leave.

    Returns
    -------
    Chosen or None
        With the ties as its first names, or the arm as given if that is within its noise; None if
        there is no tie, and something else.

    """
    assert settings.partner is not None
    nothing = np.zeros(arm.robot.n_joints)
    regression = TieRegression(arm, tuple(recordings), prepared.used, settings)
    sure = cache(regression.sure)
    evidence = Evidence(prepared.data, tuple(prepared.sigma), tuple(prepared.sigma))
    start = Ties(arm, settings.partner, evidence, prepared.base, settings, sure)
    ties, fitted = start.find()
    if not fitted.named:
        return _within_its_noise(arm, prepared, settings)
    found = _explanation(ties, fitted)
    if _open(found, settings):
        most = settings.thresholds.many_causes
        question = Question(arm, prepared.base, arm, prepared.base, (), most)
        rows = zip(fitted.named, found.steps, fitted.values, strict=True)
        known = [Taken(*row) for row in rows]
        more = explain(question, found.evidence, settings, known)
        fitted = ties.surely(more.fitted.named)
        if not any(isinstance(own.effect, Tied) for own in fitted.named):
            return None
        found = _with_names_of(replace(more, survey=found.survey), fitted)
    springs = regression.springs(found, 'free')
    if rightly_described(regression.springs(found, 'known'), springs):
        found = _as_described(found, arm, settings)
        if found.base is None:
            springs = regression.springs(found, 'known')
    return Chosen(without_bias(found, springs), nothing, NOISE)


def _within_its_noise(
    arm: ArmModel, prepared: Prepared, settings: DiagnosisSettings
) -> Chosen | None:
    """
    Return the arm as described, if it leaves no more than the noise beside itself.

    A fit takes inertias away to get rid of the noise of accelerations; beside the fitted arm,
    where there is less of it, the described one would seem to be wrong.

    """
    evidence = Evidence(prepared.data, prepared.as_described, prepared.as_described)
    described = fit(arm, (), evidence.data, evidence.sigma, None)
    found = Explanation(arm, None, described, described, (), None, evidence)
    if _open(found, settings):
        return None
    return Chosen(found, np.zeros(arm.robot.n_joints), NOISE)


def _open(found: Explanation, settings: DiagnosisSettings) -> bool:
    limits = found.evidence.limits(found.fitted.residual, replace(settings, material=0.0))
    return bool(np.any(found.chi2_per_row > np.maximum(limits, settings.thresholds.same_fit)))


def _as_described(found: Explanation, arm: ArmModel, settings: DiagnosisSettings) -> Explanation:
    """Return the same names in the arm as described, where that explains as much."""
    evidence = found.evidence
    own = found.fitted
    fitted = fit(arm, own.named, evidence.data, evidence.sigma, None, Start(own.values))
    reference = fit(arm, (), evidence.data, evidence.sigma, None)
    described = replace(found, base=None, fitted=fitted, reference=reference)
    limits = evidence.limits(fitted.residual, settings)
    if np.any(described.chi2_per_row > np.maximum(limits, _ALIKE * found.chi2_per_row)):
        return found
    return described


def _explanation(ties: Ties, fitted: Fitted) -> Explanation:
    """Return what was fitted as steps, each tie judged beside the others, and its rivals."""
    reference = ties.fitted(())
    survey, rivals = _rivals(ties, reference, fitted)
    view = View.of(fitted, ties.evidence)
    share = ties.settings.thresholds.misfit_share
    steps = []
    for k in range(len(fitted.named)):
        again = view.trial_of(k)
        assert again.trial is not None
        steps.append(Step(again.trial, rivals, (again.trial,), again.power, survey.tried, share))
    base: BaseParameters | None = ties.base
    return Explanation(ties.arm, base, fitted, reference, tuple(steps), survey, ties.evidence)


def _rivals(ties: Ties, reference: Fitted, fitted: Fitted) -> tuple[Survey, tuple[Trial, ...]]:
    """Look at all of the library beside the ties as one cause; return what they do not beat."""
    evidence, settings = ties.evidence, ties.settings
    data, sigma = evidence.data, evidence.sigma
    found = candidates(reference, data, sigma, settings.kinds)
    rank, first = reference.columns[0].shape[2], found.columns[0].shape[2]
    stiffness = [rank + values.start for values, _ in fitted.places]
    blocks = [
        np.concatenate([others, tied[:, :, stiffness], free], axis=2)
        for others, free, tied in zip(
            found.columns, reference.columns, fitted.columns, strict=True
        )
    ]
    problem = make_problem(data, sigma, reference.residual, blocks)
    span = slice(first, first + len(stiffness))
    free = tuple(range(span.stop, span.stop + rank))
    loose = any(own.effect.shapes for own in fitted.named)
    kind = ties.partner.slack if loose else ties.partner.interaction
    whole = kind.on(ties.arm.robot, [own.effect.joints[0] for own in fitted.named])
    each = len(whole.quantities)
    kept = tuple(range(0, each * len(whole.joints), each))
    candidate = Candidate.of(whole, span, kept, ties.arm.robot)
    nuisance = Nuisance(free, reference.hold, reference.pull)
    trials, power = held_out(problem, free, [candidate], nuisance.hold, nuisance.pull)
    work = Workspace(memoized_arm(reference.arm), data)
    here = Round(evidence, work, settings, problem, nuisance, float(power.sum()))
    look = look_at(found.candidates, here)
    step, survey = look.step(), look.survey
    survey = replace(survey, ranking=(*trials, *survey.ranking), tried=survey.tried + 1)
    if step is None or not trials:
        return survey, ()
    others = [step.trial, *step.rivals]
    return survey, tuple(other for other in others if other.gain >= trials[0].gain)


def _with_names_of(found: Explanation, fitted: Fitted) -> Explanation:
    """Return an explanation with the names that a last fit kept."""
    kept = {(own.effect.name, own.effect.joints) for own in fitted.named}
    pairs = zip(found.fitted.named, found.steps, strict=True)
    steps = tuple(s for own, s in pairs if (own.effect.name, own.effect.joints) in kept)
    return replace(found, fitted=fitted, steps=steps)
