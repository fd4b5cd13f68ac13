# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The forward search: name by name, until the noise is reached or nothing passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.candidates import Group
from armid_ros.diagnosis.problem import Problem, project, Projection
from armid_ros.diagnosis.refine import refine, Workspace
from armid_ros.diagnosis.rivals import (
    is_rival,
    likelier_body,
    likelier_links,
    likeliest,
    not_beaten,
    own_causes_first,
    STRAPS,
)
from armid_ros.diagnosis.selection import (
    acceptable,
    joint_losses,
    Score,
    screen,
    Trial,
    try_group,
)
from armid_ros.effects.interaction import HumanInteraction, InterfaceSlack
from armid_ros.motion import FloatArray
import numpy as np

#: Best groups that are looked at row by row; shapes of this many are refined.
_LOOKED_AT, _REFINED = 30, 4
#: What acts at peaks of the torque only; in more rows than this its column, which is made of the
#: measured torque, stands for anything.
_AT_PEAKS, _PEAK_SHARE = ('actuator_saturation',), 0.2
#: Columns that take less than this share of their gain without the noise of positions beyond the
#: band of the motion are made of that noise: backlash that encoders make takes nothing, of real
#: backlash as wide as three counts a fifth is left.
_NOT_NOISE = 0.1


@dataclass(frozen=True)
class Step:
    """
    One name that was accepted.

    Attributes
    ----------
    trial : Trial
        What it explains.
    rivals : tuple of Trial
        Groups that the data do not exclude in its place.
    league : tuple of Trial
        The best groups of the round, one per name and joints, best first.
    before, after : ndarray, shape (n,)
        Loss of each joint.
    passing : tuple of Trial
        All groups of the round that could have been named.

    """

    trial: Trial
    rivals: tuple[Trial, ...]
    league: tuple[Trial, ...]
    before: FloatArray
    after: FloatArray
    passing: tuple[Trial, ...] = ()


@dataclass(frozen=True)
class Survey:
    """
    What a look at all groups showed.

    Attributes
    ----------
    league : tuple of Trial
        The best groups, best first.
    hidden : frozenset of str
        Names of which the free parameters leave nothing to be seen.
    scores : tuple of Score
        All visible groups, best shape of each.
    tried : int
        How many visible groups there are, every shape for itself.
    unseen : tuple of (str, tuple of str)
        Names and joints of the groups that are not visible.

    """

    league: tuple[Trial, ...]
    hidden: frozenset[str]
    scores: tuple[Score, ...]
    tried: int
    unseen: tuple[tuple[str, tuple[str, ...]], ...]


def next_step(
    problem: Problem,
    free: Sequence[int],
    groups: Sequence[Group],
    work: Workspace,
    total: FloatArray | None = None,
) -> tuple[Step | None, Survey, Problem]:
    """
    Look for the group that explains most of what is left.

    Parameters
    ----------
    problem : Problem
        The data; columns of the groups come first.
    free : sequence of int
        Columns that are not questioned.
    groups : sequence of Group
        What may be named.
    work : Workspace
        What columns of other shapes are computed from.
    total : ndarray, shape (n,), optional
        Excess of each joint before anything was named.

    Returns
    -------
    step : Step or None
        The name, with its rivals; None if nothing passes.
    survey : Survey
        The best groups, accepted or not, and what cannot be seen.
    problem : Problem
        With the columns of refined shapes behind the others.

    """
    settings = work.settings
    projection = project(problem, free)
    left = projection.rest(problem.y)
    screened = screen(problem, projection, groups, settings.least_visible)
    scores = _best_per_key(screened)
    visible = {score.group.effect.name for score in scores}
    hidden = frozenset(group.effect.name for group in groups) - visible
    seen = {score.group.key[:2] for score in scores}
    unseen = tuple(dict.fromkeys(g.key[:2] for g in groups if g.key[:2] not in seen))
    trials, problem = _tried(problem, projection, scores, left, work)
    passing = [
        trial
        for trial in trials
        if acceptable(trial, problem, left, settings, total)
        and not made_of_noise(trial, problem, projection, left, work)
    ]
    survey = Survey(trials, hidden, tuple(scores), len(screened), unseen)
    if not passing:
        return None, survey, problem
    passing = own_causes_first(passing, problem, left)
    tied = [passing[0], *not_beaten(passing, problem, left, settings)]
    winner = likelier_body(likeliest(tied, settings), tied, work.arm)
    if winner.score.group.effect.name in STRAPS:
        links = likelier_links(winner, scores, problem, projection, left, settings)
        winner, tied = (links[0], [*links, winner]) if links else (winner, tied)
    rivals = tuple(
        trial
        for trial in tied
        if trial is not winner and is_rival(trial, winner, problem, projection, settings)
    )
    before = joint_losses(problem, left)
    return Step(winner, rivals, trials, before, winner.losses, tuple(passing)), survey, problem


