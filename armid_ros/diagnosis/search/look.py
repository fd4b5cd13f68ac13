# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One round of the search: a trial of every candidate, and the choice of the one to accept."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

from armid_ros.diagnosis.data.rows import (
    beside_themselves,
    of_nuisance,
    products,
    set_to_zero,
    with_candidate,
)
from armid_ros.diagnosis.search.acceptance import (
    acceptable,
    changed,
    inside,
    material,
    material_sizes,
    may_have_changed,
    tested,
    without_echo,
)
from armid_ros.diagnosis.search.candidates import refine
from armid_ros.diagnosis.search.held_out import tried_beside
from armid_ros.diagnosis.search.round import (
    beaten,
    closes,
    cost,
    Frequency,
    frequency,
    likeliest,
    rarity,
    Round,
    says_no_more,
    worth,
)
from armid_ros.diagnosis.search.trial import Candidate, Key, Step, Survey, Trial
from armid_ros.motion import FloatArray
import numpy as np

#: Best candidates that are examined row by row; most of them whose shapes are refined, and the
#: share of the best worth that these have to have.
_LOOKED_AT, _REFINED, _PROMISING = 30, 6, 0.4
#: Most candidates that are compared jointly with the baseline values of all of them.
_COMPARED = 8
#: Most rivals that are listed for a name, the likeliest and each name once: more than two help
#: nobody.
_RIVALS = 2
#: Stands for an effect of any name.
_ANY = ''
#: Most causes in the small print.
_SMALL_PRINT = 5


@dataclass(frozen=True)
class Look:
    """
    Trials of all candidates jointly with the nuisance parameters; one may be accepted.

    Attributes
    ----------
    survey : Survey
        All candidates.
    passing : tuple of Trial
        Those that may be accepted, best first.
    closing : dict of Key to bool
        Whether each of them leaves no gap.
    ranking : tuple of Trial
        The best candidates, one per name and joints, best first.
    here : Round
        The round that was searched; columns of refined shapes come after all others.

    """

    survey: Survey
    passing: tuple[Trial, ...]
    closing: dict[Key, bool]
    ranking: tuple[Trial, ...]
    here: Round

    def step(self) -> Step | None:
        """
        Return the step that accepts the best candidate that has changed; None if none passes.

        A candidate that gains as much stays a rival of it, whether it has surely changed or not.

        """
        here = self.here
        ahead = list(takewhile(lambda trial: not changed(trial, here), self.passing))
        if len(ahead) == len(self.passing):
            return None
        passing = list(self.passing[len(ahead) :])
        parts = _joint_by_joint(passing, self.ranking, here)
        if parts:
            where = _touched(parts[0], here)
            passing = [trial for trial in passing if _touched(trial, here) == where]
            ahead = [trial for trial in ahead if _touched(trial, here) == where]
        first, *others = passing
        behind = [trial for trial in others if not beaten(trial, first, here)]
        able = [first, *(trial for trial in behind if changed(trial, here))]
        winner = likeliest(able, self.closing, here)
        tied = [*(trial for trial in ahead if not beaten(first, trial, here)), first, *behind]
        rivals = [
            trial
            for trial in tied
            if trial is not winner
            and not beaten(trial, winner, here)
            and not says_no_more(trial, winner, here)
        ]
        best = {trial.candidate.effect.name: trial for trial in reversed(rivals)}
        likely = sorted(
            best.values(), key=lambda t: (frequency(t, here) is Frequency.NEVER, rarity(t))
        )
        return Step(
            winner,
            tuple(likely[:_RIVALS]),
            self.ranking,
            self.survey.total,
            self.survey.tried,
            _misfit_share(here),
        )


