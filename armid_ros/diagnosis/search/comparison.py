# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The comparison of causes: the best cause is accepted repeatedly, until no cause is significant.

The spread of values between recordings decides whether a change is significant. The explained
torque decides between causes. A lead of 2 % excludes no rival, as laws are inexact.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
import math

from armid_ros.diagnosis.search.candidates import Causes, line_search
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import (
    all_odds,
    IMPOSSIBLE,
    odds,
    OWN_SPREADS,
    usual_spread,
)
from armid_ros.diagnosis.search.setting import LASTING, Marginal, Setting
from armid_ros.diagnosis.search.trial import Look, Ranked, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings, UNLISTED
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

#: Candidate amplitudes of the discrepancies d0 and d_k with a baseline, over the misfit.
_SHARED, _OWN = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4), (0.2, 0.4, 0.8)
#: Candidate amplitudes of the noise with a baseline, over the misfit, which contains noise.
_NOISE = (0.15, 0.3, 0.5, 0.8, 1.1)
#: Candidate amplitudes of d0 and d_k without a baseline, over the torque; log prior odds.
_SHARES = ((0.0, 0.0), (0.02, -1.0), (0.06, -2.0), (0.15, -3.0))
#: Candidate errors of the described links without a baseline, as shares of the largest expected
#: errors: none, a tenth (masses off by 10 %, centres of mass by 1 cm), and all.
_BODIES = (0.0, 0.1, 1.0)
#: Amplitudes of the noise without a baseline, over that of two equal periods; log prior odds.
_FACTORS = ((1.0, 0.0), (1.3, -1.0), (2.0, -3.0), (4.0, -5.0))
#: Number of causes with refined shapes, of causes in the final comparison, and of accepted causes.
_REFINED, _COMPARED, _MOST = 5, 14, 5
#: Every eighth cause is used to estimate the usual spread.
_SAMPLED = 8


