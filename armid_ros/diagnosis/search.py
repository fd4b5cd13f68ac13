# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The forward search: name by name, until the noise is reached or nothing passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.candidates import Group
from armid_ros.diagnosis.problem import Problem, project, Projection
from armid_ros.diagnosis.refine import refine, Workspace
from armid_ros.diagnosis.selection import (
    acceptable,
    block_z,
    joint_losses,
    Score,
    screen,
    SPARSE_GAIN,
    Trial,
    try_group,
    within_bounds,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.motion import FloatArray
import numpy as np

#: Best groups that are looked at row by row; shapes of this many are refined.
_LOOKED_AT, _REFINED = 30, 4
#: Torques of a cosine above this are one and the same: Coulomb friction is stribeck_friction of a
#: velocity beyond all that was moved at, viscous friction is thermal_friction warmed at once.
_IMITATION = 0.98
#: Share by which masses of descriptions are off often enough for no payload to be needed.
_OFF = 0.12
#: What acts at peaks of the torque only; in more rows than this its column, which is made of the
#: measured torque, stands for anything.
_AT_PEAKS, _PEAK_SHARE = ('actuator_saturation',), 0.2
#: What holds the arm from outside is another machine or a person: a cause as rich as this many
#: quantities, which the arm alone has to fail to explain.
_STRAPS, _OUTSIDE = ('human_interaction', 'interface_slack'), 4
#: Columns that take less than this share of their gain without the noise of positions beyond the
#: band of the motion are made of that noise: backlash that encoders make takes nothing, of real
#: backlash as wide as three counts a fifth is left.
_NOT_NOISE = 0.1
#: Gains within this share of each other are alike; a lead of less than this share is none.
_EQUAL, _LEAD = 0.98, 0.02
#: A lead of this share that no part of the data denies is one, however few parts show it.
_FAR = 0.25
#: What contains a simpler cause is no rival of it, unless it gains this much more.
_MORE = 1.1


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
    total: float = 0.0,
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
    total : float
        Excess before anything was named.

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
    trials: list[Trial] = []
    refined = 0
    best = max((s.gain for s in scores if s.group.effect.name not in _STRAPS), default=0.0)
    for score in scores[:_LOOKED_AT]:
        columns = problem.x[:, :, score.group.columns]
        if score.gain <= 0.0:
            break
        if score.group.effect.name in _AT_PEAKS and _share(problem, columns) > _PEAK_SHARE:
            continue
        promising = refined < _REFINED and score.gain > 0.4 * best
        if score.group.effect.shapes and promising:
            refined += 1
            score, columns = refine(problem, projection, score, left, work)
            start = problem.x.shape[2]
            problem = problem.with_columns(columns)
            span = slice(start, start + columns.shape[2])
            score = replace(score, group=replace(score.group, columns=span))
            columns = problem.x[:, :, span]
        trials.append(try_group(problem, projection, score, columns, settings))
    trials.sort(key=lambda trial: -trial.gain)
    passing = [
        trial
        for trial in trials
        if acceptable(trial, problem, left, settings, total)
        and not made_of_noise(trial, problem, projection, left, work)
    ]
    league = tuple(trials)
    survey = Survey(league, hidden, tuple(scores), len(screened), unseen)
    if not passing:
        return None, survey, problem
    tied = [passing[0], *not_beaten(passing, problem, left, settings)]
    winner = likelier_body(simplest(tied), tied, work.arm)
    if winner.score.group.effect.name in _STRAPS:
        links = likelier_links(winner, scores, problem, projection, settings)
        winner, tied = (links[0], [*links, winner]) if links else (winner, tied)
    rivals = tuple(
        trial
        for trial in tied
        if trial is not winner
        and (
            _finishes(trial, winner, problem, left, settings)
            or (not imitates(trial, winner)
            and not (
                trial.gain < _MORE * winner.gain and _contains(trial, winner, problem, projection)
            ))
        )
    )
    before = joint_losses(problem, left)
    after = joint_losses(problem, left - winner.torque)
    return Step(winner, rivals, league, before, after, tuple(passing)), survey, problem


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
    after = joint_losses(problem, left - trial.torque)
    return bool(np.any(after < settings.tautology * before)) and work.reads_torque(effect, kept)


def simplest(tied: Sequence[Trial]) -> Trial:
    """
    Return the one with the fewest quantities and shapes.

    Of these, the one that gains most; the first in the catalogue, which goes from the common to
    the rare, where gains differ by less than their parts of the data do.

    """
    fewest = min(_complexity(trial.score.group) for trial in tied)
    simple = [trial for trial in tied if _complexity(trial.score.group) == fewest]
    most = max(trial.gain for trial in simple)
    close = [trial for trial in simple if trial.gain >= _EQUAL * most]
    order = {name: position for position, name in enumerate(CATALOGUE)}
    return min(close, key=lambda trial: order.get(trial.score.group.effect.name, len(order)))


def likelier_body(winner: Trial, tied: Sequence[Trial], arm: ArmModel) -> Trial:
    """Return the link instead of a payload on it where descriptions are off by as much."""
    group = winner.score.group
    if group.effect.name != 'payload':
        return winner
    link = arm.robot.joints.index(group.effect.joints[0])
    described = float(arm.robot.rigid_parameters[10 * link])
    if abs(float(winner.score.values[0])) > _OFF * described:
        return winner
    twins = [t for t in tied if t.score.group.key[:2] == ('link_inertia', group.effect.joints)]
    return twins[0] if twins else winner


def likelier_links(
    winner: Trial,
    scores: Sequence[Score],
    problem: Problem,
    projection: Projection,
    settings: DiagnosisSettings,
) -> list[Trial]:
    """
    Return bodies that take as much as what holds the arm from outside does, best first.

    A far anchor pulls as gravity does. A body has ten values, which slow motions alone do not
    tell, so that it is behind where recordings are held out; it counts if all data together are
    explained as well.

    """

    def taken(trial: Trial) -> float:
        left = projection.rest(problem.y)
        return float(np.sum(left**2) - np.sum((left - trial.torque) ** 2))

    bodies = [
        try_group(problem, projection, score, problem.x[:, :, score.group.columns], settings)
        for score in scores
        if score.group.effect.changes_body
    ]
    able = [t for t in bodies if within_bounds(t.score) and taken(t) >= taken(winner)]
    return sorted(able, key=lambda t: -taken(t))


def _share(problem: Problem, columns: FloatArray) -> float:
    """Return in what share of the rows of the busiest joint a group does something."""
    size = np.abs(columns).max(axis=2)
    busy = size > 0.02 * max(float(size.max()), 1e-300)
    return float(np.max(busy.sum(axis=0) / np.maximum(problem.used.sum(axis=0), 1)))


def _complexity(group: Group) -> int:
    outside = _OUTSIDE if group.effect.name in _STRAPS else 0
    shapes = 1 if group.effect.name == 'soft_limit' else len(group.effect.shapes)
    return len(group.kept) + shapes + outside


def _best_per_key(scores: Sequence[Score]) -> list[Score]:
    best: dict[object, Score] = {}
    for score in scores:
        best.setdefault(score.group.key, score)
    return list(best.values())


def not_beaten(
    passing: Sequence[Trial], problem: Problem, left: FloatArray, settings: DiagnosisSettings
) -> list[Trial]:
    """Return the groups that the first does not beat on two held-out parts, or looks like."""
    best = passing[0]
    result = []
    for other in passing[1:]:
        lead = (left - other.held_out) ** 2 - (left - best.held_out) ** 2
        z = block_z(problem.fold, lead.sum(axis=1), settings.blocks)
        worse = lead.sum() > _LEAD * best.gain
        beaten = worse and np.sum(z >= settings.rival_z) >= min(2, problem.folds)
        far = lead.sum() > max(_FAR * best.gain, SPARSE_GAIN)
        beaten |= far and bool(np.all(z > -settings.rival_z))
        alike = _cosine(best.torque, other.torque) > settings.same_cosine and not worse
        if not beaten or alike:
            result.append(other)
    return result


def _cosine(a: FloatArray, b: FloatArray) -> float:
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.sum(a * b)) / size if size > 0.0 else 0.0


def _contains(big: Trial, small: Trial, problem: Problem, projection: Projection) -> bool:
    """Return whether a larger group can make what a smaller one makes."""
    span = big.score.group.columns
    if span.stop - span.start <= len(small.score.values):
        return False
    columns = projection.rest(problem.x[:, :, span]).reshape(-1, span.stop - span.start)
    target = small.torque.ravel()
    fit = np.linalg.lstsq(columns, target, rcond=1e-6)[0]
    return bool(np.sum((target - columns @ fit) ** 2) < 0.02 * np.sum(target**2))


def _finishes(
    big: Trial, small: Trial, problem: Problem, left: FloatArray, settings: DiagnosisSettings
) -> bool:
    """Return whether a larger group brings a joint to its noise that a smaller one does not."""
    after, before = (joint_losses(problem, left - trial.torque) for trial in (big, small))
    limit = settings.consistent_loss
    return bool(np.any((before > limit) & (after < limit)))


def imitates(other: Trial, winner: Trial) -> bool:
    """Return whether a group with more shapes is there only as the limit of a simpler one."""
    more = _complexity(other.score.group) > _complexity(winner.score.group)
    return more and _cosine(other.torque, winner.torque) > _IMITATION
