# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The joint fit of a patched arm: rigid body, known effects, and what was named, shapes included.

Gauss-Newton on the filtered residual, as encoder offsets, delays and elasticities are linear to
the first order only. Values stay within what is physically possible.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.remembering import remembering
from armid_ros.effects import Effect
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.least_squares import solve
from armid_ros.identification.regression import Regression
from armid_ros.model import BaseParameters, group_columns
from armid_ros.motion import FloatArray
import numpy as np

#: Free columns of which the others leave less than this share of their length are grouped.
_EXCITED = 1e-4
_MOST_ROUNDS = 4
#: How far from its joint a link's mass may be without a word in the description [m].
_REACH = 0.1
#: Largest relative step of a shape in a round: the search has refined it already.
_SHAPE_STEP = 0.1
#: Relative step of the differences by a shape.
_STEP = 1e-3


@dataclass(frozen=True)
class Named:
    """
    An effect that was named, as it is fitted.

    Attributes
    ----------
    effect : Effect
        Joints and shape.
    kept : tuple of int
        Its parameters that are free; the others are zero.

    """

    effect: Effect
    kept: tuple[int, ...]


@dataclass(frozen=True)
class Fitted:
    """
    An arm fitted to the data.

    Attributes
    ----------
    arm : ArmModel
        The arm; the named effects are its last ones.
    named : tuple of Named
        With their shapes as fitted.
    estimate : Estimate
        Of the parameters of the named effects, shapes included.
    residual : tuple of ndarray, each (M, n)
        What is left, per trajectory [N m].
    columns : tuple of ndarray, each (M, n, f)
        Columns of all that was free.

    """

    arm: ArmModel
    named: tuple[Named, ...]
    estimate: Estimate
    residual: tuple[FloatArray, ...]
    columns: tuple[FloatArray, ...]


def excited(
    arm: ArmModel, theory: BaseParameters, data: Sequence[Trajectory]
) -> tuple[BaseParameters, list[FloatArray]]:
    """Return what the motion can tell of rigid body and known effects, and its columns."""
    columns = [part.reduce(arm.columns(part.motion)[:, :, theory.independent]) for part in data]
    stacked = np.concatenate([block.reshape(-1, theory.rank) for block in columns])
    names = tuple(theory.standard[column] for column in theory.independent)
    kept = group_columns(stacked, names, tolerance=_EXCITED)
    if kept.rank == theory.rank:
        return theory, columns
    base = replace(
        theory,
        parameters=tuple(theory.parameters[k] for k in kept.independent),
        independent=theory.independent[kept.independent],
        grouping=kept.grouping @ theory.grouping,
    )
    return base, [block[:, :, kept.independent] for block in columns]


def fit(
    arm: ArmModel,
    named: Sequence[Named],
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    base: BaseParameters | None,
    start: Sequence[FloatArray] = (),
) -> Fitted:
    """
    Fit what is free.

    Parameters
    ----------
    arm : ArmModel
        The arm without the named effects.
    named : sequence of Named
        What was named.
    data : sequence of Trajectory
        The data.
    sigma : sequence of ndarray, shape (n,)
        Noise of each trajectory [N m].
    base : BaseParameters or None
        What is free of the arm; None keeps it as it is.
    start : sequence of ndarray
        Values of the named effects to start from; zero by default.

    """
    values = list(start) or [np.zeros(len(n.effect.parameters(arm.robot))) for n in named]
    state = _State(arm, tuple(named), tuple(values), np.zeros(0 if base is None else base.rank))
    pull = np.zeros((0, 0)) if base is None else _described(base, arm)
    residual = _residuals(state.model, data)
    loss = _loss(residual, data, sigma)
    rounds = _MOST_ROUNDS if named else int(base is not None)
    for _ in range(rounds):
        columns = [_columns(state, part, base) for part in data]
        step = _step(columns, residual, data, sigma, pull, state.change)
        moved, after = state, residual
        for share in (1.0, 0.5, 0.2):
            trial = state.moved(share * step, base)
            left = _residuals(trial.model, data)
            if _loss(left, data, sigma) < loss:
                moved, after = trial, left
                break
        new = _loss(after, data, sigma)
        settled = loss - new < 1e-4 * max(new, 1e-12)
        state, residual, loss = moved, after, new
        if settled:
            break
    columns = [_columns(state, part, base) for part in data]
    size = 0 if base is None else base.rank
    names, numbers = state.parameters()
    covariance = np.zeros((size, size))
    if named:
        covariance = _covariance(columns, residual, data, sigma)
    return Fitted(
        state.model,
        state.named,
        Estimate(names, numbers, covariance[size:, size:]),
        tuple(residual),
        tuple(columns),
    )


