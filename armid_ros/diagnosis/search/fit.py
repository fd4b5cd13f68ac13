# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The joint fit of a patched model: rigid body, known effects and named effects, with their shapes.

Gauss-Newton steps on the filtered residual, as encoder offsets, delays and elasticities are linear
to the first order only. Values stay within their physical bounds.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import described_precision, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.cause import SelectedEffect
from armid_ros.diagnosis.search.patch import Patch, patch_columns
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.fitting.least_squares import noise_products
from armid_ros.identification.fitting.normal_equations import (
    informative_basis,
    informative_solution,
    NO_COLUMN,
    NormalEquations,
)
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters, group_columns
from armid_ros.motion import FloatArray
import numpy as np

#: Most Gauss-Newton steps; shapes are near already.
_MOST_ROUNDS = 4


@dataclass(frozen=True)
class Fitted:
    """
    An arm fitted to the data.

    Attributes
    ----------
    arm : ArmModel
        The arm; the named effects are its last ones.
    named : tuple of SelectedEffect
        The named effects, with their fitted shapes.
    estimate : Estimate
        Of the parameters of the named effects, shapes included.
    residual : tuple of ndarray, each (M, n)
        Residual of each trajectory [N m].
    columns : tuple of ndarray, each (M, n, f)
        Jacobian columns of all fitted parameters.
    values : tuple of ndarray
        All values of each named effect.
    prior : NormalEquations
        Prior of a further step of all fitted parameters.
    change : ndarray, shape (r,)
        Change of the fitted base parameters from the given ones.

    """

    arm: ArmModel
    named: tuple[SelectedEffect, ...]
    estimate: Estimate
    residual: tuple[FloatArray, ...]
    columns: tuple[FloatArray, ...]
    values: tuple[FloatArray, ...]
    prior: NormalEquations
    change: FloatArray

    @property
    def places(self) -> tuple[tuple[range, range], ...]:
        """Positions in the estimate of the values of each name, and of its shapes."""
        places, start = [], 0
        for own in self.named:
            shapes = start + len(own.kept)
            stop = shapes + len(own.effect.shape)
            places.append((range(start, shapes), range(shapes, stop)))
            start = stop
        return tuple(places)


@dataclass(frozen=True)
class Start:
    """
    Where a fit begins.

    Attributes
    ----------
    values : sequence of ndarray
        Values of the named effects; zero if there are none.
    change : ndarray, shape (r,), or None
        Change of the base parameters.

    """

    values: Sequence[FloatArray] = ()
    change: FloatArray | None = None


def fit(
    arm: ArmModel,
    named: Sequence[SelectedEffect],
    evidence: Evidence,
    base: BaseParameters | None,
    start: Start | None = None,
    prior: Prior | None = None,
) -> Fitted:
    """
    Fit base parameters and named effects jointly.

    Parameters
    ----------
    arm : ArmModel
        The arm without the named effects.
    named : sequence of SelectedEffect
        The named effects.
    evidence : Evidence
        The data, and the unit that each is weighted by.
    base : BaseParameters or None
        Base parameters of the arm that are fitted; None keeps it as it is.
    start : Start, optional
        Where to begin; at the arm as it is by default.
    prior : Prior, optional
        CauseInformation of other data about the base parameters.

    """
    start = start or Start()
    values = list(start.values) or [np.zeros(len(n.effect.parameters(arm.robot))) for n in named]
    state = Patch(arm, tuple(named), tuple(values), np.zeros(0 if base is None else base.rank))
    if start.change is not None and base is not None:
        state = state.with_change(start.change, base)
    described = _described(base, arm, prior)
    held = _prior_of_change(described, prior)
    rounds = _MOST_ROUNDS if named else int(base is not None and prior is None)
    state, residual, columns = _settled(state, evidence, base, held, rounds)
    size = len(state.change)
    names, numbers = state.parameters()
    covariance = np.zeros((size, size))
    if named:
        more = [] if prior is None else prior.regressions(state.change, len(numbers))
        covariance = _covariance(columns, residual, evidence, described, more)
    estimate = Estimate(names, numbers, covariance[size:, size:])
    return _fitted(state, residual, columns, held, estimate)


