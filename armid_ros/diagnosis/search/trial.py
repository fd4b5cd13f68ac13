# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A cause with its evidence: ranked, with its columns, and as a trial, the record without data.

A look is one comparison of all causes; it evaluates a ranked or another cause as a trial.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import CauseFit, CauseInformation, posteriors
from armid_ros.diagnosis.search.setting import Marginal
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

#: Name, joints and kept values of a cause.
Key: TypeAlias = tuple[str, tuple[str, ...], tuple[int, ...]]


@dataclass(frozen=True)
class Trial:
    """
    A cause with its values, its evidence and its rivals.

    Attributes
    ----------
    effect : Effect
        The effect, with its joints and shape.
    kept : tuple of int
        Its parameters that are fitted; the others are zero.
    values, std : ndarray, shape (p,)
        Its values and their standard deviations.
    resolution : ndarray, shape (p,)
        One where the data determine a value, zero where only the prior does.
    least : ndarray, shape (p,)
        Smallest material size of each value.
    visible : float
        Share of the length of its columns that the nuisance columns cannot reproduce.
    gain : float
        Twice the log Bayes factor of the torque that it explains.
    odds : float
        Log odds that the cause is present, or has changed.
    share : float
        Squares of the torque of the cause over those of the residual.
    replicated : int
        Number of recordings whose residual the cause reduces.
    probability : float
        Probability among all explanations; zero of a cause that was not named.
    rivals : tuple of Trial
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
    rivals: tuple[Trial, ...] = ()

    @property
    def key(self) -> Key:
        """Identity of the cause in any shape: name, joints and quantities."""
        return self.effect.name, self.effect.joints, self.kept

    @property
    def p(self) -> float:
        """Probability that the cause is absent, or has not changed."""
        return float(np.exp(-np.logaddexp(0.0, self.odds)))


@dataclass(frozen=True)
class Ranked:
    """
    A cause with its evidence.

    Attributes
    ----------
    cause : Cause
        The cause, in its best shape.
    fit : CauseFit
        Posterior of its values.
    data : float
        Log Bayes factor of the torque that it explains.
    odds : float
        Log odds that the cause is present, or has changed.
    under : Marginal
        Nuisance parameters under the likeliest setting with this cause.

    """

    cause: Cause
    fit: CauseFit
    data: float
    odds: float
    under: Marginal

    @property
    def worth(self) -> float:
        """Log posterior probability of the cause, up to a constant."""
        return self.data + self.cause.prior

    @property
    def left(self) -> float:
        """Half the sum of squares of the weighted residual that the cause leaves."""
        return self.under.loss - self.fit.explained

    def ahead(self, other: Ranked, levels: Thresholds) -> float:
        """
        Return the log odds of this cause over another one; positive if this one is likelier.

        As torque laws are inexact, differences below the share `inexact` of the explained part, or
        below the share `same_fit` - 1 of the smaller residual, are ignored. So is the difference
        of two laws with the same column, such as Coulomb friction and presliding over a very short
        distance: only their misfit differs. If the difference is ignored, the number of values and
        the prior odds decide.

        """
        lead = self.fit.explained - other.fit.explained
        if self.is_same_law(other, levels.inexact):
            lead = 0.0
        slack = min(
            levels.inexact * max(self.fit.explained, other.fit.explained),
            (levels.same_fit - 1.0) * max(min(self.left, other.left), 0.0),
        )
        seen = float(np.sign(lead)) * max(abs(lead) - slack, 0.0)
        return seen + (self.worth - self.fit.explained) - (other.worth - other.fit.explained)

    def is_same_law(self, other: Ranked, inexact: float) -> bool:
        """Return whether two causes of one value have equal columns, except for a small share."""
        one, two = self.cause, other.cause
        if one.joints != two.joints or max(len(one.unit), len(two.unit)) > 1:
            return False
        cross = sum(float(np.vdot(a, b)) for a, b in zip(one.columns, two.columns, strict=True))
        return bool(cross**2 >= (1.0 - inexact) * one.own.sum() * two.own.sum() > 0.0)

    def is_part_of(self, other: Ranked) -> bool:
        """Return whether the other cause is the same law on these and more joints."""
        own, whole = self.cause.effect, other.cause.effect
        return own.name == whole.name and set(own.joints) < set(whole.joints)


@dataclass(frozen=True)
class Look:
    """
    Result of one comparison of all causes.

    Attributes
    ----------
    ranking : tuple of Ranked
        The best causes in their best shape, the likeliest first.
    others : tuple of Cause
        All other causes, each in its best starting shape.
    nuisance : Nuisance
        Data and nuisance parameters of the comparison.
    under : Marginal
        Fit of the nuisance parameters under the likeliest setting.
    usual : float
        Usual spread of values between recordings.

    """

    ranking: tuple[Ranked, ...]
    others: tuple[Cause, ...]
    nuisance: Nuisance
    under: Marginal
    usual: float

    def trial(self, one: Ranked | Cause, material: float) -> Trial:
        """
        Evaluate a cause: its values, visibility and evidence.

        Parameters
        ----------
        one : Ranked or Cause
            The cause; one that was ranked keeps its odds.
        material : float
            Share of the torque of a joint that matters.

        """
        nuisance, usual = self.nuisance, self.usual
        cause, under = (one.cause, one.under) if isinstance(one, Ranked) else (one, self.under)
        known = CauseInformation.of([cause], nuisance, under)
        spread = np.array([usual * (nuisance.rows.before > 0)])
        (fit,) = posteriors([cause], nuisance, known, usual, spread)
        groups, size, visible = len(known.today), known.size, float(known.visible[0])
        blocks = known.matrix.reshape(groups, size, groups, size)
        x = fit.values / cause.unit
        gains = [
            2.0 * x @ known.vector.reshape(groups, size)[g] - x @ blocks[g, :, g] @ x
            for g in np.flatnonzero(known.today)
        ]
        today = np.flatnonzero(nuisance.rows.today).tolist()
        explained = float(sum(fit.values @ cause.own[k] @ fit.values for k in today))
        torque = cause.torque * visible / nuisance.rows.torque[:, np.newaxis]
        if isinstance(one, Ranked):
            factor, log_odds = one.data, one.odds
        else:
            places = max(len(cause.effect.places(nuisance.arm.robot)), 1)
            factor = fit.factor
            log_odds = factor - float(np.log(cause.shapes * places))
        return Trial(
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
        """Sum of squares of the weighted residual of the diagnosed day."""
        return max(self.nuisance.squares_of_today(self.under), 1e-300)
