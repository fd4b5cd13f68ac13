# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which of the causes that explain alike is taken, and which stay possible beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armid_ros.diagnosis.search.round import cost, Round, worth
from armid_ros.diagnosis.search.trial import lead, ROUNDING, Trial
from armid_ros.effects import CATALOGUE
import numpy as np

#: Places in the catalogue that an effect is behind where it is seldom: a delay of one joint, which
#: is a lag as a rule, and a lag of the whole arm, which is a delay.
_ELSEWHERE = 1.5


def beaten(other: Trial, first: Trial, here: Round) -> bool:
    """Return whether one trial is so far behind another that it is no rival."""
    thresholds = here.settings.thresholds
    squares, z = lead(first, other)
    if squares <= here.width:
        return False
    if _never_happens(first, here) and _happens(other, here):
        return squares > thresholds.far * first.gain
    if squares <= thresholds.tie * here.currency * 0.5 and squares <= thresholds.far * first.gain:
        return False
    return z >= thresholds.rival_z or squares > thresholds.far * first.gain


def _never_happens(trial: Trial, here: Round) -> bool:
    """Return whether a cause is none that could come between two days: links do not change."""
    return here.since and trial.candidate.effect.corrects


def _happens(trial: Trial, here: Round) -> bool:
    """Return whether a cause of the arm itself may come between two days; a person may pull."""
    return not (_never_happens(trial, here) or trial.candidate.effect.external)


def what_happens_first(passing: Sequence[Trial], here: Round) -> list[Trial]:
    """Return causes, best first: before one that never happens what happens and says the same."""
    first, *others = passing
    if _never_happens(first, here):
        for other in others:
            happens = _happens(other, here) and not beaten(other, first, here)
            if happens and contains(first, other, here):
                return [other, first, *(trial for trial in others if trial is not other)]
    return list(passing)


def likeliest(tied: Sequence[Trial], closing: Mapping[int, bool], here: Round) -> Trial:
    """
    Return the simplest of the causes that leave no gap, or the best where each leaves one.

    Of several that are as good it is the commonest.

    One cause that explains everything goes before two that do it together, and what happens goes
    before what never does.

    """
    if any(_happens(trial, here) for trial in tied):
        tied = [trial for trial in tied if not _never_happens(trial, here)]
    if len(tied) == 1:
        return tied[0]
    able = [trial for trial in tied if closing[id(trial)]]
    if able:
        return simplest(able, here)
    alike = [t for t in tied if t.gain >= (1.0 - ROUNDING) * tied[0].gain]
    return min(alike, key=rarity)


def closes(trial: Trial, here: Round) -> bool:
    """Return whether a cause leaves no gap of data left out."""
    _, rest = trial.left_out(here.problem, here.own(trial.candidate), here.free)
    return not here.gaps(rest).any()


def simplest(tied: Sequence[Trial], here: Round) -> Trial:
    """
    Return the cause with the least freedom.

    Of causes as free as each other the one that takes more, and of those that take the same the
    first in the catalogue, which goes from the common to the rare.

    """
    least = min(cost(trial, here.settings) for trial in tied)
    simple = [t for t in tied if cost(t, here.settings) < least + 0.5]
    most = max(trial.gain for trial in simple)
    close = max(here.settings.thresholds.tie * most, here.width)
    return min((t for t in simple if t.gain >= most - close), key=rarity)


def undecided(first: Trial, ranking: Sequence[Trial], here: Round) -> bool:
    """Tell whether a cause was taken for a lead over a likelier one that decides nothing."""
    close = [t for t in ranking if t.gain > 0.0 and 0.0 <= first.gain - t.gain <= here.width]
    own = round(cost(first, here.settings)), rarity(first)
    return any((round(cost(t, here.settings)), rarity(t)) < own for t in close)


def rarity(trial: Trial) -> float:
    """Return the position in the catalogue, which goes from the common to the rare."""
    names, effect = list(CATALOGUE), trial.candidate.effect
    place = names.index(effect.name) if effect.name in CATALOGUE else len(names)
    return place + (_ELSEWHERE if bool(effect.joints) == effect.whole_arm else 0.0)


def contains(big: Trial, small: Trial, here: Round) -> bool:
    """
    Return whether a cause says the same, or is freer and can make what another one makes.

    A cause of the whole arm that looks like one of a joint is another cause: a base that leans,
    and the zero of the first encoder of an arm that moves in a plane.

    """
    if not big.candidate.effect.joints and small.candidate.effect.joints:
        return False
    thresholds = here.settings.thresholds
    columns = here.projection.rest(here.own(big.candidate))
    target = here.projection.rest(here.own(small.candidate)) @ small.values
    squares = float(np.sum(target**2))
    if np.sum((columns @ big.values - target) ** 2) < thresholds.same * squares:
        if not here.since:
            return False
        if small.candidate.effect.comes_and_goes and not big.candidate.effect.comes_and_goes:
            return True  # links do not change; a description of them may be off
    if cost(big, here.settings) <= cost(small, here.settings):
        return False
    flat = columns.reshape(-1, big.candidate.size)
    fit = np.linalg.lstsq(flat, target.ravel(), rcond=1e-6)[0]
    return bool(np.sum((target.ravel() - flat @ fit) ** 2) < thresholds.contained * squares)


def says_no_more(big: Trial, small: Trial, here: Round) -> bool:
    """Return whether a cause contains another one and, its freedom paid for, explains no more."""
    if not contains(big, small, here):
        return False
    thresholds = here.settings.thresholds
    more, (_, z) = worth(big, here) - worth(small, here), lead(big, small)
    return more <= 0.5 * thresholds.tie or z < thresholds.rival_z