def with_values_of(
    found: Fitted,
    arm: ArmModel,
    evidence: Evidence,
    base: BaseParameters | None = None,
    prior: Prior | None = None,
) -> Fitted:
    """
    Return an arm with the names of a fit at the values that they have there.

    Parameters
    ----------
    found : Fitted
        The fit.
    arm : ArmModel
        An arm without the named effects.
    evidence : Evidence
        The data of residual and columns.
    base : BaseParameters, optional
        Base parameters that columns are of; they stay as they are.
    prior : Prior, optional
        CauseInformation of other data about them.

    """
    state = Patch(arm, found.named, found.values, np.zeros(0 if base is None else base.rank))
    residual = evidence.residuals(state.model)
    columns = [patch_columns(state, part, base) for part in evidence.data]
    held = _prior_of_change(_described(base, arm, prior), prior)
    return _fitted(state, residual, columns, held, found.estimate)


def _described(base: BaseParameters | None, arm: ArmModel, prior: Prior | None) -> FloatArray:
    """Return the precision of base parameters without other data, (r, r); none if held."""
    if base is None:
        return np.zeros((0, 0))
    return described_precision(base, arm) if prior is None else prior.described


def _prior_of_change(described: FloatArray, prior: Prior | None) -> NormalEquations:
    """Return the prior of a change of base parameters: the description, and other data."""
    held = NormalEquations(described, np.zeros(len(described)))
    return held + prior.of_change if prior is not None and len(described) else held


def _fitted(
    state: Patch,
    residual: Sequence[FloatArray],
    columns: Sequence[FloatArray],
    held: NormalEquations,
    estimate: Estimate,
) -> Fitted:
    open_values = np.zeros(columns[0].shape[2] - len(state.change))
    return Fitted(
        state.model,
        state.named,
        estimate,
        tuple(residual),
        tuple(columns),
        state.values,
        held.after(state.change).and_zeros(open_values),
        state.change,
    )


def _settled(
    state: Patch,
    evidence: Evidence,
    base: BaseParameters | None,
    known: NormalEquations,
    rounds: int,
) -> tuple[Patch, list[FloatArray], list[FloatArray]]:
    """
    Take Gauss-Newton steps until one changes nothing, or the loss is what the Jacobian predicts.

    Parameters
    ----------
    state : Patch
        Where to begin.
    evidence : Evidence
        The data.
    base : BaseParameters or None
        Base parameters of the arm that are fitted.
    known : NormalEquations
        Prior of their change.
    rounds : int
        Most steps.

    Returns
    -------
    state : Patch
    residual : list of ndarray, each (M, n)
        Its residual [N m].
    columns : list of ndarray, each (M, n, f)
        Jacobian columns of all fitted parameters, at this state.

    """
    data = evidence.data

    def loss_of(patch: Patch, residual: Sequence[FloatArray]) -> float:
        change = patch.change
        away = change @ known.matrix @ change - 2.0 * known.vector @ change
        return float(sum(np.sum(own**2) for own in evidence.weighted(residual))) + float(away)

    residual = evidence.residuals(state.model)
    loss = loss_of(state, residual)
    columns = [patch_columns(state, part, base) for part in data]
    for _ in range(rounds):
        moved, after, expected = state, residual, loss
        for step in _steps(state, columns, residual, evidence, known):
            trial = state.moved(step, base)
            tried = evidence.residuals(trial.model)
            if loss_of(trial, tried) < loss:
                moved, after = trial, tried
                expected = loss_of(trial, _expected(residual, columns, step))
                break
        new = loss_of(moved, after)
        small = 1e-4 * max(abs(new), 1e-12)
        settled = loss - new < small or abs(new - expected) < small
        if moved is not state:
            columns = [patch_columns(moved, part, base) for part in data]
        state, residual, loss = moved, after, new
        if settled:
            break
    return state, residual, columns