def _tried(
    problem: Problem,
    projection: Projection,
    scores: Sequence[Score],
    left: FloatArray,
    work: Workspace,
) -> tuple[tuple[Trial, ...], Problem]:
    """Try the best groups, shapes refined, best first; return the problem with those shapes."""
    trials: list[Trial] = []
    refined = 0
    best = max((s.gain for s in scores if s.group.effect.name not in STRAPS), default=0.0)
    for score in scores[:_LOOKED_AT]:
        columns = problem.x[:, :, score.group.columns]
        if score.gain <= 0.0:
            break
        if score.group.effect.name in _AT_PEAKS and _share(problem, columns) > _PEAK_SHARE:
            continue
        promising = refined < _REFINED and score.gain > 0.4 * best
        if score.group.effect.shapes and promising:
            refined += 1
            trial, problem = _refined(problem, projection, score, left, work)
        else:
            trial = try_group(problem, projection, score, columns, work.settings)
        trials.append(trial)
    trials.sort(key=lambda trial: -trial.gain)
    taut = _taut(trials[0], scores) if trials else None
    if taut is not None:
        trial, problem = _refined(problem, projection, taut, left, work)
        trials.append(trial)
        trials.sort(key=lambda trial: -trial.gain)
    return tuple(trials), problem


def _refined(
    problem: Problem, projection: Projection, score: Score, left: FloatArray, work: Workspace
) -> tuple[Trial, Problem]:
    """Try a group in a better shape; return the problem with its columns behind the others too."""
    score, columns = refine(problem, projection, score, left, work)
    start = problem.x.shape[2]
    span = slice(start, start + columns.shape[2])
    score = replace(score, group=replace(score.group, columns=span))
    problem = problem.with_columns(columns)
    columns = problem.x[:, :, span]
    return try_group(problem, projection, score, columns, work.settings), problem


def _taut(best: Trial, scores: Sequence[Score]) -> Score | None:
    """Return a spring from where the best is attached, if that is a strap to a point unknown."""
    strap = best.score.group.effect
    if not isinstance(strap, InterfaceSlack) or strap.anchored:
        return None
    for score in scores:
        group = score.group
        if group.key[:2] == (HumanInteraction.name, strap.joints):
            spring = group.effect.with_shape(strap.shape[: len(group.effect.shape)])
            return replace(score, group=replace(group, effect=spring))
    return None


def made_of_noise(
    trial: Trial, problem: Problem, projection: Projection, left: FloatArray, work: Workspace
) -> bool:
    """
    Return whether a group explains noise with that noise.

    What positions have beyond the motion is in the accelerations that the model takes, and so in
    what is left, and in columns that are derived from them. And columns that are made of the
    measured torque can leave less than its noise.

    """
    effect, kept, settings = trial.score.group.effect, trial.score.group.kept, work.settings
    columns = work.smooth_columns(effect, kept) * problem.weight[:, :, np.newaxis]
    smooth = try_group(problem, projection, trial.score, columns, settings)
    if smooth.gain < _NOT_NOISE * trial.gain:
        return True
    before = np.minimum(joint_losses(problem, left), 1.0)
    return bool(np.any(trial.losses < settings.tautology * before)) and work.reads_torque(
        effect, kept
    )


def _share(problem: Problem, columns: FloatArray) -> float:
    """Return in what share of the rows of the busiest joint a group does something."""
    size = np.abs(columns).max(axis=2)
    busy = size > 0.02 * max(float(size.max()), 1e-300)
    return float(np.max(busy.sum(axis=0) / np.maximum(problem.used.sum(axis=0), 1)))


def _best_per_key(scores: Sequence[Score]) -> list[Score]:
    best: dict[object, Score] = {}
    for score in scores:
        best.setdefault(score.group.key, score)
    return list(best.values())
