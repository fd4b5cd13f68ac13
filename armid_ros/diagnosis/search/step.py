# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One round of the search: every cause alone beside what is free, and the one that is taken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import Problem, project, Projection
from armid_ros.diagnosis.search.candidates import Group
from armid_ros.diagnosis.search.held_out import held_out, lead, Trial
from armid_ros.diagnosis.search.patch import room
from armid_ros.diagnosis.search.refine import refine, Workspace
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Best groups that are looked at row by row; shapes of this many are refined, of groups that have
#: this share of the best worth.
_LOOKED_AT, _REFINED, _PROMISING = 30, 6, 0.4
#: Causes in the small print.
_SMALL_PRINT = 5
#: Columns that take less than this share of their gain without the noise of positions beyond the
#: band of the motion are made of that noise.
_NOT_NOISE = 0.1
#: A group made of the measured torque that leaves less than this share of its noise explains noise
#: with itself.
_TAUTOLOGY = 0.8
#: What contains a simpler cause makes all but this share of its torque; what differs from it by
#: less is the same cause in other words.
_CONTAINED, _SAME = 0.02, 1e-3


@dataclass(frozen=True)
class Beside:
    """
    What is fitted beside every cause.

    Attributes
    ----------
    free : tuple of int
        Columns of the problem.
    hold : ndarray, shape (f, f)
        Precision that they are held with.
    pull : ndarray, shape (f,)
        What they are held to, times that.

    """

    free: tuple[int, ...]
    hold: FloatArray
    pull: FloatArray

    def and_columns(self, group: Group) -> Beside:
        """Return the same with the columns of a group."""
        span = range(group.columns.start, group.columns.stop)
        size = len(self.free) + len(span)
        hold = np.zeros((size, size))
        hold[: len(self.free), : len(self.free)] = self.hold
        hold[len(self.free) :, len(self.free) :] = np.diag(group.precision)
        return Beside((*self.free, *span), hold, np.concatenate([self.pull, np.zeros(len(span))]))


