# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Bayes factor of one cause: the ratio of the data's probability density with and without the cause.

The notation is that of `nuisance`. A cause may have acted in the baseline (g0). Its values differ
between recordings (u_k), because they depend on the misfit. The variance of u_k is estimated for
the cause and shrunk towards that of all causes in the baseline (Smyth, Linear models and empirical
Bayes methods, 2004).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.search.cause import bounds_of_change, Cause
from armid_ros.diagnosis.search.hyperparameters import NuisancePosterior
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.settings import SIZES, THERE
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import special

#: Spreads: variance of fitted values between recordings over their variance for white noise. No
#: spread, candidate spreads of one cause, and candidate spreads of all causes in a baseline.
NO_SPREAD = np.zeros(1)
OWN_SPREADS = np.array([0.0, 1.0, 3.0, 10.0, 30.0, 100.0])
_USUAL_SPREADS = np.array([0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0])
#: Typical spread if the baseline has fewer than two recordings: the median of 72 arms.
POPULATION_SPREAD = 1.0
#: Log odds of physically impossible values.
IMPOSSIBLE = -1e6
#: Relative rounding error of a column's squared norm, added to its part outside nuisance columns.
_ROUNDING = 1e-7


@dataclass(frozen=True)
class CauseFit:
    """
    Posterior of the values of a cause, and the log Bayes factor of its presence.

    Attributes
    ----------
    factor : float
        Log Bayes factor.
    explained : float
        Half of the squared weighted residual that the values explain, a part of `factor`. The
        other parts are `in_bounds` and the penalty for the number of values.
    size : float
        Prior standard deviation of the values, over their unit.
    values, std : ndarray, shape (p,)
        Posterior means and standard deviations of the values.
    resolution : ndarray, shape (p,)
        One where the data determine a value, zero where only the prior does (Menke, Geophysical
        Data Analysis, 1989).
    in_bounds : float
        Log ratio of posterior to prior probability that the values are possible, a part of
        `factor`.

    """

    factor: float
    explained: float
    size: float
    values: FloatArray
    std: FloatArray
    resolution: FloatArray
    in_bounds: float = 0.0