def look_at(candidates: Sequence[Candidate], here: Round) -> Look:
    """Try every candidate jointly with the nuisance parameters."""
    nuisance = here.nuisance
    known = products(here.problem, nuisance.free, [one.columns for one in candidates])
    trials, power = tried_beside(known, here.problem, candidates, nuisance.prior)
    total = float(power.sum()) if here.total is None else here.total
    if nuisance.discrepancy:
        places, values = zip(*nuisance.discrepancy, strict=True)
        alone, prior = set_to_zero(known, nuisance.prior, places, np.array(values))
        _, power = tried_beside(alone, here.problem, (), prior)
    here = replace(here, total=total, power=float(power.sum()), known=known)
    seen = [t for t in trials if t.visible >= here.settings.thresholds.least_visible]
    ranking = _best_per_key(seen, here)
    here = replace(here, tried=max(len(seen), 1))
    refined, here = _with_refined_shapes(ranking, here)
    here = replace(here, tested=tested(refined[:_LOOKED_AT], here))
    survey = _survey(candidates, ranking, here)
    ranking, there, closing, here = _examined(refined, here)
    passing = tuple(_passing(ranking, closing, here))
    suspected = next((trial for trial in passing if may_have_changed(trial, here)), None)
    first = ranking[0] if ranking and acceptable(ranking[0], here) else None
    unproven = None if first is None or _changes([first], here) != [None] else first
    there = there[:_SMALL_PRINT]
    survey = replace(survey, there=tuple(there), suspected=suspected, unproven=unproven)
    return Look(survey, passing, closing, tuple(ranking), here)


def _best_per_key(trials: Sequence[Trial], here: Round) -> list[Trial]:
    best: dict[object, Trial] = {}
    for trial in sorted(trials, key=lambda t: -worth(t, here)):
        best.setdefault(trial.candidate.key, trial)
    return list(best.values())


def _part(candidate: Candidate, possible: Sequence[int], first: int) -> Candidate:
    """Return a candidate with some of its values only, whose columns start at another place."""
    return replace(
        candidate,
        columns=slice(first, first + len(possible)),
        kept=tuple(candidate.kept[k] for k in possible),
    )


def _joint_by_joint(
    passing: Sequence[Trial], ranking: Sequence[Trial], here: Round
) -> list[Trial]:
    """
    Return candidates of single joints that together beat the best one, if it acts on several.

    They are simpler and gain more. Friction of three joints is one candidate each, and a person
    who pulls at all of them gains more than any. The joints have the same effect, or, where the
    best is from outside the arm and can imitate any, each its own. Friction is of each joint as a
    rule: a level that all have in common has to be worth as much. The best that has changed comes
    first; empty if there is none.

    """
    first = passing[0]
    if len(_touched(first, here)) < 2:
        return []
    groups: defaultdict[str, dict[tuple[int, ...], Trial]] = defaultdict(dict)
    for trial in ranking[:_LOOKED_AT]:
        where = _touched(trial, here)
        if len(where) == 1 and acceptable(trial, here):
            groups[trial.candidate.effect.name].setdefault(where, trial)
            if first.candidate.effect.traits.external:
                groups[_ANY].setdefault(where, trial)
    single = [trial for trial in passing if len(_touched(trial, here)) == 1]
    able = [trial.candidate.key for trial in single if changed(trial, here)]
    found = [[*group.values()] for group in groups.values()]
    found = [group for group in found if any(trial.candidate.key in able for trial in group)]
    if not found:
        return []
    parts = max(found, key=lambda group: sum(worth(trial, here) for trial in group))
    cross, square = (sum(getattr(t, name) for t in parts) for name in ('cross', 'square'))
    resolution = np.concatenate([trial.resolution for trial in parts])
    whole = replace(parts[0], cross=cross, square=square, resolution=resolution)
    simpler = sum(cost(trial, here.settings) for trial in parts) <= cost(first, here.settings)
    simpler = simpler or first.candidate.effect.traits.common
    if not (simpler and whole.gain > first.gain and beaten(first, whole, here)):
        return []
    return sorted(parts, key=lambda trial: (trial.candidate.key not in able, -worth(trial, here)))


def _touched(trial: Trial, here: Round) -> tuple[int, ...]:
    """Return the joints whose torque a candidate changes."""
    return tuple(np.flatnonzero(np.any(here.own(trial.candidate), axis=(0, 2))).tolist())


def _survey(candidates: Sequence[Candidate], ranking: Sequence[Trial], here: Round) -> Survey:
    assert here.total is not None
    visible = {trial.candidate.effect.said_as for trial in ranking}
    seen = {trial.candidate.key[:2] for trial in ranking}
    return Survey(
        tuple(ranking),
        {trial.candidate.key: _least_sizes(trial, here) for trial in ranking},
        frozenset(candidate.effect.said_as for candidate in candidates) - visible,
        here.total,
        here.tried,
        tuple(dict.fromkeys(g.key[:2] for g in candidates if g.key[:2] not in seen)),
    )