@dataclass(frozen=True)
class _State:
    arm: ArmModel
    named: tuple[Named, ...]
    values: tuple[FloatArray, ...]
    change: FloatArray

    @property
    def model(self) -> ArmModel:
        model = self.arm
        for own, values in zip(self.named, self.values, strict=True):
            model = model.with_effect(own.effect, values)
        return model

    def moved(self, change: FloatArray, base: BaseParameters | None) -> _State:
        """Return the state after a step of all that is free, within bounds."""
        arm, start = self.arm, 0
        if base is not None:
            theta = arm.theta
            lifted = base.lift(base.values(theta) + change[: base.rank], theta)
            arm, start = arm.with_theta(lifted), base.rank
        named, values = [], []
        for own, old in zip(self.named, self.values, strict=True):
            effect, kept = own.effect, list(own.kept)
            lower, upper = effect.bounds()
            new = old.copy()
            new[kept] += change[start : start + len(kept)]
            values.append(np.clip(new, lower, upper))
            start += len(kept)
            count = len(effect.shape)
            if count:
                low, high, step = _shape_bounds(effect)
                shape = np.array(effect.shape)
                limit = np.maximum(_SHAPE_STEP * np.abs(shape), 30.0 * step)
                shape = shape + np.clip(change[start : start + count], -limit, limit)
                effect = effect.with_shape(np.clip(shape, low, high))
                start += count
            named.append(Named(effect, own.kept))
        return _State(arm, tuple(named), tuple(values), self.change + change[: len(self.change)])

    def parameters(self) -> tuple[tuple[ParameterName, ...], FloatArray]:
        """Name the free parameters of the named effects, shapes behind quantities."""
        names: list[ParameterName] = []
        numbers: list[float] = []
        for own, values in zip(self.named, self.values, strict=True):
            all_names = own.effect.parameters(self.arm.robot)
            names += [all_names[k] for k in own.kept]
            numbers += [float(values[k]) for k in own.kept]
            names += own.effect.shape_parameters(self.arm.robot)
            numbers += list(own.effect.shape)
        return tuple(names), np.array(numbers)