@dataclass(frozen=True)
class CauseInformation:
    """
    Fisher information on the p parameters of a cause, in each of G groups of recordings.

    The nuisance parameters are integrated out. Values are in the units of their cause.

    Attributes
    ----------
    matrix : ndarray, shape (..., G p, G p)
        Fisher information of each cause: precision of its values in all groups.
    vector : ndarray, shape (..., G p)
        Fisher information times least-squares values.
    diagnosed : ndarray of bool, shape (G,)
        Whether each group consists of diagnosed recordings.
    visible : ndarray, shape (...)
        Share of the norm of the columns that the nuisance columns cannot reproduce.
    similarity : ndarray, shape (G, G)
        Prior correlation of the differences u_k of the groups.

    """

    matrix: FloatArray
    vector: FloatArray
    diagnosed: npt.NDArray[np.bool_]
    visible: FloatArray
    similarity: FloatArray

    @classmethod
    def of(
        cls,
        causes: Sequence[Cause],
        nuisance: Nuisance,
        posterior: NuisancePosterior,
        pooled: bool = False,
    ) -> CauseInformation:
        """
        Compute the Fisher information on causes with the same number of parameters.

        Each recording is a group; with `pooled`, the baseline and the diagnosed recordings are.

        """
        diagnosed, scale = nuisance.rows.diagnosed, posterior.hyperparameters.precision
        count, recordings, p = len(causes), len(diagnosed), len(causes[0].unit)
        first = np.unique([0, nuisance.rows.n_baseline]) if pooled else np.arange(recordings)
        products = np.concatenate([nuisance.products(one) for one in causes], axis=2) * scale
        own = np.array([one.own for one in causes]) * scale
        aim = np.array([one.aim for one in causes]) * scale
        total = np.trace(own, axis1=2, axis2=3).sum(axis=1)
        border = products[:, posterior.used]
        if posterior.motion is not None:
            motion, made = posterior.motion, products[:, nuisance.discrepancy]
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
        fitted = posterior.root @ border
        unit = np.tile([one.unit for one in causes], len(first))
        square = _block_diagonal(own)
        whole = square - fitted.swapaxes(1, 2) @ fitted
        whole *= unit[:, :, np.newaxis] * unit[:, np.newaxis]
        length = np.diagonal(square, axis1=1, axis2=2) * unit**2
        seen = np.trace(whole, axis1=1, axis2=2) / np.maximum(total, 1e-300)
        held = np.eye(size) * (_ROUNDING * length + 1e-12)[:, np.newaxis]
        return cls(
            0.5 * (whole + whole.swapaxes(1, 2)) + held,
            (aim.reshape(count, size) - posterior.values @ border) * unit,
            diagnosed[first],
            np.sqrt(np.clip(seen, 0.0, 1.0)),
            np.eye(len(first)) if pooled else nuisance.rows.similarity,
        )

    @property
    def size(self) -> int:
        """Number p of values of a cause."""
        return int(self.vector.shape[-1]) // len(self.diagnosed)

    def only(self, diagnosed: bool) -> CauseInformation:
        """Return the information from the diagnosed recordings, or from the baseline."""
        of_it = self.diagnosed == diagnosed
        found = self._at(np.flatnonzero(np.repeat(of_it, self.size)))
        similarity = self.similarity[np.ix_(of_it, of_it)]
        return replace(found, diagnosed=self.diagnosed[of_it], similarity=similarity)

    def among(self, values: npt.NDArray[np.intp]) -> CauseInformation:
        """Return the information on a subset of the values; the others are fixed at zero."""
        return self._at(np.add.outer(self.size * np.arange(len(self.diagnosed)), values).ravel())

    def _at(self, kept: npt.NDArray[np.intp]) -> CauseInformation:
        matrix = self.matrix[..., kept[:, np.newaxis], kept]
        return replace(self, matrix=matrix, vector=self.vector[..., kept])

    def difference_root(self, spread: float) -> list[FloatArray]:
        """Return a root of the prior covariance of differences between groups; [] if zero."""
        if not spread:
            return []
        p, groups = self.size, len(self.diagnosed)
        blocks = self.matrix.reshape(*self.matrix.shape[:-2], groups, p, groups, p)
        size, axes = np.linalg.eigh(np.einsum('...gpgq->...pq', blocks) / groups)
        size = np.maximum(size, 1e-9 * np.maximum(size.max(axis=-1, keepdims=True), 1e-300))
        root = axes * np.sqrt(np.minimum(spread / size, THERE**2))[..., np.newaxis, :]
        lower = np.linalg.cholesky(self.similarity)
        return [np.einsum('gh,...pq->...gphq', lower, root).reshape(self.matrix.shape)]

    def baseline_root(self) -> FloatArray:
        """Return a root of the prior covariance of the values in the baseline."""
        return np.tile(THERE * np.eye(self.size), (len(self.diagnosed), 1))


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    """Arrange blocks (..., G, p, p) as block-diagonal matrices (..., G p, G p)."""
    *shape, groups, p, _ = blocks.shape
    whole = np.zeros((*shape, groups, p, groups, p))
    for k in range(groups):
        whole[..., k, :, k, :] = blocks[..., k, :, :]
    return whole.reshape(*shape, groups * p, groups * p)


def fit_cause(
    cause: Cause,
    nuisance: Nuisance,
    posterior: NuisancePosterior,
    typical_spread: float = 0.0,
    spreads: FloatArray = NO_SPREAD,
) -> CauseFit:
    """Fit a cause; return its log Bayes factor and the posterior of its values."""
    information = CauseInformation.of([cause], nuisance, posterior, pooled=not spreads.any())
    return fit_causes([cause], nuisance, information, typical_spread, spreads)[0]


