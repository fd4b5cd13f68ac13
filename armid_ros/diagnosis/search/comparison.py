# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Forward selection of causes by their Bayes factors, until no further cause is significant.

A cause is significant if its values exceed their spread between recordings. Among significant
causes, the explained torque decides. A lead of less than 2 % rejects no other cause, because
torque laws are inexact.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
import math
from typing import TypeAlias

from armid_ros.diagnosis.search.candidates import Causes, line_search
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.hyperparameters import (
    CORRELATED_ROWS,
    Hyperparameters,
    NuisancePosterior,
)
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import (
    CauseInformation,
    fit_cause,
    fit_causes,
    IMPOSSIBLE,
    OWN_SPREADS,
    typical_spread_of,
)
from armid_ros.diagnosis.search.ranking import CauseResult, RankedCause, Ranking
from armid_ros.diagnosis.settings import DiagnosisSettings, UNLISTED
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

#: Candidate standard deviations of d0 and d_k with a baseline, over the misfit.
_SHARED, _OWN = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4), (0.2, 0.4, 0.8)
#: Candidate standard deviations of the noise with a baseline, over the misfit, which contains it.
_NOISE = (0.15, 0.3, 0.5, 0.8, 1.1)
#: Candidate standard deviations of d0 and d_k without a baseline, over the rms torque; log prior.
_SHARES = ((0.0, 0.0), (0.02, -1.0), (0.06, -2.0), (0.15, -3.0))
#: Candidate standard deviations of errors of the described links without a baseline, over the
#: largest expected errors: none, a tenth (masses off by 10 %, centres of mass by 1 cm), and all.
_BODIES = (0.0, 0.1, 1.0)
#: Standard deviations of the noise without a baseline, over that of equal periods; log prior.
_FACTORS = ((1.0, 0.0), (1.3, -1.0), (2.0, -3.0), (4.0, -5.0))
#: Number of causes with refined shapes, of causes in the final comparison, and of accepted causes.
_REFINED, _COMPARED, _MOST = 5, 14, 5
#: Every eighth cause is used to estimate the typical spread.
_SAMPLED = 8
#: Results of the accepted causes, and the regression problem that includes these causes.
Accepted: TypeAlias = tuple[list[CauseResult], Nuisance]


