# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What every candidate explains of data that its values were not fitted to, and how sure values are.

The nuisance parameters are fitted to all folds but one, without a candidate and jointly with it,
and both fits predict the fold that was left out. What the candidate adds to that prediction, x, is
compared with the residual without it, r: the squares fall by 2 x'r - x'x, and the slope of r on x
is one for a cause and zero for what follows noise. Both are known block by block, so that their
intervals hold whatever the colour of the residual. All of it is algebra on products of columns, a
small matrix for each block.

The misfit of a model is no noise. A value follows the misfit, and another motion, of either day,
would give another value: values are as sure as they agree from fold to fold. And a misfit common
to all motions correlates with a cause by chance, as it does with the other candidates that were
tried.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.baseline import Baseline, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import each_times, make_problem, Problem, Products, products
from armid_ros.diagnosis.data.trajectory import fold_rows
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.diagnosis.search.search_state import BaselineRows, Nuisance
from armid_ros.diagnosis.search.trial import Candidate, IDENTIFIABLE, Trial
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.fitting.normal_equations import (
    independent_inverse,
    informative_basis,
    informative_solution,
    jackknife,
    NormalEquations,
    UNINFORMATIVE,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import stats

#: Weighted squares of columns that are rounding, whatever the units.
_NOTHING = 1e-100


@dataclass(frozen=True)
class _Fits:
    """
    Nuisance parameters, fitted to all folds but each in turn, and last to all of them.

    Attributes
    ----------
    train : ndarray, shape (K + 1, B)
        One for the blocks that each fit uses, zero for those left out.
    theta : ndarray, shape (K + 1, f)
        Values.
    border : ndarray, shape (K + 1, f, C)
        Products of the nuisance columns with those of the candidates, and ``solved`` the
        coefficients of the regression of the latter on the former.
    left : ndarray, shape (B, f)
        Products of the nuisance columns with the residual of the fit to the other folds.
    target : ndarray, shape (B, C)
        Products of the columns of the candidates with the same.
    made : ndarray, shape (B, f, C)
        Products of the nuisance columns with twice those of the candidates, less what the
        regression on the other folds predicts of these.

    """

    train: FloatArray
    theta: FloatArray
    border: FloatArray
    solved: FloatArray
    left: FloatArray
    target: FloatArray
    made: FloatArray

    @classmethod
    def of(cls, known: Products, part: npt.NDArray[np.intp], prior: NormalEquations) -> _Fits:
        """Fit the nuisance parameters; ``part`` is the fold of each block, shape (B,)."""
        train = np.ones((int(part.max()) + 2, len(part)))
        train[part, np.arange(len(part))] = 0.0
        border = np.tensordot(train, known.border, 1)
        aim = train @ known.aim + prior.vector
        theta, solved = np.empty_like(aim), np.empty_like(border)
        for k, own in enumerate(np.tensordot(train, known.free, 1)):
            basis = informative_basis(own + prior.matrix)
            theta[k], solved[k] = basis @ (basis.T @ aim[k]), basis @ (basis.T @ border[k])
        others = theta[part]
        return cls(
            train,
            theta,
            border,
            solved,
            known.aim - each_times(known.free, others),
            known.target - each_times(known.border.transpose(0, 2, 1), others),
            2.0 * known.border - known.free @ solved[part],
        )


def held_out(
    problem: Problem,
    free: Sequence[int],
    candidates: Sequence[Candidate],
    prior: NormalEquations,
    whole: bool = True,
) -> tuple[list[Trial], FloatArray]:
    """
    Try every candidate jointly with the nuisance parameters.

    Parameters
    ----------
    problem : Problem
        Rows; columns of the candidates come first.
    free : sequence of int
        Nuisance columns.
    candidates : sequence of Candidate
        The candidates.
    prior : NormalEquations
        Prior of the nuisance parameters.
    whole : bool
        Whether the prior counts as data: a better agreement of the nuisance parameters with it is
        a gain of the candidate as well.

    Returns
    -------
    trials : list of Trial
        In the order of the candidates, without those of which nothing is visible.
    power : ndarray, shape (B,)
        Held-out squares without any of them.

    """
    return evaluate_candidates(
        products(problem, free, [one.columns for one in candidates]),
        problem,
        candidates,
        prior,
        whole,
    )


def evaluate_candidates(
    known: Products,
    problem: Problem,
    candidates: Sequence[Candidate],
    prior: NormalEquations,
    whole: bool = True,
) -> tuple[list[Trial], FloatArray]:
    """Try every candidate, from the products of all columns; see `held_out`."""
    part = problem.fold_of_block
    fits = _Fits.of(known, part, prior)
    theta = fits.theta[part]
    power = known.power - np.sum(theta * (known.aim + fits.left), axis=1)
    counted = prior if whole else NormalEquations.none(len(prior.vector))
    trials = [
        _tried(known, candidate, k, fits, part, counted) for k, candidate in enumerate(candidates)
    ]
    return [trial for trial in trials if trial is not None], power


def _tried(
    known: Products,
    candidate: Candidate,
    position: int,
    fits: _Fits,
    part: npt.NDArray[np.intp],
    counted: NormalEquations,
) -> Trial | None:
    span, own = candidate.columns, known.own[position]
    border, solved = fits.border[:, :, span], fits.solved[:, :, span]
    whole = own.sum(axis=0)
    rest = np.tensordot(fits.train, own, 1) - border.transpose(0, 2, 1) @ solved
    size = float(np.trace(whole))
    visible = float(np.sqrt(max(np.trace(rest[-1]), 0.0) / size)) if size > _NOTHING else 0.0
    if visible**2 < UNINFORMATIVE:
        return None
    aim = fits.train @ known.target[:, span] - each_times(border.transpose(0, 2, 1), fits.theta)
    inverse, values = _held(rest, aim, whole, candidate)
    resolved = np.diag(inverse[-1] @ rest[-1]) > IDENTIFIABLE
    std = np.sqrt(np.diag(inverse[-1]).clip(0.0))
    narrower = candidate.as_found(values[-1], np.where(resolved, std, np.inf))
    if np.any(narrower.precision != candidate.precision):
        candidate = narrower
        inverse, values = _held(rest, aim, whole, candidate)
    change = -each_times(solved, values)
    v, moved = values[part], change[part]
    cross = np.sum(fits.target[:, span] * v, axis=1) + np.sum(fits.left * moved, axis=1)
    square = np.sum(each_times(own, v) * v, axis=1)
    square += np.sum(each_times(fits.made[:, :, span], v) * moved, axis=1)
    held, alone = change[:-1], fits.theta[:-1]
    share = 1.0 / (len(held) * np.maximum(np.bincount(part), 1))
    cross += (share * np.sum(held * (counted.vector - alone @ counted.matrix), axis=1))[part]
    square += (share * np.sum(held * (held @ counted.matrix), axis=1))[part]
    std = np.sqrt(np.maximum(np.diagonal(inverse, axis1=1, axis2=2), 0.0))
    return Trial(
        candidate,
        values[-1],
        std[-1],
        np.diag(inverse[-1] @ rest[-1]),
        visible,
        cross,
        square,
        values[:-1],
        std[:-1],
        alone + held,
        alone,
        part,
    )


def _held(
    rest: FloatArray, aim: FloatArray, whole: FloatArray, candidate: Candidate
) -> tuple[FloatArray, FloatArray]:
    """Return inverses (K, p, p) and values (K, p) under the prior of a candidate."""
    inverse = independent_inverse(rest + np.diag(candidate.precision), np.diag(whole))
    return inverse, each_times(inverse, aim)


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
        Mean gain per value, over all candidates, on the residual that the names leave; noise alone
        gives one.

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
    candidates = [Candidate(own.effect, slice(0), own.kept, robot) for own in fitted.named]
    every, first = range(len(today.vector)), len(there)
    nuisance = Nuisance(tuple(every), fitted.prior)
    known = BaselineRows(baseline, prior, fitted.change).information(
        candidates, fitted.arm, nuisance
    )
    whole = known + today.among([*(rank + k for k in there), *every])
    scale = np.concatenate([np.abs(fitted.estimate.values[there]), np.ones(len(every))])
    products = whole.matrix * np.outer(scale, scale)
    products[:first, :first] += np.eye(first)
    return informative_solution(products, whole.vector * scale)[first + rank :]
