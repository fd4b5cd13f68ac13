# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ranking of all candidate causes by their log posterior odds, and the result of each cause."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.hyperparameters import NuisancePosterior
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import CauseFit, CauseInformation, fit_causes
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

#: Name, joints and fitted parameter indices of a cause.
Key: TypeAlias = tuple[str, tuple[str, ...], tuple[int, ...]]


@dataclass(frozen=True)
class CauseResult:
    """
    Test result of a candidate cause: fitted values, log odds, probability and rivals.

    Attributes
    ----------
    effect : Effect
        The effect, with its joints and shape.
    kept : tuple of int
        Indices of its parameters that are fitted; the others are zero.
    values, std : ndarray, shape (p,)
        Fitted values and their standard deviations.
    resolution : ndarray, shape (p,)
        One where the data determine a value, zero where only the prior does.
    least : ndarray, shape (p,)
        Smallest material size of each value.
    visible : float
        Share of the norm of its columns that the nuisance columns cannot reproduce.
    gain : float
        Twice the log Bayes factor of the torque that it explains.
    odds : float
        Log odds that the cause is present, or has changed.
    share : float
        Mean square torque of the cause over that of the residual.
    replicated : int
        Number of diagnosed recordings whose residual the cause reduces.
    probability : float
        Probability among all causes; zero of a cause that was not accepted.
    rivals : tuple of CauseResult
        Other causes that the data do not exclude, the likeliest first.

    """

    effect: Effect
    kept: tuple[int, ...]
    values: FloatArray
    std: FloatArray
    resolution: FloatArray
    least: FloatArray
    visible: float
    gain: float
    odds: float
    share: float
    replicated: int
    probability: float = 0.0
    rivals: tuple[CauseResult, ...] = ()

    @property
    def key(self) -> Key:
        """Name, joints and indices of fitted values, which identify the cause."""
        return self.effect.name, self.effect.joints, self.kept

    @property
    def p(self) -> float:
        """Probability that the cause is absent, or has not changed."""
        return float(np.exp(-np.logaddexp(0.0, self.odds)))


@dataclass(frozen=True)
class RankedCause:
    """
    Candidate cause with its log Bayes factor against the model without the cause.

    Attributes
    ----------
    cause : Cause
        The cause, in its best shape.
    fit : CauseFit
        Posterior of its values.
    log_bayes_factor : float
        Log Bayes factor of the torque that it explains.
    odds : float
        Log odds that the cause is present, or has changed.
    posterior : NuisancePosterior
        Nuisance parameters for the hyperparameters that are likeliest with this cause.

    """

    cause: Cause
    fit: CauseFit
    log_bayes_factor: float
    odds: float
    posterior: NuisancePosterior

    @property
    def log_posterior(self) -> float:
        """Log posterior probability of the cause, without normalisation."""
        return self.log_bayes_factor + self.cause.prior

    @property
    def remaining_loss(self) -> float:
        """Half of the squared weighted residual that remains after the cause is fitted."""
        return self.posterior.loss - self.fit.explained

    def log_odds_over(self, other: RankedCause, levels: Thresholds) -> float:
        """
        Return the log odds of this cause over another cause; positive if this cause is likelier.

        As torque laws are inexact, a difference of the explained squares is ignored below the
        share `inexact` of them, or below the share `same_fit` - 1 of the smaller residual. The
        prior odds, the bounds of the values and their number decide then. Each value has the mean
        penalty of the values of both causes: inexact laws do not depend on how well data determine
        a value.

        """
        pair = self, other
        lead = self.fit.explained - other.fit.explained
        slack = min(
            levels.inexact * max(one.fit.explained for one in pair),
            (levels.same_fit - 1.0) * max(min(one.remaining_loss for one in pair), 0.0),
        )
        seen = float(np.sign(lead)) * max(abs(lead) - slack, 0.0)
        penalty = sum(one.fit.explained + one.fit.in_bounds - one.log_bayes_factor for one in pair)
        own, theirs = (len(one.fit.values) for one in pair)
        prior, other_prior = (one.cause.prior + one.fit.in_bounds for one in pair)
        return seen + prior - other_prior - penalty * (own - theirs) / (own + theirs)


@dataclass(frozen=True)
class Ranking:
    """
    All candidate causes, sorted by log posterior odds.

    Attributes
    ----------
    ranked : tuple of RankedCause
        The best causes in their best shape, the likeliest first.
    others : tuple of Cause
        All other causes, each in its best starting shape.
    nuisance : Nuisance
        Regression problem, with the accepted causes.
    posterior : NuisancePosterior
        Its posterior for the likeliest hyperparameters.
    typical_spread : float
        Typical variance of fitted values between recordings, over that for white noise.

    """

    ranked: tuple[RankedCause, ...]
    others: tuple[Cause, ...]
    nuisance: Nuisance
    posterior: NuisancePosterior
    typical_spread: float

    def tested(self, one: RankedCause | Cause, material: float) -> CauseResult:
        """
        Fit the values of a cause; return its test result.

        Parameters
        ----------
        one : RankedCause or Cause
            The cause; a ranked cause keeps its odds.
        material : float
            Smallest material share of the torque of a joint.

        """
        nuisance, typical_spread = self.nuisance, self.typical_spread
        cause, posterior = (
            (one.cause, one.posterior) if isinstance(one, RankedCause) else (one, self.posterior)
        )
        information = CauseInformation.of([cause], nuisance, posterior)
        spread = np.array([typical_spread * (nuisance.rows.n_baseline > 0)])
        (fit,) = fit_causes([cause], nuisance, information, typical_spread, spread)
        groups, size = len(information.diagnosed), information.size
        visible = float(information.visible[0])
        blocks = information.matrix.reshape(groups, size, groups, size)
        x = fit.values / cause.unit
        gains = [
            2.0 * x @ information.vector.reshape(groups, size)[g] - x @ blocks[g, :, g] @ x
            for g in np.flatnonzero(information.diagnosed)
        ]
        diagnosed = np.flatnonzero(nuisance.rows.diagnosed).tolist()
        explained = float(sum(fit.values @ cause.own[k] @ fit.values for k in diagnosed))
        torque = cause.torque * visible / nuisance.rows.torque[:, np.newaxis]
        if isinstance(one, RankedCause):
            factor, log_odds = one.log_bayes_factor, one.odds
        else:
            places = max(len(cause.effect.places(nuisance.arm.robot)), 1)
            factor = fit.factor
            log_odds = factor - float(np.log(cause.shapes * places))
        return CauseResult(
            cause.effect,
            cause.kept,
            fit.values,
            fit.std,
            fit.resolution,
            np.asarray(material / np.maximum(torque.max(axis=0), 1e-300)),
            visible,
            2.0 * factor,
            log_odds,
            min(explained / self.residual_squares, 1.0),
            int(np.sum(np.array(gains) > 0.0)),
        )

    @cached_property
    def residual_squares(self) -> float:
        """Sum of squared weighted residuals of the diagnosed recordings."""
        return max(self.nuisance.squares_of_diagnosed(self.posterior), 1e-300)