def _misfit_share(here: Round) -> float:
    """Return the share of the misfit that a cause has to take: none where recordings tell."""
    return here.settings.thresholds.misfit_share if here.tested is None else 0.0


def _least_sizes(trial: Trial, here: Round) -> FloatArray:
    """Return the sizes of values, (p,), from which on they are material, and have changed."""
    least = material_sizes(trial, here, _misfit_share(here))
    if here.tested is None:
        return least
    beyond = material_sizes(trial, here, here.settings.thresholds.other_motion)
    return np.maximum(least, np.minimum(here.tested.deviations * trial.std, beyond))


def _with_refined_shapes(ranking: list[Trial], here: Round) -> tuple[list[Trial], Round]:
    """Refine shapes of the best candidates; return the ranking and a round with their columns."""
    problem = here.problem
    best = max(
        (worth(t, here) for t in ranking if not t.candidate.effect.traits.external), default=0.0
    )
    refined: list[Trial] = []
    found: list[FloatArray] = []
    first = problem.x.shape[2]
    tried: Counter[str] = Counter()
    for trial in ranking[:_LOOKED_AT]:
        effect = trial.candidate.effect
        promising = worth(trial, here) > _PROMISING * best and len(refined) < _REFINED
        promising = promising and tried[effect.name] < _REFINED // 2
        if not (promising and trial.gain > 0.0):
            continue
        tried[effect.name] += 1
        possible = [k for k, good in enumerate(inside(trial, here)) if good]
        if 0 < len(possible) < trial.candidate.size:
            own = here.own(trial.candidate)[:, :, possible]
            candidate = _part(trial.candidate, possible, first)
            first += len(possible)
            found.append(own / np.where(problem.weight > 0.0, problem.weight, 1.0)[:, :, None])
            bounded = _alone(candidate, own, here)
            if bounded is None:
                continue
            trial = replace(bounded, candidate=candidate)
            refined.append(trial)
        if not effect.shapes:
            continue
        candidate, columns = refine(
            problem, here.projection, trial.candidate, here.residual, here.work
        )
        span = slice(first, first + columns.shape[2])
        first = span.stop
        found.append(columns)
        weighted = columns * problem.weight[:, :, np.newaxis]
        better = _alone(candidate, weighted, here)
        moved = replace(candidate, columns=span)
        refined += [] if better is None else [replace(better, candidate=moved)]
    if found:
        here = replace(here, problem=problem.with_columns(np.concatenate(found, axis=2)))
    return _best_per_key([*ranking, *refined], here), here


def _examined(
    ranking: Sequence[Trial], here: Round
) -> tuple[list[Trial], list[Trial], dict[Key, bool], Round]:
    """
    Return the ranking, what is there, whether each that matters leaves no gap, and the round.

    With a baseline it is the change that has to be significant and to matter: the values that a
    candidate had then are nuisance parameters. Candidates are compared jointly with such values of
    all of them, since each may have been there before whichever of them changed. One that is
    larger than any motion makes a misfit has changed, however few recordings tell. At another
    speed a friction curve is wrong in all joints alike: what these have in common does not say
    that anything has changed, unless one of them does by itself.

    """
    assert here.total is not None
    least = 0.0 if here.before is None else here.settings.thresholds.headline * here.total
    most = here.settings.thresholds.open_share
    open_squares = _open_squares(here)
    there: list[Trial] = []
    large: list[tuple[Trial, Trial]] = []
    certain: list[Key] = []
    for trial in ranking[:_LOOKED_AT]:
        if not acceptable(trial, here):
            continue
        (change,) = _changes([trial], here)
        if change is None or not acceptable(change, here):
            continue
        takes = trial.joint_gains(*here.rows_of(trial.candidate))
        size = _size(change, takes, here)
        if here.tested is not None and material(size, here, here.settings.thresholds.other_motion):
            certain.append(trial.candidate.key)
        there.append(change)
        matters = size.sum() >= least or bool(np.any(takes > most * open_squares))
        if matters and material(size, here, _misfit_share(here)):
            large.append((trial, change))
    best = [trial for trial, _ in large[:_COMPARED]]
    others = [trial for trial in ranking if not any(trial is one for one in best)]
    compared = _compared(best, [change for _, change in large[:_COMPARED]], here)
    pairs = zip(compared, best, strict=True)
    closing = {change.candidate.key: closes(trial, here) for change, trial in pairs}
    result = sorted([*others, *compared], key=lambda t: -worth(t, here))
    if here.tested is not None:  # what cannot be named, or is a misfit of all joints alike
        able = [one.candidate.key for one in compared if not one.candidate.effect.traits.common]
        here = replace(here, tested=here.tested.among(able, certain))
    there = [change for change in there if changed(change, here)]
    return result, sorted(there, key=lambda t: -worth(t, here)), closing, here


