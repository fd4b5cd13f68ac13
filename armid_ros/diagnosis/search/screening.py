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
from armid_ros.diagnosis.search.held_out import evaluate_candidates
from armid_ros.diagnosis.search.search_state import (
    beaten,
    closes,
    cost,
    Frequency,
    frequency,
    is_redundant,
    most_plausible,
    rarity,
    SearchState,
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
class Screening:
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
    here : SearchState
        The round that was searched; columns of refined shapes come after all others.

    """

    survey: Survey
    passing: tuple[Trial, ...]
    closing: dict[Key, bool]
    ranking: tuple[Trial, ...]
    state: SearchState

    def step(self) -> Step | None:
        """
        Return the step that accepts the best candidate that has changed; None if none passes.

        A candidate that gains as much stays a rival of it, whether it has surely changed or not.

        """
        state = self.state
        ahead = list(takewhile(lambda trial: not changed(trial, state), self.passing))
        if len(ahead) == len(self.passing):
            return None
        passing = list(self.passing[len(ahead) :])
        parts = _joint_by_joint(passing, self.ranking, state)
        if parts:
            where = _touched(parts[0], state)
            passing = [trial for trial in passing if _touched(trial, state) == where]
            ahead = [trial for trial in ahead if _touched(trial, state) == where]
        first, *others = passing
        behind = [trial for trial in others if not beaten(trial, first, state)]
        able = [first, *(trial for trial in behind if changed(trial, state))]
        winner = most_plausible(able, self.closing, state)
        tied = [*(trial for trial in ahead if not beaten(first, trial, state)), first, *behind]
        rivals = [
            trial
            for trial in tied
            if trial is not winner
            and not beaten(trial, winner, state)
            and not is_redundant(trial, winner, state)
        ]
        best = {trial.candidate.effect.name: trial for trial in reversed(rivals)}
        likely = sorted(
            best.values(), key=lambda t: (frequency(t, state) is Frequency.NEVER, rarity(t))
        )
        return Step(
            winner,
            tuple(likely[:_RIVALS]),
            self.ranking,
            self.survey.total,
            self.survey.tried,
            _misfit_share(state),
        )


def screen_candidates(candidates: Sequence[Candidate], state: SearchState) -> Screening:
    """Try every candidate jointly with the nuisance parameters."""
    nuisance = state.nuisance
    known = products(state.problem, nuisance.free, [one.columns for one in candidates])
    trials, power = evaluate_candidates(known, state.problem, candidates, nuisance.prior)
    total = float(power.sum()) if state.total is None else state.total
    if nuisance.discrepancy:
        places, values = zip(*nuisance.discrepancy, strict=True)
        alone, prior = set_to_zero(known, nuisance.prior, places, np.array(values))
        _, power = evaluate_candidates(alone, state.problem, (), prior)
    state = replace(state, total=total, power=float(power.sum()), known=known)
    seen = [t for t in trials if t.visible >= state.settings.thresholds.least_visible]
    ranking = _best_per_key(seen, state)
    state = replace(state, tried=max(len(seen), 1))
    refined, state = _with_refined_shapes(ranking, state)
    state = replace(state, tested=tested(refined[:_LOOKED_AT], state))
    survey = _survey(candidates, ranking, state)
    ranking, there, closing, state = _examined(refined, state)
    passing = tuple(_passing(ranking, closing, state))
    suspected = next((trial for trial in passing if may_have_changed(trial, state)), None)
    first = ranking[0] if ranking and acceptable(ranking[0], state) else None
    unproven = None if first is None or _changes([first], state) != [None] else first
    there = there[:_SMALL_PRINT]
    survey = replace(survey, there=tuple(there), suspected=suspected, unproven=unproven)
    return Screening(survey, passing, closing, tuple(ranking), state)


def _best_per_key(trials: Sequence[Trial], state: SearchState) -> list[Trial]:
    best: dict[object, Trial] = {}
    for trial in sorted(trials, key=lambda t: -worth(t, state)):
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
    passing: Sequence[Trial], ranking: Sequence[Trial], state: SearchState
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
    if len(_touched(first, state)) < 2:
        return []
    groups: defaultdict[str, dict[tuple[int, ...], Trial]] = defaultdict(dict)
    for trial in ranking[:_LOOKED_AT]:
        where = _touched(trial, state)
        if len(where) == 1 and acceptable(trial, state):
            groups[trial.candidate.effect.name].setdefault(where, trial)
            if first.candidate.effect.traits.external:
                groups[_ANY].setdefault(where, trial)
    single = [trial for trial in passing if len(_touched(trial, state)) == 1]
    able = [trial.candidate.key for trial in single if changed(trial, state)]
    found = [[*group.values()] for group in groups.values()]
    found = [group for group in found if any(trial.candidate.key in able for trial in group)]
    if not found:
        return []
    parts = max(found, key=lambda group: sum(worth(trial, state) for trial in group))
    cross, square = (sum(getattr(t, name) for t in parts) for name in ('cross', 'square'))
    resolution = np.concatenate([trial.resolution for trial in parts])
    whole = replace(parts[0], cross=cross, square=square, resolution=resolution)
    simpler = sum(cost(trial, state.settings) for trial in parts) <= cost(first, state.settings)
    simpler = simpler or first.candidate.effect.traits.common
    if not (simpler and whole.gain > first.gain and beaten(first, whole, state)):
        return []
    return sorted(parts, key=lambda trial: (trial.candidate.key not in able, -worth(trial, state)))


def _touched(trial: Trial, state: SearchState) -> tuple[int, ...]:
    """Return the joints whose torque a candidate changes."""
    return tuple(np.flatnonzero(np.any(state.own(trial.candidate), axis=(0, 2))).tolist())


def _survey(
    candidates: Sequence[Candidate], ranking: Sequence[Trial], state: SearchState
) -> Survey:
    assert state.total is not None
    visible = {trial.candidate.effect.said_as for trial in ranking}
    seen = {trial.candidate.key[:2] for trial in ranking}
    return Survey(
        tuple(ranking),
        {trial.candidate.key: _least_sizes(trial, state) for trial in ranking},
        frozenset(candidate.effect.said_as for candidate in candidates) - visible,
        state.total,
        state.tried,
        tuple(dict.fromkeys(g.key[:2] for g in candidates if g.key[:2] not in seen)),
    )


def _misfit_share(state: SearchState) -> float:
    """Return the share of the misfit that a cause has to take: none where recordings tell."""
    return state.settings.thresholds.misfit_share if state.tested is None else 0.0


def _least_sizes(trial: Trial, state: SearchState) -> FloatArray:
    """Return the sizes of values, (p,), from which on they are material, and have changed."""
    least = material_sizes(trial, state, _misfit_share(state))
    if state.tested is None:
        return least
    beyond = material_sizes(trial, state, state.settings.thresholds.other_motion)
    return np.maximum(least, np.minimum(state.tested.deviations * trial.std, beyond))


def _with_refined_shapes(
    ranking: list[Trial], state: SearchState
) -> tuple[list[Trial], SearchState]:
    """Refine shapes of the best candidates; return the ranking and a round with their columns."""
    problem = state.problem
    best = max(
        (worth(t, state) for t in ranking if not t.candidate.effect.traits.external), default=0.0
    )
    refined: list[Trial] = []
    found: list[FloatArray] = []
    first = problem.x.shape[2]
    tried: Counter[str] = Counter()
    for trial in ranking[:_LOOKED_AT]:
        effect = trial.candidate.effect
        promising = worth(trial, state) > _PROMISING * best and len(refined) < _REFINED
        promising = promising and tried[effect.name] < _REFINED // 2
        if not (promising and trial.gain > 0.0):
            continue
        tried[effect.name] += 1
        possible = [k for k, good in enumerate(inside(trial, state)) if good]
        if 0 < len(possible) < trial.candidate.size:
            own = state.own(trial.candidate)[:, :, possible]
            candidate = _part(trial.candidate, possible, first)
            first += len(possible)
            found.append(own / np.where(problem.weight > 0.0, problem.weight, 1.0)[:, :, None])
            bounded = _alone(candidate, own, state)
            if bounded is None:
                continue
            trial = replace(bounded, candidate=candidate)
            refined.append(trial)
        if not effect.shapes:
            continue
        candidate, columns = refine(
            problem, state.projection, trial.candidate, state.residual, state.work
        )
        span = slice(first, first + columns.shape[2])
        first = span.stop
        found.append(columns)
        weighted = columns * problem.weight[:, :, np.newaxis]
        better = _alone(candidate, weighted, state)
        moved = replace(candidate, columns=span)
        refined += [] if better is None else [replace(better, candidate=moved)]
    if found:
        state = replace(state, problem=problem.with_columns(np.concatenate(found, axis=2)))
    return _best_per_key([*ranking, *refined], state), state


def _examined(
    ranking: Sequence[Trial], state: SearchState
) -> tuple[list[Trial], list[Trial], dict[Key, bool], SearchState]:
    """
    Return the ranking, what is there, whether each that matters leaves no gap, and the round.

    With a baseline it is the change that has to be significant and to matter: the values that a
    candidate had then are nuisance parameters. Candidates are compared jointly with such values of
    all of them, since each may have been there before whichever of them changed. One that is
    larger than any motion makes a misfit has changed, however few recordings tell. At another
    speed a friction curve is wrong in all joints alike: what these have in common does not say
    that anything has changed, unless one of them does by itself.

    """
    assert state.total is not None
    least = 0.0 if state.before is None else state.settings.thresholds.headline * state.total
    most = state.settings.thresholds.open_share
    open_squares = np.where(state.gaps(state.residual), np.sum(state.residual**2, axis=0), np.inf)
    there: list[Trial] = []
    large: list[tuple[Trial, Trial]] = []
    certain: list[Key] = []
    for trial in ranking[:_LOOKED_AT]:
        if not acceptable(trial, state):
            continue
        (change,) = _changes([trial], state)
        if change is None or not acceptable(change, state):
            continue
        takes = trial.joint_gains(*state.rows_of(trial.candidate))
        size = _size(change, takes, state)
        if state.tested is not None and material(
            size, state, state.settings.thresholds.other_motion
        ):
            certain.append(trial.candidate.key)
        there.append(change)
        matters = size.sum() >= least or bool(np.any(takes > most * open_squares))
        if matters and material(size, state, _misfit_share(state)):
            large.append((trial, change))
    best = [trial for trial, _ in large[:_COMPARED]]
    others = [trial for trial in ranking if not any(trial is one for one in best)]
    compared = _compared(best, [change for _, change in large[:_COMPARED]], state)
    pairs = zip(compared, best, strict=True)
    closing = {change.candidate.key: closes(trial, state) for change, trial in pairs}
    result = sorted([*others, *compared], key=lambda t: -worth(t, state))
    if state.tested is not None:  # what cannot be named, or is a misfit of all joints alike
        able = [one.candidate.key for one in compared if not one.candidate.effect.traits.common]
        state = replace(state, tested=state.tested.among(able, certain))
    there = [change for change in there if changed(change, state)]
    return result, sorted(there, key=lambda t: -worth(t, state)), closing, state


def _compared(trials: Sequence[Trial], alone: Sequence[Trial], state: SearchState) -> list[Trial]:
    """
    Return the changes of candidates, jointly with all baseline values, on the scale of the gap.

    The uncertainty of their values in the baseline hides a part of any change. The one with the
    largest gain is given the gain of its trial without such values, and the others in proportion.
    Where the baseline determines so little of them jointly that no change is significant, the
    changes are those jointly with the own baseline value alone.

    """
    if state.before is None or len(trials) < 2:
        return list(trials)
    found = _changes(trials, state)
    changes = [trial if one is None else one for trial, one in zip(trials, found, strict=True)]
    if not any(acceptable(change, state) for change in changes):
        changes = list(alone)
    first = max(range(len(trials)), key=lambda k: changes[k].gain)
    if changes[first].gain <= 0.0:
        return list(trials)
    scale = trials[first].gain / changes[first].gain
    return [replace(one, cross=scale * one.cross, square=scale * one.square) for one in changes]


def _alone(candidate: Candidate, own: FloatArray, state: SearchState) -> Trial | None:
    """Try one candidate with weighted columns; None where nothing of it is visible."""
    candidate = replace(candidate, columns=slice(0, candidate.size))
    assert state.known is not None
    known = with_candidate(state.known, state.problem, state.free, own)
    trials, _ = evaluate_candidates(known, state.problem, [candidate], state.nuisance.prior)
    return trials[0] if trials else None


def _changes(trials: Sequence[Trial], state: SearchState) -> list[Trial | None]:
    """
    Return the trials of changes since the baseline; None where nothing is visible.

    The values that all of these candidates had in the baseline are nuisance parameters of each.

    """
    if state.before is None:
        return list(trials)
    assert state.known is not None
    problem = state.problem
    held = state.before.information(
        [one.candidate for one in trials], state.work.arm, state.nuisance
    )
    own = np.concatenate([state.own(one.candidate) for one in trials], axis=2)
    known = beside_themselves(with_candidate(state.known, problem, state.free, own))
    result: list[Trial | None] = []
    first = 0
    for trial in trials:
        size = trial.candidate.size
        candidate = replace(trial.candidate, columns=slice(0, size))
        whole = of_nuisance(known, slice(first, first + size))
        found, _ = evaluate_candidates(whole, problem, [candidate], held)
        result.append(replace(found[0], candidate=trial.candidate) if found else None)
        first += size
    return result


def _size(change: Trial, takes: FloatArray, state: SearchState) -> FloatArray:
    """
    Return the squares of the torque of a change, at most the candidate's gain, by joint, (n,).

    The gain of a change jointly with the baseline values is less where these are hardly known.

    """
    if state.before is None:
        return takes
    made = np.sum((state.own(change.candidate) @ change.values) ** 2, axis=0)
    return np.asarray(np.minimum(takes, made))


def _passing(
    ranking: Sequence[Trial], closing: dict[Key, bool], state: SearchState
) -> list[Trial]:
    """Return the candidates that may be accepted, best first."""
    result: list[Trial] = []
    for trial in ranking:
        if trial.candidate.key in closing and acceptable(without_echo(trial, state), state):
            result.append(trial)
    return result