@dataclass(frozen=True)
class Round:
    """
    What a round of the search needs to know.

    Attributes
    ----------
    evidence : Evidence
        The data.
    work : Workspace
        What columns of other shapes are computed from.
    settings : DiagnosisSettings
        Library and thresholds.
    total : float or None
        Held-out squares that shares are of; those of this round if None.
    baseline : Baseline or None
        Recordings in which nothing was wrong.

    """

    evidence: Evidence
    work: Workspace
    settings: DiagnosisSettings
    total: float | None
    baseline: Baseline | None = None


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
    ranking : tuple of Trial
        The best groups of the round, one per name and joints, best first.
    total : float
        Held-out squares that shares are of.
    tried : int
        Groups that were tried, every shape for itself.

    """

    trial: Trial
    rivals: tuple[Trial, ...]
    ranking: tuple[Trial, ...]
    total: float
    tried: int


@dataclass(frozen=True)
class Survey:
    """
    What a look at all groups showed.

    Attributes
    ----------
    ranking : tuple of Trial
        All visible groups in their best shape, best first.
    hidden : frozenset of str
        Names of which what is free leaves nothing to be seen.
    total : float
        Held-out squares that shares are of.
    tried : int
        Groups that were tried, every shape for itself.
    unseen : tuple of (str, tuple of str)
        Names and joints of the groups that are not visible.
    there : tuple of Trial
        Groups that are there beyond chance, best first.

    """

    ranking: tuple[Trial, ...]
    hidden: frozenset[str]
    total: float
    tried: int
    unseen: tuple[tuple[str, tuple[str, ...]], ...]
    there: tuple[Trial, ...] = ()


def next_step(
    problem: Problem, beside: Beside, groups: Sequence[Group], here: Round
) -> tuple[Step | None, Survey, Problem]:
    """
    Look for the cause that takes most of what is left.

    Returns
    -------
    step : Step or None
        The cause, with its rivals; None if nothing passes.
    survey : Survey
        All groups.
    problem : Problem
        With the columns of refined shapes behind the others.

    """
    thresholds = here.settings.thresholds
    trials, power = held_out(problem, beside.free, groups, beside.hold, beside.pull)
    total = float(power.sum()) if here.total is None else here.total
    here = replace(here, total=total)
    seen = [trial for trial in trials if trial.visible >= thresholds.least_visible]
    ranking = _best_per_key(seen, here)
    survey = _survey(groups, ranking, total, len(seen))
    ranking, problem = _with_refined_shapes(problem, beside, ranking, here)
    ranking, gains = _examined(ranking, problem, beside, here, max(len(seen), 1))
    there = [t for t in ranking if id(t) in gains and acceptable(t, here, max(len(seen), 1))]
    survey = replace(survey, there=tuple(there[:_SMALL_PRINT]))
    passing = _passing(ranking, gains, problem, beside, here, max(len(seen), 1))
    if not passing:
        return None, survey, problem
    first = passing[0]
    tied = [first, *(t for t in passing[1:] if not beaten(t, first, here))]
    winner = likeliest(tied, gains, problem, beside, here)
    rivals = tuple(
        trial
        for trial in tied
        if trial is not winner and not _contains(trial, winner, problem, beside, here)
    )
    return Step(winner, rivals, tuple(ranking), total, len(seen)), survey, problem


def worth(trial: Trial, here: Round) -> float:
    """Return the share of the held-out squares that a trial takes, its freedom paid for."""
    assert here.total is not None
    price = here.settings.thresholds.price * cost(trial, here.settings)
    return trial.gain / max(here.total, 1e-300) - price


def cost(trial: Trial, settings: DiagnosisSettings) -> float:
    """Return how many values and shapes the data chose, those of what is outlandish more."""
    effect = trial.group.effect
    shapes = len(effect.shapes) / max(len(effect.separate), 1)
    outside = settings.thresholds.outside if effect.external else 0.0
    return trial.freedom + shapes + outside


def beaten(other: Trial, first: Trial, here: Round) -> bool:
    """Return whether one trial is so far behind another that it is no rival."""
    assert here.total is not None
    thresholds = here.settings.thresholds
    squares, z = lead(first, other)
    if squares <= thresholds.tie * here.total * 0.5 and squares <= thresholds.far * first.gain:
        return False
    return z >= thresholds.rival_z or squares > thresholds.far * first.gain


def likeliest(
    tied: Sequence[Trial],
    gains: dict[int, FloatArray],
    problem: Problem,
    beside: Beside,
    here: Round,
) -> Trial:
    """
    Return the simplest of the causes that leave no gap, or the best where each leaves one.

    One cause that explains everything goes before two that do it together.

    """
    if len(tied) == 1:
        return tied[0]
    since = problem.fold_of_block[problem.block] >= 0
    left = project(problem, beside.free).rest(problem.y)[since]
    squares = np.sum(left**2, axis=0)
    count = np.maximum(here.evidence.count, 1.0)
    limits = here.evidence.limits(here.evidence.split(left, problem.weight[since]), here.settings)
    able = [t for t in tied if np.all((squares - gains[id(t)]) / count <= limits)]
    return simplest(able, here) if able else tied[0]


def simplest(tied: Sequence[Trial], here: Round) -> Trial:
    """
    Return the cause with the least freedom.

    Of causes as free as each other the one that takes more, and of those that take the same the
    first in the catalogue, which goes from the common to the rare.

    """
    order = {name: position for position, name in enumerate(CATALOGUE)}
    least = min(cost(trial, here.settings) for trial in tied)
    simple = [t for t in tied if cost(t, here.settings) < least + 0.5]
    most = max(trial.gain for trial in simple)
    same = [t for t in simple if t.gain >= (1.0 - here.settings.thresholds.tie) * most]
    return min(same, key=lambda t: order.get(t.group.effect.name, len(order)))


def acceptable(trial: Trial, here: Round, tried: int) -> bool:
    """Return whether a cause is there beyond chance, pays for its freedom, and is possible."""
    surely = trial.p * tried <= here.settings.thresholds.error_rate
    return surely and worth(trial, here) > 0.0 and possible(trial, here)


def possible(trial: Trial, here: Round) -> bool:
    """Return whether the values are what could be called by the name."""
    group, arm = trial.group, here.work.arm
    inside = bool(_inside(trial, here).all())
    return inside and group.effect.plausible(trial.values, trial.std, arm)


def _inside(trial: Trial, here: Round) -> npt.NDArray[np.bool_]:
    """Return which values are physically possible, or differ from that by noise, shape (p,)."""
    kept = list(trial.group.kept)
    lower, upper = (bound[kept] for bound in room(trial.group.effect, here.work.arm))
    slack = 3.0 * trial.std
    return np.asarray((trial.values > lower - slack) & (trial.values < upper + slack))


def material(gains: FloatArray, here: Round) -> bool:
    """Return whether a cause that takes these squares of the joints takes as much as matters."""
    return bool(np.any(gains >= here.evidence.least_squares(here.settings)))


def _best_per_key(trials: Sequence[Trial], here: Round) -> list[Trial]:
    best: dict[object, Trial] = {}
    for trial in sorted(trials, key=lambda t: -worth(t, here)):
        best.setdefault(trial.group.key, trial)
    return list(best.values())


def _part(group: Group, inside: Sequence[int], first: int) -> Group:
    """Return a group with some of its values only, whose columns are elsewhere."""
    return replace(
        group,
        columns=slice(first, first + len(inside)),
        kept=tuple(group.kept[k] for k in inside),
        precision=group.precision[list(inside)],
    )


def _survey(groups: Sequence[Group], ranking: Sequence[Trial], total: float, tried: int) -> Survey:
    visible = {trial.group.effect.said_as for trial in ranking}
    seen = {trial.group.key[:2] for trial in ranking}
    return Survey(
        tuple(ranking),
        frozenset(group.effect.said_as for group in groups) - visible,
        total,
        tried,
        tuple(dict.fromkeys(g.key[:2] for g in groups if g.key[:2] not in seen)),
    )


def _with_refined_shapes(
    problem: Problem, beside: Beside, ranking: list[Trial], here: Round
) -> tuple[list[Trial], Problem]:
    """Refine the shapes of the best groups; return them in order, and their columns too."""
    best = max((worth(t, here) for t in ranking if not t.group.effect.external), default=0.0)
    projection: Projection | None = None
    refined: list[Trial] = []
    found: list[FloatArray] = []
    first = problem.x.shape[2]
    tried: Counter[str] = Counter()
    for trial in ranking[:_LOOKED_AT]:
        effect = trial.group.effect
        promising = worth(trial, here) > _PROMISING * best and len(refined) < _REFINED
        promising = promising and tried[effect.name] < _REFINED // 2
        if not (promising and trial.gain > 0.0):
            continue
        tried[effect.name] += 1
        inside = [k for k, good in enumerate(_inside(trial, here)) if good]
        if 0 < len(inside) < trial.group.size:
            own = problem.x[:, :, trial.group.columns][:, :, inside]
            group = _part(trial.group, inside, first)
            first += len(inside)
            found.append(own / np.where(problem.weight > 0.0, problem.weight, 1.0)[:, :, None])
            bounded = _alone(problem, beside, group, own, here)
            refined += [] if bounded is None else [bounded[0]]
            continue
        if not effect.shapes:
            continue
        projection = projection or project(problem, beside.free)
        left = projection.rest(problem.y)
        group, columns = refine(problem, projection, trial.group, left, here.work)
        span = slice(first, first + columns.shape[2])
        first = span.stop
        found.append(columns)
        weighted = columns * problem.weight[:, :, np.newaxis]
        better = _alone(problem, beside, replace(group, columns=span), weighted, here)
        refined += [] if better is None else [better[0]]
    if found:
        problem = problem.with_columns(np.concatenate(found, axis=2))
    return _best_per_key([*ranking, *refined], here), problem


def _examined(
    ranking: list[Trial], problem: Problem, beside: Beside, here: Round, tried: int
) -> tuple[list[Trial], dict[int, FloatArray]]:
    """
    Return the ranking, and what the causes that could be taken take of every joint.

    Where there are recordings from before, what a cause explains with the values that it has in
    those is not new.

    """
    result, gains = [], {}
    for trial in ranking[:_LOOKED_AT]:
        if acceptable(trial, here, tried):
            group = trial.group
            found = _alone(problem, beside, group, problem.x[:, :, group.columns], here)
            if found is None:
                continue
            trial, taken = found
            gains[id(trial)] = taken
        result.append(trial)
    return sorted(result, key=lambda t: -worth(t, here)), gains


def _alone(
    problem: Problem, beside: Beside, group: Group, own: FloatArray, here: Round
) -> tuple[Trial, FloatArray] | None:
    """Try a group with weighted columns beside what is free."""
    size = group.size
    x = np.concatenate([own, problem.x[:, :, list(beside.free)]], axis=2)
    alone, small = replace(group, columns=slice(0, size)), replace(problem, x=x)
    free = range(size, x.shape[2])
    before = None
    if here.baseline is not None:
        before = [here.baseline.values(here.work.arm, group.effect, group.kept, group.precision)]
    trials, _ = held_out(small, free, [alone], beside.hold, beside.pull, before)
    if not trials:
        return None
    return replace(trials[0], group=group), trials[0].joint_gains(small, free)


def _passing(
    ranking: Sequence[Trial],
    gains: dict[int, FloatArray],
    problem: Problem,
    beside: Beside,
    here: Round,
    tried: int,
) -> list[Trial]:
    """Return the causes that could be taken, best first."""
    projection: Projection | None = None
    result: list[Trial] = []
    for trial in ranking:
        possible_name = id(trial) in gains and acceptable(trial, here, tried)
        if not (possible_name and material(gains[id(trial)], here)):
            continue
        if result and beaten(trial, result[0], here):
            continue
        projection = projection or project(problem, beside.free)
        if not _made_of_noise(trial, problem, projection, here.work):
            result.append(trial)
    return result


def _made_of_noise(
    trial: Trial, problem: Problem, projection: Projection, work: Workspace
) -> bool:
    """
    Return whether a group explains noise with that noise.

    What positions have beyond the motion is in the accelerations that the model takes, and so in
    what is left, and in columns that are derived from them. And columns that are made of the
    measured torque can leave less than its noise.

    """
    effect, kept = trial.group.effect, trial.group.kept
    left = projection.rest(problem.y)
    smooth = work.smooth_columns(effect, kept) * problem.weight[:, :, np.newaxis]
    rough = problem.x[:, :, trial.group.columns]
    if _taken(smooth, projection, left) < _NOT_NOISE * _taken(rough, projection, left):
        return True
    after = problem.losses(left - projection.rest(rough) @ trial.values)
    before = np.minimum(problem.losses(left), 1.0)
    return bool(np.any(after < _TAUTOLOGY * before)) and work.reads_torque(effect, kept)


def _taken(columns: FloatArray, projection: Projection, left: FloatArray) -> float:
    """Return the squares that weighted columns (R, n, p) take of what is left."""
    flat = columns.reshape(-1, columns.shape[2])
    own, aim = projection.products(flat), flat.T @ left.ravel()
    values = np.linalg.lstsq(own, aim, rcond=1e-9)[0]
    return float(2.0 * values @ aim - values @ own @ values)


def _contains(big: Trial, small: Trial, problem: Problem, beside: Beside, here: Round) -> bool:
    """Return whether a cause says the same, or is freer and can make what another one makes."""
    projection = project(problem, beside.free)
    columns = projection.rest(problem.x[:, :, big.group.columns])
    target = projection.rest(problem.x[:, :, small.group.columns]) @ small.values
    squares = float(np.sum(target**2))
    if np.sum((columns @ big.values - target) ** 2) < _SAME * squares:
        return here.baseline is not None  # links do not change; a description of them may be off
    if cost(big, here.settings) <= cost(small, here.settings):
        return False
    flat = columns.reshape(-1, big.group.size)
    fit = np.linalg.lstsq(flat, target.ravel(), rcond=1e-6)[0]
    return bool(np.sum((target.ravel() - flat @ fit) ** 2) < _CONTAINED * squares)
