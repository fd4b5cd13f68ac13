# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which of the groups that explain what is left alike is named, and which stay possible."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.candidates import Group
from armid_ros.diagnosis.problem import Problem, Projection
from armid_ros.diagnosis.selection import (
    block_z,
    excess,
    Score,
    SPARSE_GAIN,
    Trial,
    try_group,
    within_bounds,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.motion import FloatArray
import numpy as np

#: Torques of a cosine above this are one and the same: Coulomb friction is stribeck_friction of a
#: velocity beyond all that was moved at, viscous friction is thermal_friction warmed at once.
_IMITATION = 0.98
#: Share by which masses of descriptions are off often enough for no payload to be needed.
_OFF = 0.12
#: What holds the arm from outside is another machine or a person: a cause as rich as this many
#: quantities, which the arm alone has to fail to explain.
STRAPS, _OUTSIDE = ('human_interaction', 'interface_slack'), 4
#: Share of the gap below which what holds the arm from outside waits for causes of its own.
_MOST = 0.5
#: Gains within this share of each other are alike; a lead of less than this share is none.
_EQUAL, _LEAD = 0.98, 0.02
#: A lead of this share that no part of the data denies is one, however few parts show it.
FAR = 0.25
#: Columns below this share of the largest are not seen.
_UNSEEN = 1e-6
#: What contains a simpler cause is no rival of it, unless it gains this much more.
_MORE = 1.1


def own_causes_first(passing: Sequence[Trial], problem: Problem, left: FloatArray) -> list[Trial]:
    """
    Return the groups without what holds the arm from outside, where that is not most of the gap.

    A strap pulls at every joint, and takes a little of whatever is wrong with each; friction of
    one joint takes all of that one.

    """
    own = [trial for trial in passing if trial.score.group.effect.name not in STRAPS]
    most = float(excess(problem, left).sum())
    outside = passing[0].score.group.effect.name in STRAPS
    return own if own and outside and passing[0].gain < _MOST * most else list(passing)


def likeliest(tied: Sequence[Trial], settings: DiagnosisSettings) -> Trial:
    """
    Return the simplest one, or the simplest of those that bring a joint to its noise if it cannot.

    A short motion hardly tells a preloaded spring from an offset; what the offset leaves does.

    """
    simple = simplest(tied)
    able = [trial for trial in tied if _finishes(trial, simple, settings)]
    return simplest(able) if able else simple


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
    left: FloatArray,
    settings: DiagnosisSettings,
) -> list[Trial]:
    """
    Return bodies that take as much as what holds the arm from outside does, best first.

    A far anchor pulls as gravity does. A body has ten values, which slow motions alone do not
    tell, so that it is behind where recordings are held out; it counts if all data together are
    explained as well.

    """

    def taken(trial: Trial) -> float:
        return float(np.sum(left**2) - np.sum((left - trial.torque) ** 2))

    least = taken(winner)
    bodies = [
        try_group(problem, projection, score, problem.x[:, :, score.group.columns], settings)
        for score in scores
        if score.group.effect.changes_body
    ]
    able = [t for t in bodies if within_bounds(t.score) and taken(t) >= least]
    return sorted(able, key=lambda t: -taken(t))


def is_rival(
    trial: Trial,
    winner: Trial,
    problem: Problem,
    projection: Projection,
    settings: DiagnosisSettings,
) -> bool:
    """
    Return whether a group that is not beaten stays possible beside the one that is named.

    One that only imitates or contains it does not, unless it alone brings a joint to its noise.

    """
    if _finishes(trial, winner, settings):
        return True
    if imitates(trial, winner):
        return False
    return trial.gain >= _MORE * winner.gain or not _contains(trial, winner, problem, projection)


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
        far = lead.sum() > max(FAR * best.gain, SPARSE_GAIN)
        beaten |= far and bool(np.all(z > -settings.rival_z))
        alike = _cosine(best.torque, other.torque) > settings.same_cosine and not worse
        if not beaten or alike:
            result.append(other)
    return result


def imitates(other: Trial, winner: Trial) -> bool:
    """Return whether a group with more shapes is there only as the limit of a simpler one."""
    more = _complexity(other.score.group) > _complexity(winner.score.group)
    return more and _cosine(other.torque, winner.torque) > _IMITATION


def _complexity(group: Group) -> int:
    outside = _OUTSIDE if group.effect.name in STRAPS else 0
    shapes = 1 if group.effect.name == 'soft_limit' else len(group.effect.shapes)
    return len(group.kept) + shapes + outside


def _cosine(a: FloatArray, b: FloatArray) -> float:
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.sum(a * b)) / size if size > 0.0 else 0.0


def _contains(big: Trial, small: Trial, problem: Problem, projection: Projection) -> bool:
    """Return whether a larger group can make what a smaller one makes."""
    span = big.score.group.columns
    columns = projection.rest(problem.x[:, :, span]).reshape(-1, span.stop - span.start)
    size = np.linalg.norm(columns, axis=0)
    if np.count_nonzero(size > _UNSEEN * size.max()) <= len(small.score.values):
        return False
    target = small.torque.ravel()
    fit = np.linalg.lstsq(columns, target, rcond=1e-6)[0]
    return bool(np.sum((target - columns @ fit) ** 2) < 0.02 * np.sum(target**2))


def _finishes(big: Trial, small: Trial, settings: DiagnosisSettings) -> bool:
    """Return whether a larger group brings a joint to its noise that a smaller one does not."""
    limit = settings.consistent_loss
    return bool(np.any((small.losses > limit) & (big.losses < limit)))