def _open_squares(here: Round) -> FloatArray:
    """Return the squares of every joint that has a gap; infinite where there is none, (n,)."""
    return np.where(here.gaps(here.residual), np.sum(here.residual**2, axis=0), np.inf)


def _compared(trials: Sequence[Trial], alone: Sequence[Trial], here: Round) -> list[Trial]:
    """
    Return the changes of candidates, jointly with all baseline values, on the scale of the gap.

    The uncertainty of their values in the baseline hides a part of any change. The one with the
    largest gain is given the gain of its trial without such values, and the others in proportion.
    Where the baseline determines so little of them jointly that no change is significant, the
    changes are those jointly with the own baseline value alone.

    """
    if here.before is None or len(trials) < 2:
        return list(trials)
    found = _changes(trials, here)
    changes = [trial if one is None else one for trial, one in zip(trials, found, strict=True)]
    if not any(acceptable(change, here) for change in changes):
        changes = list(alone)
    first = max(range(len(trials)), key=lambda k: changes[k].gain)
    if changes[first].gain <= 0.0:
        return list(trials)
    scale = trials[first].gain / changes[first].gain
    return [replace(one, cross=scale * one.cross, square=scale * one.square) for one in changes]


def _alone(candidate: Candidate, own: FloatArray, here: Round) -> Trial | None:
    """Try one candidate with weighted columns; None where nothing of it is visible."""
    candidate = replace(candidate, columns=slice(0, candidate.size))
    assert here.known is not None
    known = with_candidate(here.known, here.problem, here.free, own)
    trials, _ = tried_beside(known, here.problem, [candidate], here.nuisance.prior)
    return trials[0] if trials else None


def _changes(trials: Sequence[Trial], here: Round) -> list[Trial | None]:
    """
    Return the trials of changes since the baseline; None where nothing is visible.

    The values that all of these candidates had in the baseline are nuisance parameters of each.

    """
    if here.before is None:
        return list(trials)
    assert here.known is not None
    problem = here.problem
    held = here.before.information([one.candidate for one in trials], here.work.arm, here.nuisance)
    own = np.concatenate([here.own(one.candidate) for one in trials], axis=2)
    known = beside_themselves(with_candidate(here.known, problem, here.free, own))
    result: list[Trial | None] = []
    first = 0
    for trial in trials:
        size = trial.candidate.size
        candidate = replace(trial.candidate, columns=slice(0, size))
        whole = of_nuisance(known, slice(first, first + size))
        found, _ = tried_beside(whole, problem, [candidate], held)
        result.append(replace(found[0], candidate=trial.candidate) if found else None)
        first += size
    return result


def _size(change: Trial, takes: FloatArray, here: Round) -> FloatArray:
    """
    Return the squares of the torque of a change, at most the candidate's gain, by joint, (n,).

    The gain of a change jointly with the baseline values is less where these are hardly known.

    """
    if here.before is None:
        return takes
    made = np.sum((here.own(change.candidate) @ change.values) ** 2, axis=0)
    return np.asarray(np.minimum(takes, made))


def _passing(ranking: Sequence[Trial], closing: dict[Key, bool], here: Round) -> list[Trial]:
    """Return the candidates that may be accepted, best first."""
    result: list[Trial] = []
    for trial in ranking:
        if trial.candidate.key in closing and acceptable(without_echo(trial, here), here):
            result.append(trial)
    return result