@dataclass(frozen=True)
class Result:
    """
    Result of a comparison of causes.

    Attributes
    ----------
    accepted : tuple of Trial
        The accepted causes with their rivals, in the order in which they were found.
    nuisance : Nuisance
        Nuisance parameters, and the accepted causes among them, in the same order.
    under : Marginal
        Fit of the nuisance parameters under the likeliest setting.
    first : Look
        Comparison of all causes before any was accepted.
    effects : tuple of Effect
        Every candidate effect in every place.

    """

    accepted: tuple[Trial, ...]
    nuisance: Nuisance
    under: Marginal
    first: Look
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class CauseComparison:
    """
    Bayesian comparison of the causes of a residual.

    Attributes
    ----------
    nuisance : Nuisance
        The data and the nuisance columns.
    catalogue : Causes
        The causes.
    settings : DiagnosisSettings
        Odds that decide, and the share of a torque that is material.
    grid : tuple of Setting
        Amplitudes of discrepancy and noise; see `settings_of_baseline`.

    """

    nuisance: Nuisance
    catalogue: Causes
    settings: DiagnosisSettings
    grid: tuple[Setting, ...]
    _marginals: dict[int, tuple[Nuisance, list[Marginal]]] = field(
        default_factory=dict, compare=False
    )
    _causes: dict[int, list[Cause]] = field(default_factory=dict, compare=False)

    @cached_property
    def usual(self) -> float:
        """Return how much values usually vary between recordings."""
        under = self._likeliest(self.nuisance)
        return usual_spread(self._causes_of(self.nuisance)[::_SAMPLED], self.nuisance, under)

    def first(self) -> Result:
        """Compare all causes, but accept none."""
        look = self.look(self.nuisance)
        effects = tuple(self.catalogue.effects)
        return Result((), self.nuisance, look.under, look, effects)

    def begun(self, before: Result) -> Result:
        """Return another comparison's causes that act on the whole arm, refitted here."""
        accepted = tuple(trial for trial in before.accepted if not trial.effect.joints)
        nuisance = self.nuisance
        for one in before.nuisance.accepted:
            if not one.effect.joints:
                cause = self.catalogue.reshaped(one, np.array(one.effect.shape))
                assert cause is not None  # it had torques in the other gravity as well
                nuisance = nuisance.and_cause(cause, one.size)
        under = self._likeliest(nuisance)
        return replace(before, accepted=accepted, nuisance=nuisance, under=under)

    def found(self, begun: Result | None = None) -> Result:
        """
        Accept the best cause until none is significant; drop causes that became redundant.

        Parameters
        ----------
        begun : Result, optional
            Causes that are accepted already.

        """
        result = begun or self.first()
        accepted = list(result.accepted)
        look = self.look(result.nuisance) if accepted else result.first
        accepted, nuisance = self._exchanged(*self._extended(accepted, look))
        under = self._likeliest(nuisance)
        return replace(result, accepted=tuple(accepted), nuisance=nuisance, under=under)

    def _extended(self, accepted: list[Trial], look: Look) -> tuple[list[Trial], Nuisance]:
        """Accept the best cause until none is significant."""
        nuisance = look.nuisance
        while len(accepted) < _MOST:
            best = self.best(look, accepted)
            if best is None:
                break
            winner, trial = best
            nuisance = nuisance.and_cause(winner.cause, winner.fit.size)
            accepted, nuisance = self._pruned([*accepted, trial], nuisance)
            look = self.look(nuisance)
        return accepted, nuisance

    def _exchanged(
        self, accepted: list[Trial], nuisance: Nuisance
    ) -> tuple[list[Trial], Nuisance]:
        """Replace a cause that resembles several others if these explain more without it."""
        # the last cause was selected with all others in the model
        for k, one in enumerate(accepted[:-1]):
            look = self.look(nuisance.without(k))
            others = [*accepted[:k], *accepted[k + 1 :]]
            best = self.best(look, others)
            if best is None or best[1].key == one.key:
                continue
            found = self._extended(others, look)
            if self._worth(found[1]) > self._worth(nuisance) + self.settings.thresholds.tie:
                return self._exchanged(*found)
        return accepted, nuisance

    def _worth(self, nuisance: Nuisance) -> float:
        """Return the log posterior probability of the accepted causes, up to a constant."""
        prior = sum(one.prior for one in nuisance.accepted)
        return self._likeliest(nuisance).evidence + prior

    def best(self, look: Look, accepted: Sequence[Trial]) -> tuple[Ranked, Trial] | None:
        """
        Return the best cause of a comparison, also as a trial with its rivals.

        None if no cause is significant beside the accepted ones.

        """
        levels, explained = self.settings.thresholds, sum(max(x.gain, 0.0) for x in accepted) / 2.0
        telling = [
            one
            for one in look.ranking
            if look.nuisance.rows.unseen
            or one.data > min(levels.inexact * explained, (levels.same_fit - 1.0) * one.left)
        ]
        able = [one for one in telling if one.odds > levels.alone]
        if not able or max(one.odds for one in able) < levels.alarm:
            return None
        first = able[0]
        # the same law on some of the joints, unless the lead of all is more than laws are inexact;
        # or the same law by a more usual name
        parts = [
            one
            for one in able
            if one is first
            or one.is_part_of(first)
            or (one.cause.prior > first.cause.prior and one.is_same_law(first, levels.inexact))
        ]
        winner = min(parts, key=lambda one: first.ahead(one, levels))
        others = [one for one in able if one is not winner]
        # The log odds of a rival are the larger ones of those with and without a small lead.
        leads = [-math.inf if x is first else x.worth - winner.worth for x in others]
        behind = np.array(
            [
                min(max(-winner.ahead(x, levels), lead), 0.0)
                for x, lead in zip(others, leads, strict=True)
            ]
        )
        total = np.logaddexp.reduce(np.append(behind, 0.0)) + np.logaddexp(0.0, -winner.odds)
        total -= np.log1p(-UNLISTED)
        material = self.settings.material
        rivals = [
            replace(look.trial(one, material), probability=float(np.exp(odds_to_winner - total)))
            for one, odds_to_winner in zip(others, behind, strict=True)
            if odds_to_winner > -levels.tie
        ]
        trial = look.trial(winner, material)
        found = replace(trial, probability=float(np.exp(-total)), rivals=tuple(rivals))
        return winner, found

    def _settings(self, nuisance: Nuisance) -> list[Marginal]:
        """Return the fit of the nuisance parameters under each setting."""
        if id(nuisance) not in self._marginals:
            self._marginals[id(nuisance)] = nuisance, [nuisance.marginal(x) for x in self.grid]
        return self._marginals[id(nuisance)][1]

    def _likeliest(self, nuisance: Nuisance) -> Marginal:
        return max(self._settings(nuisance), key=lambda one: one.evidence)

    def _causes_of(self, nuisance: Nuisance) -> list[Cause]:
        """Return the causes to compare."""
        if id(nuisance) not in self._causes:
            likeliest = self._likeliest(nuisance)
            self._causes[id(nuisance)] = self.catalogue.causes(nuisance, likeliest)
        return self._causes[id(nuisance)]

    def look(self, nuisance: Nuisance) -> Look:
        """Compare every cause that is not accepted yet, and refine the shapes of the best."""
        settings, likeliest = self._settings(nuisance), self._likeliest(nuisance)
        tried = list[Marginal]()  # the best one, and noise only, of each size of link errors
        for body in dict.fromkeys(one.setting.body for one in settings):
            own = [one for one in settings if one.setting.body == body]
            best = max(own, key=lambda one: one.evidence)
            tried += [best] if best is own[0] else [best, own[0]]
        causes = self._causes_of(nuisance)
        first: dict[object, tuple[float, Cause, Marginal]] = {}
        for one in tried:
            for cause, fit in all_odds(causes, nuisance, one):
                worth = fit.factor + one.evidence + cause.prior
                if cause.key not in first or worth > first[cause.key][0]:
                    first[cause.key] = worth, cause, one
        order = sorted(first.values(), key=lambda one: -one[0])
        result = []
        for n, (_, cause, under) in enumerate(order[:_COMPARED]):
            if n < _REFINED and cause.effect.shapes:
                cause = self._in_best_shape(cause, nuisance, under)
            result.append(self.ranked(cause, nuisance))
        ranking = tuple(sorted(result, key=lambda one: -one.worth))
        others = tuple(cause for _, cause, _ in order[_COMPARED:])
        return Look(ranking, others, nuisance, likeliest, self.usual)

    def ranked(self, cause: Cause, nuisance: Nuisance) -> Ranked:
        """Return the evidence of a cause, averaged over the amplitudes of errors and noise."""
        settings = self._settings(nuisance)
        fits = [(odds(cause, nuisance, one), one) for one in settings]
        nothing = np.logaddexp.reduce([under.evidence for _, under in fits])
        total = np.logaddexp.reduce([fit.factor + under.evidence for fit, under in fits])
        fit, under = max(fits, key=lambda pair: pair[0].factor + pair[1].evidence)
        data = float(total - nothing)
        there = data + cause.prior
        if nuisance.rows.repeated:
            places = max(len(cause.effect.places(nuisance.arm.robot)), 1)
            surely = odds(cause, nuisance, settings[0], self.usual, OWN_SPREADS).factor
            there = surely - float(np.log(cause.shapes * places))
        return Ranked(cause, fit, data, there, under)

    def _in_best_shape(self, cause: Cause, nuisance: Nuisance, under: Marginal) -> Cause:
        """Refine the shape of a cause to maximise its evidence."""
        best = [(odds(cause, nuisance, under).factor, cause)]

        def gain(shape: FloatArray) -> float:
            other = self.catalogue.reshaped(cause, shape)
            if other is None:
                return IMPOSSIBLE
            best.append((odds(other, nuisance, under).factor, other))
            return best[-1][0]

        shape = np.array(cause.effect.shape)
        for k, kind in enumerate(cause.effect.shapes * len(cause.effect.owners)):
            shape = line_search(gain, shape, k, kind)
        return max(best, key=lambda one: one[0])[1]

    def _pruned(self, accepted: list[Trial], nuisance: Nuisance) -> tuple[list[Trial], Nuisance]:
        """Drop causes whose posterior includes zero, except the last one."""
        while len(accepted) > 1:
            values, covariance = nuisance.whole(self._likeliest(nuisance))
            worth = []
            for one, span in zip(nuisance.accepted, nuisance.spans, strict=True):
                mean, own = values[span], covariance[span, span]
                gain = float(mean @ np.linalg.solve(own, mean)) + np.linalg.slogdet(own)[1]
                gain -= 2.0 * float(np.sum(np.log(one.size * one.unit)))
                worth.append(0.5 * gain + one.prior)
            least = int(np.argmin(worth[:-1]))
            if worth[least] > self.settings.thresholds.alarm:
                break
            accepted = [*accepted[:least], *accepted[least + 1 :]]
            nuisance = nuisance.without(least)
        return accepted, nuisance


def settings_of_baseline(nuisance: Nuisance) -> tuple[Setting, ...]:
    """Return the one setting that maximises the evidence of the baseline, as a tuple."""
    before = np.flatnonzero(~nuisance.rows.today).tolist()
    lasting = 1.0
    for _ in range(2):
        tried = list[Marginal]()
        for own, noise in product(_OWN, _NOISE):
            grid = [Setting(1.0, shared, own, noise, lasting) for shared in _SHARED]
            tried += nuisance.marginals(grid, before)
        found = max(tried, key=lambda one: one.evidence)
        lasting = nuisance.lasting(found, before, LASTING)
    return (replace(found.setting, lasting=lasting),)


def settings_alone() -> tuple[Setting, ...]:
    """Return the settings to compare without a baseline, with fixed and with free bodies."""
    return tuple(
        Setting(body, share, share, factor, LASTING, odds + more)
        for body in _BODIES
        for share, odds in _SHARES
        for factor, more in _FACTORS
    )


def settings_of_misfit(body: float) -> tuple[Setting, ...]:
    """Return the settings to compare if only the size of the misfit is known."""
    return tuple(
        Setting(body, share, share, noise, LASTING) for share, noise in product(_OWN, (0.5, 1.1))
    )
