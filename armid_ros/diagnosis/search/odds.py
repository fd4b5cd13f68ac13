# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The odds of one cause: the likelihood ratio of the data with and without it.

A cause may have acted before the change (g0). Its values differ between recordings (u_k),
because they depend on the misfit. The spread of u_k is estimated for the cause and shrunk
towards the spread of all causes in the baseline (Smyth, Linear models and empirical Bayes methods,
2004).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.patch import room
from armid_ros.diagnosis.search.priors import SIZES, THERE
from armid_ros.diagnosis.search.setting import Marginal
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import special

#: Spreads: variances of values between recordings over those for white noise. Equal values,
#: candidate spreads of a cause, and candidate spreads of all causes in a baseline.
EQUAL = np.zeros(1)
OWN_SPREADS = np.array([0.0, 1.0, 3.0, 10.0, 30.0, 100.0])
_USUAL_SPREADS = np.array([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0])
#: Usual spread if the baseline has fewer than two recordings: the median of 72 arms.
POPULATION_SPREAD = 1.0
#: Log odds of physically impossible values.
IMPOSSIBLE = -1e6
#: Relative rounding error of the squares of a column, added to its part outside the nuisance
#: columns.
_ROUNDING = 1e-7


@dataclass(frozen=True)
class CauseFit:
    """
    Posterior of the values of a cause, with its evidence.

    Attributes
    ----------
    factor : float
        Log Bayes factor.
    explained : float
        Part of `factor` from the squares that the values explain; the rest penalises their number.
    size : float
        Standard deviation of the prior of the values, over their unit.
    values, std : ndarray, shape (p,)
        Values and their standard deviations.
    resolution : ndarray, shape (p,)
        One where the data determine a value, zero where only the prior does (Menke, Geophysical
        Data Analysis, 1989).

    """

    factor: float
    explained: float
    size: float
    values: FloatArray
    std: FloatArray
    resolution: FloatArray