def _shape_bounds(effect: Effect) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bounds of a shape and steps for differences, per value."""
    owners = len(effect.owners)
    low = np.tile([s.lower for s in effect.shapes], owners)
    high = np.tile([s.upper for s in effect.shapes], owners)
    size = np.tile([max(abs(s.default), 1e-3) for s in effect.shapes], owners)
    return low, high, _STEP * np.maximum(np.abs(np.array(effect.shape)), 0.1 * size)


def _columns(state: _State, part: Trajectory, base: BaseParameters | None) -> FloatArray:
    model, motion = remembering(state.model), part.motion
    blocks = [np.empty((len(motion), motion.n_joints, 0))]
    if base is not None:
        known = len(state.arm.parameters)
        own = [model.rigid_columns(motion)]
        own += [model.columns_of(effect, motion) for effect in state.arm.effects]
        blocks.append(np.concatenate(own, axis=2)[:, :, :known][:, :, base.independent])
    first = len(state.arm.effects)
    for position, named in enumerate(state.named):
        effect = named.effect
        blocks.append(model.columns_of(effect, motion)[:, :, list(named.kept)])
        if effect.shape:
            low, high, step = _shape_bounds(effect)
            shape = np.array(effect.shape)
            ends = []
            for sign in (1.0, -1.0):
                for index in range(len(shape)):
                    moved = shape.copy()
                    moved[index] = np.clip(
                        shape[index] + sign * step[index], low[index], high[index]
                    )
                    effects = list(model.effects)
                    effects[first + position] = effect.with_shape(moved)
                    shifted = replace(model, effects=tuple(effects))
                    ends.append((moved[index], shifted.torque(motion)))
            count = len(shape)
            slopes = [
                (ends[k][1] - ends[count + k][1]) / max(ends[k][0] - ends[count + k][0], 1e-12)
                for k in range(count)
            ]
            blocks.append(np.stack(slopes, axis=2))
    return part.reduce(np.concatenate(blocks, axis=2))


def _residuals(model: ArmModel, data: Sequence[Trajectory]) -> list[FloatArray]:
    return [part.residual(model) for part in data]


def _loss(
    residual: Sequence[FloatArray], data: Sequence[Trajectory], sigma: Sequence[FloatArray]
) -> float:
    parts = zip(residual, data, sigma, strict=True)
    return float(sum(np.sum((left * part.told / s) ** 2) for left, part, s in parts))


def _described(base: BaseParameters, arm: ArmModel) -> FloatArray:
    """
    Return how strongly the description holds the base parameters, as a precision (r, r).

    It is believed to a factor or so: data decide whatever they tell, and what they tell hardly
    stays where it predicts other motions well. A value of zero of an effect is no description.

    """
    size = len(arm.robot.rigid_parameters)
    body = arm.robot.rigid_parameters.reshape(-1, 10)
    mass = np.abs(body[:, :1]) + 0.1 * np.mean(np.abs(body[:, :1]))
    reach = mass * np.array([[1.0] + 3 * [_REACH] + 6 * [_REACH**2]])
    spread = np.full(len(base.standard), np.inf)
    spread[:size] = (np.abs(body) + reach).ravel()
    known = np.abs(arm.theta[size:])
    spread[size:] = np.where(known > 0.0, known, np.inf)
    told = ~np.any((base.grouping != 0.0) & np.isinf(spread), axis=1)
    finite = np.where(np.isfinite(spread), spread, 0.0)
    grouped = base.grouping[told] * finite
    covariance = grouped @ grouped.T
    precision = np.zeros((base.rank, base.rank))
    precision[np.ix_(told, told)] = np.linalg.pinv(covariance, hermitian=True)
    return precision


def _step(
    columns: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    pull: FloatArray,
    change: FloatArray,
) -> FloatArray:
    """Solve with weights, the description pulling; what nothing tells gets no step."""
    size = columns[0].shape[2]
    own, aim = np.zeros((size, size)), np.zeros(size)
    for block, left, part, s in zip(columns, residual, data, sigma, strict=True):
        weight = part.told / s
        flat = (block * weight[:, :, np.newaxis]).reshape(-1, size)
        own += flat.T @ flat
        aim += flat.T @ (left * weight).ravel()
    known = len(change)
    own[:known, :known] += pull
    aim[:known] -= pull @ change
    scale = 1.0 / np.sqrt(np.maximum(np.diag(own), 1e-300))
    values, vectors = np.linalg.eigh(own * np.outer(scale, scale))
    good = values > 1e-10 * max(float(values[-1]), 1e-300) if size else values > 0.0
    basis = scale[:, np.newaxis] * vectors[:, good] / np.sqrt(values[good])
    return np.asarray(basis @ (basis.T @ aim))


def _covariance(
    columns: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> FloatArray:
    """Return the covariance, colour of the residual included; infinite where others make it."""
    size = columns[0].shape[2]
    weighted = [
        c * (part.told / s)[:, :, np.newaxis]
        for c, part, s in zip(columns, data, sigma, strict=True)
    ]
    stacked = np.concatenate([block.reshape(-1, size) for block in weighted])
    names = tuple(ParameterName(str(k), '', '') for k in range(size))
    kept = group_columns(stacked, names, tolerance=1e-5).independent
    problem = [
        Regression(
            part.motion.select(part.rows).with_torque(left * (part.told / s)),
            block[:, :, kept],
            part.told,
            part.source,
        )
        for part, block, left, s in zip(data, weighted, residual, sigma, strict=True)
    ]
    covariance = np.diag(np.full(size, np.inf))
    try:
        covariance[np.ix_(kept, kept)] = solve(problem, 'ols').covariance
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ModelError(f'the patched model cannot be fitted: {error}') from error
    return covariance
