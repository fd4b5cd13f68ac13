# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an arm lacks that is tied to a machine beside it: the ties first, then what they leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.candidates import candidates, Group
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.fit import Fitted
from armid_ros.diagnosis.model_search import as_described, explain, Explanation, View
from armid_ros.diagnosis.problem import make_problem, Problem, project, Projection
from armid_ros.diagnosis.refine import Workspace
from armid_ros.diagnosis.remembering import remembering
from armid_ros.diagnosis.rivals import not_beaten
from armid_ros.diagnosis.search import next_step, Step, Survey
from armid_ros.diagnosis.selection import Score, Trial, try_group
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.tied import Ties
from armid_ros.diagnosis.tied_values import rightly_described, TieRegression, without_bias
from armid_ros.effects.tied import Partner, Tied
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np


def explain_tied(
    arm: ArmModel,
    partner: Partner,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    base: BaseParameters,
    settings: DiagnosisSettings,
    regression: TieRegression,
) -> tuple[Explanation, list[FloatArray]] | None:
    """
    Explain a gap by ties to a machine beside the arm, and by what is named in what they leave.

    Parameters
    ----------
    arm : ArmModel
        The arm as described.
    partner : Partner
        The machine and where there may be ties.
    data : sequence of Trajectory
        The data, with what moved beside the arm.
    sigma : sequence of ndarray, each (n,)
        Noise beside the arm without ties [N m].
    base : BaseParameters
        What a fit frees, so that a wrong mass is not taken for a spring.
    settings : DiagnosisSettings
        Thresholds and library.
    regression : TieRegression
        The same recordings for the ties alone, with what noise of angles does to them.

    Returns
    -------
    explanation : Explanation
        With the ties as its first names.
    sigma : list of ndarray
        Noise beside the arm as it is tied.

        None if there is no tie.

    """
    sure = cache(regression.sure)
    ties, fitted = Ties(arm, partner, tuple(data), tuple(sigma), base, settings, sure).find()
    if not fitted.named:
        return None
    noise = list(ties.sigma)
    found = _explanation(ties, fitted)
    if np.any(found.losses > settings.partial_loss):
        found = explain(arm, data, noise, base, settings, settings.most_steps, start=found)
        fitted = ties.surely(found.fitted.named)
        if not any(isinstance(own.effect, Tied) for own in fitted.named):
            return None
        if len(fitted.named) < len(found.fitted.named):
            found = _without(found, fitted, ties)
    springs = regression.springs(found, 'free')
    if rightly_described(regression.springs(found, 'known'), springs):
        described = explain(arm, data, noise, None, settings, 0)
        found = as_described(found, described, arm, data, noise, settings)
        if found.base is None:
            springs = regression.springs(found, 'known')
    return without_bias(found, springs, data, noise), noise


def within_its_noise(
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    settings: DiagnosisSettings,
) -> tuple[Explanation, list[FloatArray]] | None:
    """
    Return the arm as described, if it leaves no more than the noise beside itself.

    A fit takes inertias away to get rid of the noise of accelerations; beside the fitted arm,
    where there is less of it, the described one would seem to be wrong.

    """
    described = explain(arm, data, sigma, None, settings, 0)
    if np.any(described.losses > settings.partial_loss):
        return None
    return described, list(sigma)


def _explanation(ties: Ties, fitted: Fitted) -> Explanation:
    """Return what was fitted as steps, each tie judged beside the others, and its rivals."""
    reference = ties.fitted(())
    before, after = ties.losses(reference), ties.losses(fitted)
    survey, rivals = _rivals(ties, reference, fitted)
    view = View.of(fitted, ties.data, ties.sigma)
    steps = []
    for k, own in enumerate(fitted.named):
        problem, projection, columns = view.without(k, ())
        group = Group.of(own.effect, slice(0, columns.shape[2]), own.kept, ties.arm.robot)
        trial = _trial(group, problem, projection, columns, ties.settings)
        steps.append(Step(trial, rivals, (trial,), before, after, (trial,)))
    return Explanation(ties.base, fitted, reference, tuple(steps), survey, after, before)


def _rivals(ties: Ties, reference: Fitted, fitted: Fitted) -> tuple[Survey, tuple[Trial, ...]]:
    """Look at all of the library beside the ties as one cause; return what they do not beat."""
    data, sigma, settings = ties.data, ties.sigma, ties.settings
    found = candidates(reference, data, sigma, settings.kinds)
    rank, first = reference.columns[0].shape[2], found.columns[0].shape[2]
    sizes = [len(own.kept) + len(own.effect.shape) for own in fitted.named]
    stiffness = rank + np.cumsum([0, *sizes[:-1]])
    blocks = [
        np.concatenate([others, free, tied[:, :, stiffness]], axis=2)
        for others, free, tied in zip(
            found.columns, reference.columns, fitted.columns, strict=True
        )
    ]
    problem = make_problem(data, sigma, reference.residual, blocks)
    free, span = range(first, first + rank), slice(first + rank, problem.x.shape[2])
    loose = any(own.effect.shapes for own in fitted.named)
    kind = ties.partner.slack if loose else ties.partner.interaction
    whole = kind.on(ties.arm.robot, [own.effect.joints[0] for own in fitted.named])
    each = len(whole.quantities)
    kept = tuple(range(0, each * len(whole.joints), each))
    group = Group.of(whole, span, kept, ties.arm.robot)
    projection = project(problem, free)
    trial = _trial(group, problem, projection, problem.x[:, :, span], settings)
    work = Workspace(remembering(reference.arm), data, settings)
    step, survey, problem = next_step(problem, free, found.groups, work)
    survey = replace(survey, league=(trial, *survey.league), tried=survey.tried + 1)
    if step is None:
        return survey, ()
    left = projection.rest(problem.y)
    return survey, tuple(not_beaten([trial, *step.passing], problem, left, settings))


def _trial(
    group: Group,
    problem: Problem,
    projection: Projection,
    columns: FloatArray,
    settings: DiagnosisSettings,
) -> Trial:
    """Judge weighted columns (R, n, p) beside those that are free."""
    left = float(np.linalg.norm(projection.rest(columns)))
    visible = left / max(float(np.linalg.norm(columns)), 1e-300)
    nothing = np.zeros(columns.shape[2])
    score = Score(group, nothing, nothing, 0.0, visible)
    return try_group(problem, projection, score, columns, settings)


def _without(found: Explanation, fitted: Fitted, ties: Ties) -> Explanation:
    """Return an explanation with the names that a last fit kept."""
    kept = {(own.effect.name, own.effect.joints) for own in fitted.named}
    pairs = zip(found.fitted.named, found.steps, strict=True)
    steps = tuple(s for own, s in pairs if (own.effect.name, own.effect.joints) in kept)
    return replace(found, fitted=fitted, steps=steps, losses=ties.losses(fitted))