@dataclass(frozen=True)
class CauseInformation:
    """
    Information on the values of a cause, per group of recordings, in its unit.

    Attributes
    ----------
    matrix : ndarray, shape (G p, G p)
        Precision of the values in each group.
    vector : ndarray, shape (G p,)
        Matrix times mean.
    today : ndarray of bool, shape (G,)
        Whether each group is of the diagnosed day.
    visible : float
        Share of the length of the columns that the nuisance columns cannot reproduce.

    """

    matrix: FloatArray
    vector: FloatArray
    today: npt.NDArray[np.bool_]
    visible: float

    @classmethod
    def of(
        cls, cause: Cause, nuisance: Nuisance, under: Marginal, by_day: bool = False
    ) -> CauseInformation:
        """Return the information per recording or day; nuisance parameters are integrated out."""
        today = nuisance.rows.today
        groups = [[k] for k in range(len(today))]
        if by_day:
            days = (np.flatnonzero(~today).tolist(), np.flatnonzero(today).tolist())
            groups = [day for day in days if day]
        size, p, scale = len(groups), len(cause.unit), under.setting.precision
        border = np.zeros((len(under.used), size, p))
        own, aim = np.zeros((size, p, size, p)), np.zeros((size, p))
        for g, group in enumerate(groups):
            for k in group:
                products = nuisance.products(cause, k) * scale
                border[:, g] += products[under.used]
                own[g, :, g] += cause.own[k] * scale
                aim[g] += cause.aim[k] * scale
                if k in under.motions:
                    motion, place = under.motions[k], nuisance.discrepancy
                    made = products[place]
                    flat = made.reshape(-1, p)
                    solved = motion.inverse @ made
                    border[:, g] -= motion.regressed.T @ flat
                    own[g, :, g] -= flat.T @ solved.reshape(-1, p)
                    aim[g] -= motion.aim.ravel() @ solved.reshape(-1, p)
        flat = border.reshape(len(border), size * p)
        fitted = under.root @ flat
        unit = np.tile(cause.unit, size)
        square = own.reshape(size * p, size * p)
        whole = (square - fitted.T @ fitted) * np.outer(unit, unit)
        length = np.diag(square) * unit**2
        seen = float(np.trace(whole)) / max(
            float(sum(np.trace(x) for x in cause.own)) * scale, 1e-300
        )
        return cls(
            0.5 * (whole + whole.T) + np.diag(_ROUNDING * length + 1e-12),
            (aim.ravel() - flat.T @ under.values) * unit,
            np.array([bool(today[group[0]]) for group in groups]),
            float(np.sqrt(np.clip(seen, 0.0, 1.0))),
        )

    @property
    def size(self) -> int:
        """Return the number of values of the cause."""
        return len(self.vector) // len(self.today)

    def of_day(self, today: bool) -> CauseInformation:
        """Return the information of one day: the diagnosed day or the baseline."""
        of_it = self.today == today
        kept = np.flatnonzero(np.repeat(of_it, self.size))
        matrix = self.matrix[np.ix_(kept, kept)]
        return replace(self, matrix=matrix, vector=self.vector[kept], today=self.today[of_it])

    def among(self, values: npt.NDArray[np.intp]) -> CauseInformation:
        """Return the information on some of the values, while the others are zero."""
        kept = np.add.outer(self.size * np.arange(len(self.today)), values).ravel()
        return replace(self, matrix=self.matrix[np.ix_(kept, kept)], vector=self.vector[kept])

    def apart(self, spread: float) -> list[FloatArray]:
        """Return a root of the prior covariance of differences u_k, in a list; empty if none."""
        if not spread:
            return []
        p, groups = self.size, len(self.today)
        blocks = self.matrix.reshape(groups, p, groups, p)
        mean = np.mean([blocks[g, :, g] for g in range(groups)], axis=0)
        size, axes = np.linalg.eigh(mean)
        size = np.maximum(size, 1e-9 * max(float(size.max()), 1e-300))
        return [np.kron(np.eye(groups), axes * np.sqrt(np.minimum(spread / size, THERE**2)))]

    def there(self) -> FloatArray:
        """Return a root of the prior covariance of values that act on both days (g0)."""
        return np.tile(THERE * np.eye(self.size), (len(self.today), 1))


def odds(
    cause: Cause,
    nuisance: Nuisance,
    under: Marginal | CauseInformation,
    usual: float = 0.0,
    spreads: FloatArray = EQUAL,
    bounded: bool = True,
) -> CauseFit:
    """
    Return the log Bayes factor of a cause and its posterior values.

    Parameters
    ----------
    cause : Cause
        The cause.
    nuisance : Nuisance
        Nuisance parameters of the comparison.
    under : Marginal or CauseInformation
        Fit of the nuisance parameters under one setting, or the information on the cause.
    usual : float
        The usual spread of values between recordings.
    spreads : ndarray, shape (k,)
        Spreads to average over.
    bounded : bool
        Whether physically impossible values count against the cause; see `allowed`.

    """
    known = under
    if isinstance(known, Marginal):
        known = CauseInformation.of(cause, nuisance, known, by_day=not spreads.any())
    p, acts = known.size, cause.acts(known.today)
    there = [known.there()] if not np.all(acts) else []
    if nuisance.rows.unseen:
        there = [np.tile(np.diag(_unseen(cause, nuisance)), (len(known.today), 1))]
    asked = np.kron(acts.astype(float)[:, np.newaxis], np.eye(p))
    prior = -0.5 * np.log((spreads + 1.0) / (usual + 1.0)) ** 2
    prior -= np.logaddexp.reduce(prior)
    nothing, changed = prior.copy(), prior.copy()
    best: tuple[float, int, FloatArray, FloatArray, FloatArray] | None = None
    for n, spread in enumerate(spreads):
        square, aim = known.matrix, known.vector
        for root in [*known.apart(spread), *there]:
            square, aim, more = without(square, aim, root)
            nothing[n] += more
        own, to = asked.T @ square @ asked, asked.T @ aim
        value, axes = np.linalg.eigh(own)
        wide = 1.0 + SIZES[:, np.newaxis] ** 2 * np.maximum(value, 0.0)
        along = SIZES[:, np.newaxis] ** 2 * (axes.T @ to) ** 2
        each = nothing[n] + 0.5 * np.sum(along / wide - np.log(wide), axis=1)
        changed[n] = np.logaddexp.reduce(each) - np.log(len(SIZES))
        if best is None or each.max() > best[0]:
            best = (
                float(each.max()),
                int(np.argmax(each)),
                own,
                to,
                0.5 * np.sum(along / wide, axis=1),
            )
    assert best is not None
    # All values of a cause depend on the same misfit, so only recordings are independent.
    weight = prior + (changed - prior) / p
    weight -= np.logaddexp.reduce(weight)
    factor = -float(np.logaddexp.reduce(weight + nothing - changed))
    _, first, own, to, explained = best
    size = float(SIZES[first])
    covariance = np.linalg.inv(own + np.eye(p) / size**2)
    values = covariance @ to * cause.unit
    std = np.sqrt(np.diag(covariance)) * cause.unit
    resolution = np.diag(covariance @ own)
    fit = CauseFit(factor, float(explained[first]), size, values, std, resolution)
    return replace(fit, factor=factor + allowed(cause, fit, nuisance)) if bounded else fit


