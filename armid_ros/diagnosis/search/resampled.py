# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How sure values are where a model gets motions wrong: what they vary by from part to part of data.

What a model gets wrong of a motion is no noise. A value follows it, and another motion would give
another value, whichever of the two days it is from. And what it gets wrong of all motions lies
along a cause by chance, as it does along the other causes that were tried.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.prior import Prior
from armid_ros.diagnosis.data.rows import fold_rows, make_problem, weighted_rows
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.identification.fitting.jackknife import jackknife
from armid_ros.identification.fitting.normal_equations import (
    informative_basis,
    informative_solution,
)
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats

#: One side of a 95 % interval.
_LEVEL = 0.975


def widened(fitted: Fitted, evidence: Evidence, prior: Prior | None, chance: float) -> Fitted:
    """
    Widen deviations to what the values vary by when parts of the data are left out (jackknife).

    Few parts tell a spread badly: deviations are such that twice them has 95 % of Student's
    distribution. None is less than noise as large as the unit makes: where that is a misfit, names
    may have taken a part of it.

    Parameters
    ----------
    fitted : Fitted
        The arm with all names.
    evidence : Evidence
        The data.
    prior : Prior or None
        What other data tell of what is free.
    chance : float
        Squares over the unit that a value of any cause takes of what the names leave; noise alone
        gives one.

    """
    size = len(fitted.estimate.values)
    if not size:
        return fitted
    own, aim = _products(fitted, evidence)
    all_own, all_aim = own.sum(axis=0) + fitted.hold, aim.sum(axis=0) + fitted.pull
    change, std = _values(all_own, all_aim, size)
    variance, freedom = np.zeros(size), 0
    for parts in (list(zip(own, aim, strict=True)), _recordings_before(fitted, prior)):
        if len(parts) > 1:
            held = [_values(all_own - x, all_aim - y, size) for x, y in parts]
            variance += jackknife(change, std, *np.array(held).transpose(1, 0, 2))
            freedom += len(parts) - 1
    few = float(stats.t.ppf(_LEVEL, freedom) / stats.norm.ppf(_LEVEL))
    unit = std**2
    found = few**2 * variance + max(chance - 1.0, 0.0) * unit
    return _with_deviation(fitted, np.sqrt(np.maximum(found, unit)))


def as_change(fitted: Fitted, prior: Prior, baseline: Baseline) -> Fitted:
    """
    Widen deviations by what the model had wrong along each name before.

    The values are those of now, of which a part may have been there. That something has changed is
    another question, which the recordings of both days answer.

    Parameters
    ----------
    fitted : Fitted
        The arm with all names.
    prior : Prior
        What recordings from before tell of what is free.
    baseline : Baseline
        Those recordings.

    """
    before = _seen_before(fitted, prior, baseline)
    return _with_deviation(fitted, np.hypot(_known(fitted), before))


def with_model_error(
    fitted: Fitted, evidence: Evidence, arm: ArmModel, covariance: FloatArray
) -> Fitted:
    """
    Widen deviations by what the parameters of a model are off by, which names make up for.

    Parameters
    ----------
    fitted : Fitted
        The model with all names.
    evidence : Evidence
        The data.
    arm : ArmModel
        The model.
    covariance : ndarray, shape (P, P)
        Of its parameters.

    """
    size = len(fitted.estimate.values)
    if not size:
        return fitted
    data, sigma = evidence.data, evidence.sigma
    own = np.zeros((len(fitted.hold), len(fitted.hold)))
    error = np.zeros((len(own), len(covariance)))
    torques = [part.reduce(arm.columns(part.motion)) for part in data]
    pairs = weighted_rows(fitted.columns, data, sigma), weighted_rows(torques, data, sigma)
    for columns, torque in zip(*pairs, strict=True):
        x = columns.reshape(-1, len(own))
        own += x.T @ x
        error += x.T @ torque.reshape(len(x), -1)
    follows = informative_solution(own + fitted.hold, error)[-size:]
    variance = np.einsum('kp,pq,kq->k', follows, covariance, follows)
    return _with_deviation(fitted, np.hypot(_known(fitted), np.sqrt(np.maximum(variance, 0.0))))


def _known(fitted: Fitted) -> FloatArray:
    """Return the deviations that are known, zero where none is, shape (p,)."""
    std = fitted.estimate.std
    return np.where(np.isfinite(std), std, 0.0)


def _with_deviation(fitted: Fitted, deviation: FloatArray) -> Fitted:
    """Return the same with deviations of the values (p,) that are no less than before."""
    factor = np.maximum(deviation / np.maximum(fitted.estimate.std, 1e-300), 1.0)
    covariance = fitted.estimate.covariance * np.outer(factor, factor)
    return replace(fitted, estimate=replace(fitted.estimate, covariance=covariance))


def _products(fitted: Fitted, evidence: Evidence) -> tuple[FloatArray, FloatArray]:
    """Return products of columns with each other and the rest, of each part, (K, f, f), (K, f)."""
    problem = make_problem(evidence.data, evidence.sigma, fitted.residual, list(fitted.columns))
    fold, width = fold_rows(evidence.data), problem.x.shape[2]
    own, aim = [], []
    for k in range(int(fold.max()) + 1):
        x, y = problem.x[fold == k].reshape(-1, width), problem.y[fold == k].ravel()
        own.append(x.T @ x)
        aim.append(x.T @ y)
    return np.array(own), np.array(aim)


def _values(own: FloatArray, aim: FloatArray, size: int) -> tuple[FloatArray, FloatArray]:
    """Return the last values that solve normal equations, and their deviations, each (p,)."""
    basis = informative_basis(own)
    return (basis @ (basis.T @ aim))[-size:], np.sqrt(np.sum(basis[-size:] ** 2, axis=1))


def _recordings_before(fitted: Fitted, prior: Prior | None) -> list[tuple[FloatArray, FloatArray]]:
    """Return products of columns with each other and the rest, of recordings from before."""
    if prior is None:
        return []
    products = []
    for x, y in prior.recordings(fitted.change):
        rank = x.shape[1]
        own, aim = np.zeros_like(fitted.hold), np.zeros_like(fitted.pull)
        own[:rank, :rank], aim[:rank] = x.T @ x, x.T @ y
        products.append((own, aim))
    return products


def _seen_before(fitted: Fitted, prior: Prior, baseline: Baseline) -> FloatArray:
    """
    Return the values that names seem to have had before, what is free fitted beside them, (p,).

    None is taken to have been larger than it is now; what shapes were is not asked.

    """
    result = np.zeros(len(fitted.estimate.values))
    left = prior.residual - prior.columns @ fitted.change
    for own, values, (places, _) in zip(fitted.named, fitted.values, fitted.places, strict=True):
        kept = list(own.kept)
        pair = np.column_stack([baseline.columns(fitted.arm, own.effect, kept), left])
        pair -= prior.columns @ prior.nearest(pair)
        size = np.maximum(np.abs(values[kept]), 1e-300)
        scaled = pair[:, :-1] * size
        precision = scaled.T @ scaled + np.eye(len(kept))
        result[list(places)] = size * np.linalg.solve(precision, scaled.T @ pair[:, -1])
    return result
