# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One explanation: which effects, added to an arm as it is or to one that is fitted anew."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.candidates import Candidates, candidates, effect_rows
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.fit import fit, Fitted
from armid_ros.diagnosis.patch import Named
from armid_ros.diagnosis.problem import (
    make_problem,
    Problem,
    project,
    Projection,
    weighted_rows,
)
from armid_ros.diagnosis.refine import Workspace
from armid_ros.diagnosis.remembering import remembering
from armid_ros.diagnosis.rivals import imitates, not_beaten
from armid_ros.diagnosis.search import next_step, Step, Survey
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

#: A fit of all parameters that takes less than this of a joint's loss tells that they were right.
_ALIKE = 1.05


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
    start: Explanation | None = None,
) -> Explanation:
    """Search forward from an arm, or from what explains a part already, fit, prune backward."""
    reference = current = fit(arm, (), data, sigma, base)
    steps: list[Step] = []
    survey: Survey | None = None
    named: list[Named] = []
    losses = before = joint_losses_of(reference, data, sigma)
    if start is not None:
        current, steps, survey = start.fitted, list(start.steps), start.survey
        named, losses = list(current.named), start.losses
    found: Candidates | None = None
    total = _excess(reference, data, sigma)
    problem, free = None, []
    while len(steps) < most_steps:
        gap = bool(np.any(losses > settings.consistent_loss))
        if not gap and (survey is not None or base is None):
            break
        if found is None:
            found = candidates(current, data, sigma, settings.kinds)
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
        step, seen, problem = next_step(problem, free, groups, work, total)
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
            losses, found = joint_losses_of(current, data, sigma), None
    if len(named) > (0 if start is None else len(start.steps)):
        current = fit(arm, named, data, sigma, base, _start(named, steps, arm))
        kept = _prune(current, data, sigma, steps, settings)
        if len(kept) < len(named):
            named = [current.named[k] for k in kept]
            steps = [steps[k] for k in kept]
            current = fit(arm, named, data, sigma, base)
        losses = joint_losses_of(current, data, sigma)
        steps = _doubts(current, data, sigma, steps, settings)
    return Explanation(base, current, reference, tuple(steps), survey, losses, before)


def as_described(
    explanation: Explanation,
    described: Explanation,
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    settings: DiagnosisSettings,
) -> Explanation:
    """Return the same names in the arm as described, where no more than they is needed."""
    if not explanation.steps:
        return explanation
    fitted = fit(arm, explanation.fitted.named, data, sigma, None)
    losses = joint_losses_of(fitted, data, sigma)
    if not no_worse(losses, explanation.losses, settings):
        return explanation
    return replace(
        described, fitted=fitted, steps=explanation.steps, survey=explanation.survey, losses=losses
    )


def no_worse(described: FloatArray, fitted: FloatArray, settings: DiagnosisSettings) -> bool:
    """Return whether a model as described leaves each joint no more than a fit of it does."""
    return bool(np.all(described < np.maximum(settings.consistent_loss, _ALIKE * fitted)))


def _start(named: Sequence[Named], steps: Sequence[Step], arm: ArmModel) -> list[FloatArray]:
    """Return where a fit starts: the values a name was found with."""
    result = []
    for own, step in zip(named, steps, strict=True):
        values = np.zeros(len(own.effect.parameters(arm.robot)))
        lower, upper = own.effect.bounds()
        values[list(own.kept)] = step.trial.score.values
        result.append(np.clip(values, lower, upper))
    return result


def joint_losses_of(
    fitted: Fitted, data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> FloatArray:
    lefts = weighted_rows(fitted.residual, data, sigma)
    squares = np.sum([np.sum(left**2, axis=0) for left in lefts], axis=0)
    count = np.sum([part.told.sum(axis=0) for part in data], axis=0)
    return np.asarray(squares / np.maximum(count, 1))


def _excess(fitted: Fitted, data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> FloatArray:
    """Return the sum of squares beyond the noise of each joint, shape (n,)."""
    count = np.sum([part.told.sum(axis=0) for part in data], axis=0)
    return np.asarray(np.maximum(joint_losses_of(fitted, data, sigma) - 1.0, 0.0) * count)


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
    view = View.of(fitted, data, sigma)
    for k in reversed(range(len(steps))):
        gone = [other for other in range(len(steps)) if other not in kept]
        problem, projection, columns = view.without(k, gone)
        trial = try_group(problem, projection, steps[k].trial.score, columns, settings)
        if not acceptable(trial, problem, projection.rest(problem.y), settings):
            kept.remove(k)
    return kept


def _doubts(
    fitted: Fitted,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    steps: Sequence[Step],
    settings: DiagnosisSettings,
) -> list[Step]:
    """Ask for every name again which others are possible, now that the rest is known."""
    if len(steps) < 2:
        return list(steps)
    view = View.of(fitted, data, sigma)
    arm = remembering(fitted.arm)
    named = {own.effect.name for own in fitted.named}
    result = []
    for k, step in enumerate(steps):
        rivals = [r for r in step.rivals if r.score.group.effect.name not in named]
        problem, projection, columns = view.without(k, ())
        own = try_group(problem, projection, step.trial.score, columns, settings)
        left = projection.rest(problem.y)
        tried = []
        for rival in rivals:
            group = rival.score.group
            rows = np.concatenate([effect_rows(arm, group.effect, part) for part in data])
            weighted = rows[:, :, list(group.kept)] * problem.weight[:, :, np.newaxis]
            tried.append(try_group(problem, projection, rival.score, weighted, settings))
        tried = [t for t in tried if acceptable(t, problem, left, settings)]
        left_over = not_beaten([own, *tried], problem, left, settings)
        doubtful = tuple(t for t in left_over if not imitates(t, own))
        result.append(replace(step, rivals=doubtful))
    return result


@dataclass(frozen=True)
class View:
    """A fitted arm as a linear problem, in which names can be taken away again."""

    problem: Problem
    spans: tuple[tuple[int, int, int], ...]
    values: FloatArray

    @staticmethod
    def of(fitted: Fitted, data: Sequence[Trajectory], sigma: Sequence[FloatArray]) -> View:
        problem = make_problem(data, sigma, fitted.residual, list(fitted.columns))
        spans, start = [], problem.x.shape[2] - len(fitted.estimate.values)
        for own in fitted.named:
            stop = start + len(own.kept)
            end = stop + len(own.effect.shape)
            spans.append((start, stop, end))
            start = end
        return View(problem, tuple(spans), fitted.estimate.values)

    def without(self, k: int, gone: Sequence[int]) -> tuple[Problem, Projection, FloatArray]:
        """Return the problem as if one name and others were not there, and its columns."""
        start, stop, end = self.spans[k]
        size = self.problem.x.shape[2]
        offset = size - len(self.values)
        y = self.problem.y
        for other in (k, *gone):
            first, last, _ = self.spans[other]
            values = self.values[first - offset : last - offset]
            y = y + self.problem.x[:, :, first:last] @ values
        away = {c for other in gone for c in range(self.spans[other][0], self.spans[other][2])}
        free = [c for c in range(size) if not start <= c < end and c not in away]
        problem = replace(self.problem, y=y)
        return problem, project(problem, free), self.problem.x[:, :, start:stop]