def _steps(
    state: Patch,
    columns: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    evidence: Evidence,
    known: NormalEquations,
) -> Iterator[FloatArray]:
    """
    Yield steps of all fitted parameters to try in turn, shape (f,).

    Where the columns of a shape and its value are nearly collinear, both steps are large, which a
    shape does not allow: the last step leaves shapes as they are.

    """
    known = known.after(state.change)
    whole = _step(columns, residual, evidence, known)
    yield from (whole, 0.5 * whole, 0.2 * whole)
    if state.linear.all():
        return
    flat = [block * state.linear for block in columns]
    yield _step(flat, residual, evidence, known)


def _expected(
    residual: Sequence[FloatArray], columns: Sequence[FloatArray], step: FloatArray
) -> list[FloatArray]:
    """Return the residual after a step if torques were linear in all fitted parameters."""
    size = len(step)
    return [
        own - (block.reshape(-1, size) @ step).reshape(own.shape)
        for own, block in zip(residual, columns, strict=True)
    ]


def _step(
    columns: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    evidence: Evidence,
    prior: NormalEquations,
) -> FloatArray:
    """Return the weighted least-squares step under a prior; zero where it is not identifiable."""
    size = columns[0].shape[2]
    own, aim = np.zeros((size, size)), np.zeros(size)
    residuals = evidence.weighted(residual)
    for block, own_residual in zip(evidence.weighted(columns), residuals, strict=True):
        flat = block.reshape(-1, size)
        own += flat.T @ flat
        aim += flat.T @ own_residual.ravel()
    known = len(prior.vector)
    own[:known, :known] += prior.matrix
    aim[:known] += prior.vector
    seen = np.diag(own) > NO_COLUMN * np.diag(own).max(initial=1e-300)
    step = np.zeros(size)
    step[seen] = informative_solution(own[np.ix_(seen, seen)], aim[seen])
    return step


def _covariance(
    columns: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    evidence: Evidence,
    described: FloatArray,
    more: Sequence[Regression] = (),
) -> FloatArray:
    """
    Return the covariance under coloured noise, (f, f); infinite where other columns make one.

    Parameters
    ----------
    columns, residual : sequence of ndarray, each (M, n, f) and (M, n)
        Of each trajectory.
    evidence : Evidence
        The data; the residual shows the colour of their noise.
    described : ndarray, shape (r, r)
        Precision of the first values by the description.
    more : sequence of Regression
        Other data, weighted.

    """
    size = columns[0].shape[2]
    precision = np.zeros((size, size))
    precision[: len(described), : len(described)] = described
    rows = zip(evidence.data, evidence.weighted(columns), evidence.weighted(residual), strict=True)
    problem = [
        Regression(part.source, part.at_rows.with_torque(own), part.informative, block)
        for part, block, own in rows
    ]
    problem += more
    stacked = np.concatenate(
        [*(part.columns.reshape(-1, size) for part in problem), _root(precision)]
    )
    names = tuple(ParameterName(str(k), '', '') for k in range(size))
    kept = group_columns(stacked, names, tolerance=1e-5).independent
    covariance = np.diag(np.full(size, np.inf))
    if not len(kept):
        return covariance
    problem = [part.restrict(kept) for part in problem]
    informative = np.concatenate([part.informative for part in problem]).astype(float)
    target = np.concatenate([part.target for part in problem]) * informative
    try:
        basis = informative_basis(stacked[:, kept].T @ stacked[:, kept])
        products = (
            noise_products(problem, target, informative, basis) + precision[np.ix_(kept, kept)]
        )
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ModelError(f'the patched model cannot be fitted: {error}') from error
    bread = basis @ basis.T
    covariance[np.ix_(kept, kept)] = bread @ products @ bread
    return covariance


def _root(precision: FloatArray) -> FloatArray:
    """Return rows R with R'R = a precision, shape (p, p)."""
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, np.newaxis] * vectors.T)