@dataclass(frozen=True)
class Selection:
    """
    Causes accepted by forward selection, and the regression problem that includes them.

    Attributes
    ----------
    accepted : tuple of CauseResult
        The accepted causes with their rivals, in the order in which they were found.
    nuisance : Nuisance
        Regression problem that includes the accepted causes, in the same order.
    posterior : NuisancePosterior
        Its posterior for the likeliest hyperparameters.
    first : Ranking
        Ranking of all causes before any was accepted.
    effects : tuple of Effect
        All candidate effects on all joints.

    """

    accepted: tuple[CauseResult, ...]
    nuisance: Nuisance
    posterior: NuisancePosterior
    first: Ranking
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class CauseComparison:
    """
    Forward selection of the causes of a residual by Bayes factors.

    Attributes
    ----------
    nuisance : Nuisance
        Regression problem without accepted causes.
    catalogue : Causes
        The candidate causes.
    settings : DiagnosisSettings
        Thresholds of the log odds, and the share of a torque that is material.
    grid : tuple of Hyperparameters
        Hyperparameters to average over; see `hyperparameters_of_baseline`.

    """

    nuisance: Nuisance
    catalogue: Causes
    settings: DiagnosisSettings
    grid: tuple[Hyperparameters, ...]
    _posteriors: dict[int, tuple[Nuisance, list[NuisancePosterior]]] = field(
        default_factory=dict, compare=False
    )
    _causes: dict[int, list[Cause]] = field(default_factory=dict, compare=False)

    @cached_property
    def typical_spread(self) -> float:
        """Return the typical variance of fitted values from one baseline recording to another."""
        some = self._causes_of(self.nuisance)[::_SAMPLED]
        return typical_spread_of(some, self.nuisance, self._likeliest(self.nuisance))

    def initial(self) -> Selection:
        """Return the selection before any cause is accepted, with a ranking of all causes."""
        ranking = self.rank_all(self.nuisance)
        effects = tuple(self.catalogue.effects)
        return Selection((), self.nuisance, ranking.posterior, ranking, effects)

    def refit_whole_arm_causes(self, before: Selection) -> Selection:
        """Copy accepted causes that act on the whole arm from another selection; refit them."""
        accepted = tuple(trial for trial in before.accepted if not trial.effect.joints)
        nuisance = self.nuisance
        for one in before.nuisance.accepted:
            if not one.effect.joints:
                cause = self.catalogue.reshaped(one, np.array(one.effect.shape))
                assert cause is not None  # it had torques in the other gravity as well
                nuisance = nuisance.and_cause(cause, one.size)
        posterior = self._likeliest(nuisance)
        return replace(before, accepted=accepted, nuisance=nuisance, posterior=posterior)

    def select(self, begun: Selection | None = None) -> Selection:
        """
        Accept the best cause until none is significant, and drop causes made redundant.

        Parameters
        ----------
        begun : Selection, optional
            Selection whose accepted causes are kept.

        """
        result = begun or self.initial()
        accepted = list(result.accepted)
        ranking = self.rank_all(result.nuisance) if accepted else result.first
        accepted, nuisance = self._exchange_causes(*self._add_causes(accepted, ranking))
        posterior = self._likeliest(nuisance)
        return replace(result, accepted=tuple(accepted), nuisance=nuisance, posterior=posterior)

    def _add_causes(self, accepted: list[CauseResult], ranking: Ranking) -> Accepted:
        """Accept the best cause repeatedly until no further cause is significant."""
        nuisance = ranking.nuisance
        # a fixed number of steps, because two causes can make each other redundant without end
        for _ in range(_MOST - len(accepted)):
            best = self.best(ranking, accepted)
            if best is None:
                break
            winner, trial = best
            nuisance = nuisance.and_cause(winner.cause, winner.fit.size)
            accepted, nuisance = self._drop_redundant([*accepted, trial], nuisance)
            ranking = self.rank_all(nuisance)
        return accepted, nuisance

    def _exchange_causes(self, accepted: list[CauseResult], nuisance: Nuisance) -> Accepted:
        """Replace an accepted cause by several similar causes if the result is likelier."""
        # the last cause was selected with all others in the model
        for k, one in enumerate(accepted[:-1]):
            ranking = self.rank_all(nuisance.without_cause(k))
            others = [*accepted[:k], *accepted[k + 1 :]]
            best = self.best(ranking, others)
            if best is None or best[1].key == one.key:
                continue
            found = self._add_causes(others, ranking)
            gained = self._log_posterior(found[1]) - self._log_posterior(nuisance)
            if gained > self.settings.thresholds.tie:
                return self._exchange_causes(*found)
        return accepted, nuisance

    def _log_posterior(self, nuisance: Nuisance) -> float:
        """Return the log posterior probability of the accepted causes, without normalisation."""
        prior = sum(one.prior for one in nuisance.accepted)
        return self._likeliest(nuisance).evidence + prior

    def best(
        self, ranking: Ranking, accepted: Sequence[CauseResult]
    ) -> tuple[RankedCause, CauseResult] | None:
        """
        Return the best cause of a ranking, and its test result with rivals.

        None if no cause is significant in addition to the accepted ones.

        """
        levels, explained = self.settings.thresholds, sum(max(x.gain, 0.0) for x in accepted) / 2.0
        telling = [
            one
            for one in ranking.ranked
            if ranking.nuisance.rows.misfit_only
            or one.log_bayes_factor
            > min(levels.inexact * explained, (levels.same_fit - 1.0) * one.remaining_loss)
        ]
        able = [one for one in telling if one.odds > levels.alone]
        if not able or max(one.odds for one in able) < levels.alarm:
            return None
        # of causes whose lead is within the error of laws, the likeliest a priori
        winner = min(able, key=lambda one: able[0].log_odds_over(one, levels))
        others = [one for one in able if one is not winner]
        name, joints = winner.cause.effect.name, set(winner.cause.effect.joints)
        # log odds of rivals over the winner: the larger of those with and without a small lead;
        # the small lead of the same law on more joints never counts
        full = [
            -math.inf
            if x.cause.effect.name == name and joints < set(x.cause.effect.joints)
            else x.log_posterior - winner.log_posterior
            for x in others
        ]
        reduced = [-winner.log_odds_over(x, levels) for x in others]
        behind = np.minimum(np.maximum(reduced, full), 0.0)
        total = np.logaddexp.reduce(np.append(behind, 0.0)) + np.logaddexp(0.0, -winner.odds)
        total -= np.log1p(-UNLISTED)
        material = self.settings.material
        rivals = [
            replace(ranking.tested(one, material), probability=float(np.exp(own - total)))
            for one, own in zip(others, behind, strict=True)
            if own > -levels.tie
        ]
        trial = ranking.tested(winner, material)
        found = replace(trial, probability=float(np.exp(-total)), rivals=tuple(rivals))
        return winner, found

    def _all_posteriors(self, nuisance: Nuisance) -> list[NuisancePosterior]:
        """Return the posterior of nuisance parameters for each choice of hyperparameters."""
        if id(nuisance) not in self._posteriors:
            self._posteriors[id(nuisance)] = nuisance, [nuisance.posterior(x) for x in self.grid]
        return self._posteriors[id(nuisance)][1]

    def _likeliest(self, nuisance: Nuisance) -> NuisancePosterior:
        """Return the posterior of nuisance parameters for the likeliest hyperparameters."""
        return max(self._all_posteriors(nuisance), key=lambda one: one.evidence)

    def _causes_of(self, nuisance: Nuisance) -> list[Cause]:
        """Return the candidate causes that a regression problem does not include yet."""
        if id(nuisance) not in self._causes:
            likeliest = self._likeliest(nuisance)
            self._causes[id(nuisance)] = self.catalogue.causes(nuisance, likeliest)
        return self._causes[id(nuisance)]

    def rank_all(self, nuisance: Nuisance) -> Ranking:
        """Rank the causes not accepted yet; optimise shape parameters of the best causes."""
        settings, likeliest = self._all_posteriors(nuisance), self._likeliest(nuisance)
        # for each size of link errors, the likeliest posterior and the one with noise only
        tried: list[NuisancePosterior] = []
        for body in dict.fromkeys(one.hyperparameters.body for one in settings):
            own = [one for one in settings if one.hyperparameters.body == body]
            best = max(own, key=lambda one: one.evidence)
            tried += [best] if best is own[0] else [best, own[0]]
        groups: dict[tuple[int, bool], list[Cause]] = {}  # of causes with columns of equal shape
        for cause in self._causes_of(nuisance):
            groups.setdefault((len(cause.unit), cause.effect.lasting), []).append(cause)
        first: dict[object, tuple[float, Cause, NuisancePosterior]] = {}
        for one, group in product(tried, groups.values()):
            information = CauseInformation.of(group, nuisance, one, pooled=True)
            for cause, fit in zip(group, fit_causes(group, nuisance, information), strict=True):
                log_posterior = fit.factor + one.evidence + cause.prior
                if cause.key not in first or log_posterior > first[cause.key][0]:
                    first[cause.key] = log_posterior, cause, one
        order = sorted(first.values(), key=lambda one: -one[0])
        result = []
        for n, (_, cause, posterior) in enumerate(order[:_COMPARED]):
            if n < _REFINED and cause.effect.shapes:
                cause = self._with_best_shape(cause, nuisance, posterior)
            result.append(self.rank(cause, nuisance))
        ranked = tuple(sorted(result, key=lambda one: -one.log_posterior))
        others = tuple(cause for _, cause, _ in order[_COMPARED:])
        return Ranking(ranked, others, nuisance, likeliest, self.typical_spread)

    def rank(self, cause: Cause, nuisance: Nuisance) -> RankedCause:
        """Return a cause with its Bayes factor, averaged over the hyperparameters."""
        settings = self._all_posteriors(nuisance)
        fits = [(fit_cause(cause, nuisance, one), one) for one in settings]
        nothing = np.logaddexp.reduce([posterior.evidence for _, posterior in fits])
        total = np.logaddexp.reduce([fit.factor + posterior.evidence for fit, posterior in fits])
        fit, posterior = max(fits, key=lambda pair: pair[0].factor + pair[1].evidence)
        data = float(total - nothing)
        there = data + cause.prior
        # values vary between recordings of one kind if there are at least three in total
        if nuisance.rows.n_baseline and len(nuisance.rows.diagnosed) > 2:
            places = max(len(cause.effect.places(nuisance.arm.robot)), 1)
            surely = fit_cause(cause, nuisance, settings[0], self.typical_spread, OWN_SPREADS)
            there = surely.factor - float(np.log(cause.shapes * places))
        return RankedCause(cause, fit, data, there, posterior)

    def _with_best_shape(
        self, cause: Cause, nuisance: Nuisance, posterior: NuisancePosterior
    ) -> Cause:
        """Return a cause with the shape parameters that maximise its Bayes factor."""
        best = [(fit_cause(cause, nuisance, posterior).factor, cause)]

        def gain(shape: FloatArray) -> float:
            other = self.catalogue.reshaped(cause, shape)
            if other is None:
                return IMPOSSIBLE
            best.append((fit_cause(other, nuisance, posterior).factor, other))
            return best[-1][0]

        shape = np.array(cause.effect.shape)
        for k, kind in enumerate(cause.effect.shapes * len(cause.effect.owners)):
            shape = line_search(gain, shape, k, kind)
        return max(best, key=lambda one: one[0])[1]

    def _drop_redundant(self, accepted: list[CauseResult], nuisance: Nuisance) -> Accepted:
        """Drop accepted causes with too small log odds; the last accepted cause stays."""
        while len(accepted) > 1:
            values, covariance = nuisance.moments(self._likeliest(nuisance))
            log_odds = []
            for one, span in zip(nuisance.accepted, nuisance.value_slices, strict=True):
                mean, own = values[span], covariance[span, span]
                gain = float(mean @ np.linalg.solve(own, mean)) + np.linalg.slogdet(own)[1]
                gain -= 2.0 * float(np.sum(np.log(one.size * one.unit)))
                log_odds.append(0.5 * gain + one.prior)
            least = int(np.argmin(log_odds[:-1]))
            if log_odds[least] > self.settings.thresholds.alarm:
                break
            accepted = [*accepted[:least], *accepted[least + 1 :]]
            nuisance = nuisance.without_cause(least)
        return accepted, nuisance


def hyperparameters_of_baseline(nuisance: Nuisance) -> tuple[Hyperparameters, ...]:
    """Return the hyperparameters that maximise the evidence of the baseline recordings."""
    before = np.flatnonzero(~nuisance.rows.diagnosed).tolist()
    correlated_rows = 1.0
    for _ in range(2):
        tried = list[NuisancePosterior]()
        for own, noise in product(_OWN, _NOISE):
            sets = [Hyperparameters(1.0, x, own, noise, correlated_rows) for x in _SHARED]
            tried += nuisance.posteriors(sets, before)
        found = max(tried, key=lambda one: one.evidence)
        correlated_rows = nuisance.correlation_length(found, before, CORRELATED_ROWS)
    return (replace(found.hyperparameters, correlated_rows=correlated_rows),)


def grid_without_baseline() -> tuple[Hyperparameters, ...]:
    """Return the hyperparameters over which a diagnosis without baseline averages."""
    return tuple(
        Hyperparameters(body, share, share, factor, CORRELATED_ROWS, odds + more)
        for body in _BODIES
        for share, odds in _SHARES
        for factor, more in _FACTORS
    )
