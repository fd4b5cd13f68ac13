# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How sure values are.

The misfit of a model is no noise. A value follows the misfit, and another motion, of either day,
would give another value: values are as sure as they agree from fold to fold. And a misfit common
to all motions correlates with a cause by chance, as it does with other causes.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.diagnosis.data.baseline import Baseline, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import make_problem
from armid_ros.diagnosis.data.trajectory import fold_rows
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.fitting.normal_equations import (
    informative_solution,
    jackknife,
    NormalEquations,
)
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats


def with_jackknife_std(
    fitted: Fitted, evidence: Evidence, prior: Prior | None, chance: float
) -> Fitted:
    """
    Widen standard deviations to the spread of values when folds are left out (jackknife).

    Few folds determine a spread badly: deviations are such that twice them has 95 % of Student's
    distribution. None is less than for noise as large as the unit: where that is a misfit, names
    may have absorbed a part of it.

    Parameters
    ----------
    fitted : Fitted
        The arm with all names.
    evidence : Evidence
        The data.
    prior : Prior or None
        Information of the baseline about the base parameters; each of its recordings is left out
        as well.
    chance : float
        Variance of values by what the names leave, over that for white noise.

    """
    size = len(fitted.estimate.values)
    if not size:
        return fitted
    parts = _by_part(fitted, evidence)
    whole = sum(parts, start=fitted.prior)
    change, std = _values(whole, size)
    variance, freedom = np.zeros(size), 0
    for sources in (parts, _recordings_before(fitted, prior)):
        if len(sources) > 1:
            held = [_values(whole - one, size) for one in sources]
            variance += jackknife(change, std, *np.array(held).transpose(1, 0, 2))
            freedom += len(sources) - 1
    few = float(stats.t.ppf(stats.norm.cdf(HALF_WIDTH), freedom) / HALF_WIDTH)
    unit = std**2
    found = few**2 * variance + max(chance - 1.0, 0.0) * unit
    return _with_deviation(fitted, np.sqrt(np.maximum(found, unit)))


def as_change(fitted: Fitted, evidence: Evidence, prior: Prior, baseline: Baseline) -> Fitted:
    """
    Widen standard deviations by how far values move if names had values in the baseline, too.

    Values of then and now are fitted jointly with a body common to both days. What that body takes
    up as well moves nothing.

    Parameters
    ----------
    fitted : Fitted
        The arm with all names.
    evidence : Evidence
        The data.
    prior : Prior
        Information of the baseline about the base parameters.
    baseline : Baseline
        Those recordings.

    """
    if not fitted.named:
        return fitted
    moved = _moved_by_values_before(fitted, evidence, prior, baseline)
    return _with_deviation(fitted, np.hypot(_known(fitted), moved))


def _known(fitted: Fitted) -> FloatArray:
    """Return the standard deviations, zero where one is infinite, shape (p,)."""
    std = fitted.estimate.std
    return np.where(np.isfinite(std), std, 0.0)


def _with_deviation(fitted: Fitted, deviation: FloatArray) -> Fitted:
    """Return the fit with standard deviations of values (p,), none less than before."""
    factor = np.maximum(deviation / np.maximum(fitted.estimate.std, 1e-300), 1.0)
    covariance = fitted.estimate.covariance * np.outer(factor, factor)
    return replace(fitted, estimate=replace(fitted.estimate, covariance=covariance))


def _by_part(fitted: Fitted, evidence: Evidence) -> list[NormalEquations]:
    """Return the normal equations of each fold for a step of all fitted parameters."""
    problem = make_problem(evidence.data, evidence.sigma, fitted.residual, list(fitted.columns))
    fold, width = fold_rows(evidence.data), problem.x.shape[2]
    parts = [fold == k for k in range(int(fold.max()) + 1)]
    rows = [(problem.x[part].reshape(-1, width), problem.y[part].ravel()) for part in parts]
    return [NormalEquations.of_rows(*own) for own in rows]


def _values(known: NormalEquations, size: int) -> tuple[FloatArray, FloatArray]:
    """Return the posterior means of the last values, and their standard deviations, each (p,)."""
    means, std = known.solution()
    return means[-size:], std[-size:]


def _recordings_before(fitted: Fitted, prior: Prior | None) -> list[NormalEquations]:
    """
    Return the normal equations of each baseline recording for a step of all fitted parameters.

    None without a baseline.

    """
    if prior is None:
        return []
    named = np.zeros(len(fitted.estimate.values))
    recordings = prior.recordings(fitted.change)
    return [NormalEquations.of_rows(x, y).and_zeros(named) for x, y in recordings]


def _moved_by_values_before(
    fitted: Fitted, evidence: Evidence, prior: Prior, baseline: Baseline
) -> FloatArray:
    """
    Return how far values move if names had values in the baseline that are still there, (p,).

    No value is expected to have been larger than now: its present size is the standard deviation
    of its prior, about zero.

    """
    robot, rank = fitted.arm.robot, len(fitted.change)
    there = [k for values, _ in fitted.places for k in values]
    today = sum(_by_part(fitted, evidence), start=NormalEquations.none(len(fitted.prior.vector)))
    own = np.concatenate(
        [baseline.columns(fitted.arm, one.effect, one.kept) for one in fitted.named], axis=1
    )
    spreads = [one.effect.spread(robot)[list(one.kept)] for one in fitted.named]
    rows = np.concatenate([own, prior.columns], axis=1)
    known = NormalEquations.of_rows(rows, prior.residual - prior.columns @ fitted.change)
    every, first = range(len(today.vector)), len(there)
    size = first + len(every)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    among = np.arange(first + rank)
    matrix[np.ix_(among, among)], vector[among] = known.matrix, known.vector
    matrix[first:, first:], vector[first:] = fitted.prior.matrix, fitted.prior.vector
    matrix[:first, :first] += np.diag(np.concatenate(spreads) ** -2.0)
    whole = NormalEquations(matrix, vector) + today.among([*(rank + k for k in there), *every])
    scale = np.concatenate([np.abs(fitted.estimate.values[there]), np.ones(len(every))])
    products = whole.matrix * np.outer(scale, scale)
    products[:first, :first] += np.eye(first)
    return informative_solution(products, whole.vector * scale)[first + rank :]