def _unseen(cause: Cause, nuisance: Nuisance) -> FloatArray:
    """Return the largest values that a misfit of known size allows, in their unit, (p,)."""
    torque = cause.torque[list(cause.joints)] * cause.unit
    misfit = nuisance.rows.amplitude[-1][list(cause.joints), np.newaxis]
    return np.asarray(THERE * np.min(misfit / np.maximum(torque, 1e-300), axis=0))


def allowed(cause: Cause, fit: CauseFit, nuisance: Nuisance) -> float:
    """Return the log ratio of posterior to prior probability within the bounds, value by value."""
    arm, kept = nuisance.arm, list(cause.kept)
    whole, std = np.zeros((2, len(cause.effect.parameters(arm.robot))))
    whole[kept], std[kept] = fit.values, fit.std
    if not cause.effect.plausible(whole, std, arm):
        return IMPOSSIBLE
    lower, upper = (bound[kept] for bound in room(cause.effect, arm))
    found, prior = (
        special.ndtr((upper - mean) / wide) - special.ndtr((lower - mean) / wide)
        for mean, wide in ((fit.values, fit.std), (0.0, fit.size * cause.unit))
    )
    ratio = np.log(np.maximum(found, 1e-300)) - np.log(np.maximum(prior, 1e-6))
    return float(np.sum(ratio))


def usual_spread(causes: Sequence[Cause], nuisance: Nuisance, under: Marginal) -> float:
    """
    Return the spread of values between recordings of the baseline: the geometric mean of causes.

    With fewer than two recordings it is `POPULATION_SPREAD`.

    """
    if nuisance.rows.before < 2:
        return POPULATION_SPREAD
    logs = []
    for cause in causes:
        if cause.effect.traits.external:
            continue
        known = CauseInformation.of(cause, nuisance, under).of_day(today=False)
        found = []
        for spread in _USUAL_SPREADS:
            square, aim, total = known.matrix, known.vector, 0.0
            for root in [*known.apart(spread), known.there()]:
                square, aim, more = without(square, aim, root)
                total += more
            found.append(total / known.size)
        logs.append(np.log(_USUAL_SPREADS[int(np.argmax(found))] + 1.0))
    return float(np.exp(np.mean(logs)) - 1.0) if logs else POPULATION_SPREAD


def without(
    square: FloatArray, aim: FloatArray, root: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Marginalise values of covariance R R'; return the reduced equations and log evidence."""
    border = square @ root
    inner = root.T @ border
    lower = np.linalg.inv(np.linalg.cholesky(0.5 * (inner + inner.T) + np.eye(len(inner))))
    x, y = lower @ border.T, lower @ (root.T @ aim)
    gained = 0.5 * float(y @ y) + float(np.sum(np.log(np.diag(lower))))
    return square - x.T @ x, aim - x.T @ y, gained