def fit_causes(
    causes: Sequence[Cause],
    nuisance: Nuisance,
    information: CauseInformation,
    typical_spread: float = 0.0,
    spreads: FloatArray = NO_SPREAD,
) -> list[CauseFit]:
    """
    Fit causes one by one; return their log Bayes factors and posteriors.

    Physically impossible values reduce the factor; see `log_probability_in_bounds`.

    Parameters
    ----------
    causes : sequence of Cause
        Causes with the same number of values, which act in the same recordings.
    nuisance : Nuisance
        Regression problem of the nuisance parameters.
    information : CauseInformation
        Fisher information on the values of the causes.
    typical_spread : float
        Typical variance of fitted values between recordings, over that for white noise.
    spreads : ndarray, shape (k,)
        Spreads to average over.

    """
    count, p, acts = len(causes), information.size, causes[0].acts(information.diagnosed)
    baseline_root = [information.baseline_root()] if not np.all(acts) else []
    if nuisance.rows.misfit_only:  # the largest values that a misfit of known size allows
        misfit, largest = nuisance.rows.amplitude[-1], np.empty((count, p))
        for k, cause in enumerate(causes):
            joints = list(cause.joints)
            torque = np.maximum(cause.torque[joints] * cause.unit, 1e-300)
            largest[k] = THERE * np.min(misfit[joints, np.newaxis] / torque, axis=0)
        baseline_root = [
            np.tile(np.eye(p) * largest[:, np.newaxis], (len(information.diagnosed), 1))
        ]
    acting = np.kron(acts.astype(float)[:, np.newaxis], np.eye(p))
    prior = -0.5 * np.log((spreads + 1.0) / (typical_spread + 1.0)) ** 2
    prior -= np.logaddexp.reduce(prior)
    nothing, changed = np.tile(prior, (2, count, 1))
    squares = SIZES[:, np.newaxis] ** 2
    tried = list[tuple[FloatArray, ...]]()
    for n, spread in enumerate(spreads.tolist()):
        square, aim = information.matrix, information.vector
        for root in [*information.difference_root(spread), *baseline_root]:
            square, aim, more = marginalised(square, aim, root)
            nothing[:, n] += more
        own, to = acting.T @ square @ acting, aim @ acting
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
    bounds = [log_probability_in_bounds(*one, nuisance) for one in zip(causes, fits, strict=True)]
    pairs = zip(fits, bounds, strict=True)
    return [replace(fit, factor=fit.factor + own, in_bounds=own) for fit, own in pairs]


def log_probability_in_bounds(cause: Cause, fit: CauseFit, nuisance: Nuisance) -> float:
    """Return the log ratio of the posterior and prior probabilities that values are in bounds."""
    arm, kept = nuisance.arm, list(cause.kept)
    whole, std = np.zeros((2, len(cause.effect.parameters(arm.robot))))
    whole[kept], std[kept] = fit.values, fit.std
    if not cause.effect.plausible(whole, std, arm):
        return IMPOSSIBLE
    lower, upper = (bound[kept] for bound in bounds_of_change(cause.effect, arm))
    found, prior = (
        special.ndtr((upper - mean) / wide) - special.ndtr((lower - mean) / wide)
        for mean, wide in ((fit.values, fit.std), (0.0, fit.size * cause.unit))
    )
    ratio = np.log(np.maximum(found, 1e-300)) - np.log(np.maximum(prior, 1e-6))
    return float(np.sum(ratio))


def typical_spread_of(
    causes: Sequence[Cause], nuisance: Nuisance, posterior: NuisancePosterior
) -> float:
    """
    Return the typical spread of fitted values between baseline recordings.

    The mean is geometric. With fewer than two recordings it is `POPULATION_SPREAD`.

    """
    if nuisance.rows.n_baseline < 2:
        return POPULATION_SPREAD
    logs = []
    for cause in causes:
        if cause.effect.traits.external:
            continue
        information = CauseInformation.of([cause], nuisance, posterior).only(diagnosed=False)
        found = []
        for spread in _USUAL_SPREADS:
            square, aim, total = information.matrix, information.vector, 0.0
            for root in [*information.difference_root(spread), information.baseline_root()]:
                square, aim, more = marginalised(square, aim, root)
                total += float(more[0])
            found.append(total / information.size)
        logs.append(np.log(_USUAL_SPREADS[int(np.argmax(found))] + 1.0))
    return float(np.exp(np.mean(logs)) - 1.0) if logs else POPULATION_SPREAD


def marginalised(
    square: FloatArray, aim: FloatArray, root: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Integrate random values with prior covariance R R' out of normal equations.

    Equations of several causes, (..., Gp, Gp) and (..., Gp), are reduced together.

    Returns
    -------
    square, aim : ndarray, shape (..., Gp, Gp), (..., Gp)
        The reduced equations.
    gained : ndarray, shape (...)
        Log evidence of these random values.

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
