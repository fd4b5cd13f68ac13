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

from armid_ros.diagnosis.search.cause import Cause, room
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.setting import Marginal
from armid_ros.diagnosis.settings import SIZES, THERE
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
#: Relative rounding error of a column's squares, added to its part outside nuisance columns.
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
    Information on the values of causes, per group of recordings, in their units.

    Attributes
    ----------
    matrix : ndarray, shape (..., G p, G p)
        Precision of the values in each group; for several causes, one after the other.
    vector : ndarray, shape (..., G p)
        Matrix times mean.
    today : ndarray of bool, shape (G,)
        Whether each group is of the diagnosed day.
    visible : ndarray, shape (...)
        Share of the length of the columns that the nuisance columns cannot reproduce.

    """

    matrix: FloatArray
    vector: FloatArray
    today: npt.NDArray[np.bool_]
    visible: FloatArray

    @classmethod
    def of(
        cls, causes: Sequence[Cause], nuisance: Nuisance, under: Marginal, by_day: bool = False
    ) -> CauseInformation:
        """Return the information on C causes with the same number of values."""
        today, scale = nuisance.rows.today, under.setting.precision
        count, recordings, p = len(causes), len(today), len(causes[0].unit)
        first = np.unique([0, nuisance.rows.before]) if by_day else np.arange(recordings)
        products = np.concatenate([nuisance.products(one) for one in causes], axis=2) * scale
        own = np.array([one.own for one in causes]) * scale
        aim = np.array([one.aim for one in causes]) * scale
        total = np.trace(own, axis1=2, axis2=3).sum(axis=1)
        border = products[:, under.used]
        if under.motion is not None:
            motion, made = under.motion, products[:, nuisance.discrepancy]
            flat = made.reshape(recordings, -1, count * p)
            solved = (motion.covariance @ made).reshape(flat.shape)
            border -= motion.regressed.swapaxes(1, 2) @ flat
            regressed = motion.aim.reshape(recordings, 1, -1) @ solved
            aim -= regressed.reshape(recordings, count, p).swapaxes(0, 1)
            left, right = (
                x.reshape(recordings, -1, count, p).transpose(2, 0, 1, 3) for x in (flat, solved)
            )
            own -= left.swapaxes(2, 3) @ right
        border = np.add.reduceat(border, first, axis=0)
        own, aim = (np.add.reduceat(x, first, axis=1) for x in (own, aim))
        size = len(first) * p
        by_cause = border.reshape(len(first), -1, count, p).transpose(2, 1, 0, 3)
        border = by_cause.reshape(count, -1, size)
        fitted = under.root @ border
        unit = np.tile([one.unit for one in causes], len(first))
        square = _block_diagonal(own)
        whole = square - fitted.swapaxes(1, 2) @ fitted
        whole *= unit[:, :, np.newaxis] * unit[:, np.newaxis]
        length = np.diagonal(square, axis1=1, axis2=2) * unit**2
        seen = np.trace(whole, axis1=1, axis2=2) / np.maximum(total, 1e-300)
        held = np.eye(size) * (_ROUNDING * length + 1e-12)[:, np.newaxis]
        return cls(
            0.5 * (whole + whole.swapaxes(1, 2)) + held,
            (aim.reshape(count, size) - under.values @ border) * unit,
            today[first],
            np.sqrt(np.clip(seen, 0.0, 1.0)),
        )

    @property
    def size(self) -> int:
        """Return the number of values of a cause."""
        return int(self.vector.shape[-1]) // len(self.today)

    def of_day(self, today: bool) -> CauseInformation:
        """Return the information from the diagnosed day only, or from the baseline only."""
        of_it = self.today == today
        found = self._at(np.flatnonzero(np.repeat(of_it, self.size)))
        return replace(found, today=self.today[of_it])

    def among(self, values: npt.NDArray[np.intp]) -> CauseInformation:
        """Return the information on some of the values, while the others are zero."""
        return self._at(np.add.outer(self.size * np.arange(len(self.today)), values).ravel())

    def _at(self, kept: npt.NDArray[np.intp]) -> CauseInformation:
        matrix = self.matrix[..., kept[:, np.newaxis], kept]
        return replace(self, matrix=matrix, vector=self.vector[..., kept])

    def apart(self, spread: float) -> list[FloatArray]:
        """Return a root of the prior covariance of differences between recordings; or []."""
        if not spread:
            return []
        p, groups = self.size, len(self.today)
        blocks = self.matrix.reshape(*self.matrix.shape[:-2], groups, p, groups, p)
        size, axes = np.linalg.eigh(np.einsum('...gpgq->...pq', blocks) / groups)
        size = np.maximum(size, 1e-9 * np.maximum(size.max(axis=-1, keepdims=True), 1e-300))
        root = axes * np.sqrt(np.minimum(spread / size, THERE**2))[..., np.newaxis, :]
        return [_block_diagonal(np.stack([root] * groups, axis=-3))]

    def there(self) -> FloatArray:
        """Return a root of the prior covariance of values that are the same on both days (g0)."""
        return np.tile(THERE * np.eye(self.size), (len(self.today), 1))


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    """Return block-diagonal matrices (..., G p, G p) of blocks (..., G, p, p)."""
    *shape, groups, p, _ = blocks.shape
    whole = np.zeros((*shape, groups, p, groups, p))
    for k in range(groups):
        whole[..., k, :, k, :] = blocks[..., k, :, :]
    return whole.reshape(*shape, groups * p, groups * p)


def odds(
    cause: Cause,
    nuisance: Nuisance,
    under: Marginal,
    usual: float = 0.0,
    spreads: FloatArray = EQUAL,
) -> CauseFit:
    """Return the log Bayes factor of a cause and its posterior values; see `posteriors`."""
    known = CauseInformation.of([cause], nuisance, under, by_day=not spreads.any())
    return posteriors([cause], nuisance, known, usual, spreads)[0]


def all_odds(
    causes: Sequence[Cause], nuisance: Nuisance, under: Marginal
) -> list[tuple[Cause, CauseFit]]:
    """Return causes with their odds for equal values in all recordings."""
    alike: dict[tuple[int, bool], list[Cause]] = {}
    for one in causes:
        alike.setdefault((len(one.unit), one.effect.lasting), []).append(one)
    found = list[tuple[Cause, CauseFit]]()
    for group in alike.values():
        known = CauseInformation.of(group, nuisance, under, by_day=True)
        found += zip(group, posteriors(group, nuisance, known), strict=True)
    return found


def posteriors(
    causes: Sequence[Cause],
    nuisance: Nuisance,
    known: CauseInformation,
    usual: float = 0.0,
    spreads: FloatArray = EQUAL,
) -> list[CauseFit]:
    """
    Return the log Bayes factors of causes and their posterior values.

    Physically impossible values count against a cause; see `allowed`.

    Parameters
    ----------
    causes : sequence of Cause
        Causes with the same number of values, which act on the same days.
    nuisance : Nuisance
        Nuisance parameters of the comparison.
    known : CauseInformation
        Information on the causes.
    usual : float
        The usual spread of values between recordings.
    spreads : ndarray, shape (k,)
        Spreads to average over.

    """
    count, p, acts = len(causes), known.size, causes[0].acts(known.today)
    there = [known.there()] if not np.all(acts) else []
    if nuisance.rows.unseen:  # the largest values that a misfit of known size allows
        misfit, largest = nuisance.rows.amplitude[-1], np.empty((count, p))
        for k, cause in enumerate(causes):
            joints = list(cause.joints)
            torque = np.maximum(cause.torque[joints] * cause.unit, 1e-300)
            largest[k] = THERE * np.min(misfit[joints, np.newaxis] / torque, axis=0)
        there = [np.tile(np.eye(p) * largest[:, np.newaxis], (len(known.today), 1))]
    asked = np.kron(acts.astype(float)[:, np.newaxis], np.eye(p))
    prior = -0.5 * np.log((spreads + 1.0) / (usual + 1.0)) ** 2
    prior -= np.logaddexp.reduce(prior)
    nothing, changed = np.tile(prior, (2, count, 1))
    squares = SIZES[:, np.newaxis] ** 2
    tried = list[tuple[FloatArray, ...]]()
    for n, spread in enumerate(spreads.tolist()):
        square, aim = known.matrix, known.vector
        for root in [*known.apart(spread), *there]:
            square, aim, more = without(square, aim, root)
            nothing[:, n] += more
        own, to = asked.T @ square @ asked, aim @ asked
        value, axes = np.linalg.eigh(own)
        wide = 1.0 + squares * np.maximum(value, 0.0)[:, np.newaxis]
        along = squares * ((to[:, np.newaxis] @ axes) ** 2)
        explained = 0.5 * np.sum(along / wide, axis=2)
        each = nothing[:, n, np.newaxis] + explained - 0.5 * np.sum(np.log(wide), axis=2)
        changed[:, n] = np.logaddexp.reduce(each, axis=1) - np.log(len(SIZES))
        tried.append((each, explained, own, to))
    # The values of a cause vary with the misfit of a recording: between one and all p of them
    # independently. The number of independent ones is taken as the geometric mean.
    weight = prior + (changed - prior) / np.sqrt(p)
    weight -= np.logaddexp.reduce(weight, axis=1, keepdims=True)
    factor = -np.logaddexp.reduce(weight + nothing - changed, axis=1)
    every, parts, owns, aims = (np.array(x) for x in zip(*tried, strict=True))
    best, rows = np.argmax(every.max(axis=2), axis=0), np.arange(count)
    first = np.argmax(every[best, rows], axis=1)
    own, to, size = owns[best, rows], aims[best, rows], SIZES[first]
    covariance = np.linalg.inv(own + np.eye(p) / size[:, np.newaxis, np.newaxis] ** 2)
    unit = np.array([cause.unit for cause in causes])
    values = (covariance @ to[:, :, np.newaxis])[:, :, 0] * unit
    std = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)) * unit
    resolution = np.diagonal(covariance @ own, axis1=1, axis2=2)
    explained = parts[best, rows, first]
    numbers = zip(factor.tolist(), explained.tolist(), size.tolist(), strict=True)
    arrays = zip(numbers, values, std, resolution, strict=True)
    fits = [CauseFit(*three, *rest) for three, *rest in arrays]
    return [
        replace(fit, factor=fit.factor + allowed(cause, fit, nuisance))
        for cause, fit in zip(causes, fits, strict=True)
    ]


def allowed(cause: Cause, fit: CauseFit, nuisance: Nuisance) -> float:
    """Return the log of posterior over prior probability within the bounds, for each value."""
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
        known = CauseInformation.of([cause], nuisance, under).of_day(today=False)
        found = []
        for spread in _USUAL_SPREADS:
            square, aim, total = known.matrix, known.vector, 0.0
            for root in [*known.apart(spread), known.there()]:
                square, aim, more = without(square, aim, root)
                total += float(more[0])
            found.append(total / known.size)
        logs.append(np.log(_USUAL_SPREADS[int(np.argmax(found))] + 1.0))
    return float(np.exp(np.mean(logs)) - 1.0) if logs else POPULATION_SPREAD


def without(
    square: FloatArray, aim: FloatArray, root: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Marginalise values of covariance R R'; return the reduced equations and log evidence.

    Equations of several causes, (..., Gp, Gp) and (..., Gp), are reduced together.

    """
    border = square @ root
    inner = root.swapaxes(-1, -2) @ border
    inner = 0.5 * (inner + inner.swapaxes(-1, -2)) + np.eye(inner.shape[-1])
    lower = np.linalg.inv(np.linalg.cholesky(inner))
    x = lower @ border.swapaxes(-1, -2)
    y = lower @ (root.swapaxes(-1, -2) @ aim[..., np.newaxis])
    gained = 0.5 * np.sum(y[..., 0] ** 2, axis=-1)
    gained += np.sum(np.log(np.diagonal(lower, axis1=-2, axis2=-1)), axis=-1)
    turned = x.swapaxes(-1, -2)
    return square - turned @ x, aim - (turned @ y)[..., 0], gained
