# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How sure each candidate is: a p value for all that was tried, and how often it would be named.

Nothing is decided by these numbers; they let a reader judge what was decided.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.model_search import Explanation
from armid_ros.diagnosis.rivals import FAR, likelier_body, likeliest
from armid_ros.diagnosis.selection import replicated, sure_of_few_rows, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats

#: Name, joints and quantities of a group.
Key = tuple[str, tuple[str, ...], tuple[int, ...]]

#: Resamplings: a frequency of one half is known to 5 %.
_RESAMPLINGS = 100


@dataclass(frozen=True)
class Standing:
    """
    A candidate and how sure it is.

    Attributes
    ----------
    trial : Trial
        The candidate.
    adjusted_p : float
        Probability of a held-out gain like this if the candidate did nothing, for the best of all
        that were tried; see `adjusted_p_values`.
    inclusion : float
        Share of resamplings of the data in which it is named; see `inclusion_frequencies`.

    """

    trial: Trial
    adjusted_p: float
    inclusion: float


@dataclass(frozen=True)
class League:
    """
    The candidates of a diagnosis.

    Attributes
    ----------
    first : tuple of Standing
        Of the first look, best first.
    named : tuple of Standing
        What was named, in the order of the steps; compared in the round that found it.

    """

    first: tuple[Standing, ...] = ()
    named: tuple[Standing, ...] = ()

    def of(self, name: str) -> tuple[Standing, ...]:
        """Return what was named so."""
        return tuple(s for s in self.named if s.trial.score.group.effect.name == name)


def make_league(
    explanation: Explanation,
    arm: ArmModel,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> League:
    """
    Say how sure the candidates of an explanation are.

    Parameters
    ----------
    explanation : Explanation
        What was found.
    arm : ArmModel
        The arm as described.
    settings : DiagnosisSettings
        Thresholds.
    rng : numpy.random.Generator
        Draws the resamplings.

    """
    survey, steps = explanation.survey, explanation.steps
    first = survey.league if survey is not None else steps[0].league if steps else ()
    tried = max(survey.tried if survey is not None else 0, *(len(s.league) for s in steps), 1)
    pools = [step.passing or step.league for step in steps]
    inclusion = inclusion_frequencies(pools, arm, settings, rng)

    def standing(trial: Trial, p: float) -> Standing:
        return Standing(trial, p, inclusion.get(trial.score.group.key, 0.0))

    named = []
    for step in steps:
        round_p = adjusted_p_values(step.league, tried)
        at = next((k for k, t in enumerate(step.league) if t is step.trial), 0)
        named.append(standing(step.trial, round_p[at]))
    values = adjusted_p_values(first, tried)
    return League(tuple(standing(t, p) for t, p in zip(first, values, strict=True)), tuple(named))


def p_value(trial: Trial) -> float:
    """
    Return the probability of gains like these in the parts of the data if there were none.

    The z of a part is a mean of its blocks over their spread: Student's t. The parts are put
    together by Fisher's method; parts in which a candidate does nothing say nothing.

    """
    tell = np.any(trial.blocks != 0.0, axis=1)
    if trial.only is not None:
        tell = np.arange(len(tell)) == trial.only
    if not tell.any():
        return 1.0
    logs = stats.t.logsf(trial.z[tell], trial.blocks.shape[1] - 1)
    return float(stats.chi2.sf(-2.0 * logs.sum(), 2 * int(tell.sum())))


def adjusted_p_values(trials: Sequence[Trial], tried: int) -> FloatArray:
    """
    Return p values that hold for all candidates together, in the order given.

    Holm 1979. Candidates that were screened out before they were looked at count as tried.

    Parameters
    ----------
    trials : sequence of Trial
        Candidates that were looked at.
    tried : int
        Candidates that were tried, every shape for itself.

    """
    p = np.array([p_value(trial) for trial in trials])
    order = np.argsort(p)
    steps = p[order] * np.maximum(tried - np.arange(len(p)), 1)
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted


def inclusion_frequencies(
    rounds: Sequence[Sequence[Trial]],
    arm: ArmModel,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> dict[Key, float]:
    """
    Return in what share of resamplings of the data each candidate is named, in any round.

    Stability selection (Meinshausen and Buehlmann 2010): blocks of each part are drawn with
    replacement, and the candidate is taken that the search would take of those: of the replicated
    ones that the best does not beat, the simplest. Rounds follow each other as they did with all
    of the data.

    Parameters
    ----------
    rounds : sequence of sequence of Trial
        The candidates of each round that could have been named.
    arm : ArmModel
        The arm as described.
    settings : DiagnosisSettings
        Thresholds.
    rng : numpy.random.Generator
        Draws the resamplings.

    """
    picked: dict[Key, FloatArray] = {}
    for pool in rounds:
        for trial, here in zip(pool, _picked(pool, arm, settings, rng), strict=True):
            key = trial.score.group.key
            picked[key] = np.maximum(picked.get(key, np.zeros(_RESAMPLINGS)), here)
    return {key: float(np.mean(there)) for key, there in picked.items()}


def _picked(
    pool: Sequence[Trial],
    arm: ArmModel,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> FloatArray:
    """Return which candidate of a round is named in each resampling, (C, resamplings)."""
    blocks = np.array([trial.blocks for trial in pool])
    _, parts, count = blocks.shape
    picked = np.zeros((len(pool), _RESAMPLINGS))
    for sample in range(_RESAMPLINGS):
        chosen = rng.integers(count, size=(parts, count))
        drawn = np.take_along_axis(blocks, chosen[np.newaxis], axis=2)
        gains, z = drawn.sum(axis=(1, 2)), _block_z(drawn)
        halves = drawn[:, :, : count // 2].sum(axis=2), drawn[:, :, count // 2 :].sum(axis=2)
        z = sure_of_few_rows(z, np.minimum(*halves), settings)
        able = [
            k
            for k, trial in enumerate(pool)
            if gains[k] > 0.0 and replicated(replace(trial, z=z[k]), settings)
        ]
        if not able:
            continue
        best = max(able, key=lambda k: gains[k])
        lead = drawn[best] - drawn
        surely = np.sum(_block_z(lead) >= settings.rival_z, axis=1) >= min(2, parts)
        beaten = surely | (lead.sum(axis=(1, 2)) > FAR * gains[best])
        tied = {id(pool[k]): k for k in able if k == best or not beaten[k]}
        trials = [pool[k] for k in tied.values()]
        winner = likelier_body(likeliest(trials, settings), trials, arm)
        picked[tied[id(winner)], sample] = 1.0
    return picked


def _block_z(blocks: FloatArray) -> FloatArray:
    """Return mean over its deviation of blocks (C, F, B), shape (C, F)."""
    spread = blocks.std(axis=2, ddof=1) / np.sqrt(blocks.shape[2])
    return np.asarray(blocks.mean(axis=2) / np.maximum(spread, 1e-300))
