# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One explanation: which effects, added to an arm as it is or to one that is fitted anew."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.candidates import Candidates, candidates, remembering
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.fit import fit, Fitted, Named
from armid_ros.diagnosis.problem import make_problem, Problem, project
from armid_ros.diagnosis.search import next_step, Step, Survey, Workspace
from armid_ros.diagnosis.selection import (
    acceptable,
    joint_losses,
    try_group,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Explanation:
    """
    What a search came to.

    Attributes
    ----------
    base : BaseParameters or None
        What was free of the arm; None where it was taken as described.
    fitted : Fitted
        The arm with all that was named.
    reference : Fitted
        The same without.
    steps : tuple of Step
        The names in the order in which they were found.
    survey : Survey or None
        The first look at all groups; None where there was no need.
    losses : ndarray, shape (n,)
        Loss of each joint with the patched arm.
    reference_losses : ndarray, shape (n,)
        Loss of each joint before.

    """

    base: BaseParameters | None
    fitted: Fitted
    reference: Fitted
    steps: tuple[Step, ...]
    survey: Survey | None
    losses: FloatArray
    reference_losses: FloatArray


def explain(
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    base: BaseParameters | None,
    settings: DiagnosisSettings,
    most_steps: int,
    progress: Progress | None = None,
) -> Explanation:
    """Search forward from an arm, fit, and prune backward."""
    reference = current = fit(arm, (), data, sigma, base)
    steps: list[Step] = []
    survey: Survey | None = None
    named: list[Named] = []
    losses = before = _joint_losses(reference, data, sigma)
    found: Candidates | None = None
    problem, free = None, []
    while len(steps) < most_steps:
        gap = bool(np.any(losses > settings.consistent_loss))
        if not gap and (survey is not None or base is None):
            break
        if found is None:
            found = candidates(current.arm, data, settings.library)
            columns = [
                np.concatenate(pair, axis=2)
                for pair in zip(found.columns, current.columns, strict=True)
            ]
            problem = make_problem(data, sigma, current.residual, columns)
            size = columns[0].shape[2]
            free = list(range(size - current.columns[0].shape[2], size))
        assert problem is not None
        work = Workspace(remembering(current.arm), tuple(data), settings)
        taken = {(n.effect.name, n.effect.joints, n.kept) for n in named}
        groups = [g for g in found.groups if g.key not in taken]
        step, seen, problem = next_step(problem, free, groups, work)
        survey = survey or seen
        if step is None:
            break
        steps.append(step)
        group = step.trial.score.group
        named.append(Named(group.effect, group.kept))
        if progress is not None:
            progress(float(np.max(step.after)), group.effect.name)
        if group.effect.linear and not group.effect.shapes:
            free += range(group.columns.start, group.columns.stop)
            projection = project(problem, free)
            losses = joint_losses(problem, projection.rest(problem.y))
        else:
            current = fit(arm, named, data, sigma, base, _start(named, steps, arm))
            named = list(current.named)
            losses, found = _joint_losses(current, data, sigma), None
    if named:
        current = fit(arm, named, data, sigma, base, _start(named, steps, arm))
        kept = _prune(current, data, sigma, steps, settings)
        if len(kept) < len(named):
            named = [current.named[k] for k in kept]
            steps = [steps[k] for k in kept]
            current = fit(arm, named, data, sigma, base)
        losses = _joint_losses(current, data, sigma)
    return Explanation(base, current, reference, tuple(steps), survey, losses, before)


def _start(named: Sequence[Named], steps: Sequence[Step], arm: ArmModel) -> list[FloatArray]:
    """Return where a fit starts: the values a name was found with."""
    result = []
    for own, step in zip(named, steps, strict=True):
        values = np.zeros(len(own.effect.parameters(arm.robot)))
        lower, upper = own.effect.bounds()
        values[list(own.kept)] = step.trial.score.values
        result.append(np.clip(values, lower, upper))
    return result


def _joint_losses(
    fitted: Fitted, data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> FloatArray:
    total = np.zeros(data[0].told.shape[1])
    count = np.zeros_like(total)
    for left, part, s in zip(fitted.residual, data, sigma, strict=True):
        total += np.sum((left * part.told / s) ** 2, axis=0)
        count += part.told.sum(axis=0)
    return np.asarray(total / np.maximum(count, 1))


def _prune(
    fitted: Fitted,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    steps: Sequence[Step],
    settings: DiagnosisSettings,
) -> list[int]:
    """Return which names the others do not make needless."""
    kept = list(range(len(steps)))
    if len(steps) < 2:
        return kept
    problem = make_problem(data, sigma, fitted.residual, list(fitted.columns))
    size = problem.x.shape[2]
    spans, start = [], size - len(fitted.estimate.values)
    for own in fitted.named:
        stop = start + len(own.kept)
        spans.append((start, stop, stop + len(own.effect.shape)))
        start = stop + len(own.effect.shape)
    values = fitted.estimate.values
    offset = size - len(values)
    for k in reversed(range(len(steps))):
        start, stop, end = spans[k]
        own_columns = problem.x[:, :, start:stop]
        restored = own_columns @ values[start - offset : stop - offset]
        without = _with_target(problem, problem.y + restored)
        gone = {
            c
            for other in range(len(steps))
            if other not in kept
            for c in range(spans[other][0], spans[other][2])
        }
        free = [c for c in range(size) if not start <= c < end and c not in gone]
        projection = project(without, free)
        score = steps[k].trial.score
        trial = try_group(without, projection, score, own_columns, settings)
        left = projection.rest(without.y)
        if not acceptable(trial, without, left, settings):
            kept.remove(k)
    return kept


def _with_target(problem: Problem, y: FloatArray) -> Problem:
    return Problem(problem.x, y, problem.weight, problem.fold, problem.products)
