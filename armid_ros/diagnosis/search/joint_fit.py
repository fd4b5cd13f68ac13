# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Joint fit of the values and shapes of all named effects, with posterior mean and covariance.

Rigid body, friction and model discrepancy are integrated out (`Nuisance`). Torque is nonlinear in
encoder offsets, delays, elasticities and shapes: their columns are recomputed at each mean
(Gauss-Newton). Values stay within their physical bounds.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.arm.model_file import add_effect
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import Rows
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.search.candidates import cause_of, value_unit
from armid_ros.diagnosis.search.cause import bounds_of_change, NamedEffect
from armid_ros.diagnosis.search.hyperparameters import CORRELATED_ROWS, Hyperparameters
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.effects import Effect, TorqueReading
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class Fitted:
    """
    Arm model with the named effects at their posterior means, and their estimate.

    Attributes
    ----------
    arm : ArmModel
        The arm; the named effects are its last effects.
    named : tuple of NamedEffect
        The named effects, with their fitted shapes and values.
    estimate : Estimate
        Fitted values and shapes of the named effects; the variance of a value that data do not
        determine is infinite.
    means : ndarray, shape (q,)
        Posterior means of the nuisance parameters.

    """

    arm: ArmModel
    named: tuple[NamedEffect, ...]
    estimate: Estimate
    means: FloatArray


@dataclass(frozen=True)
class JointFit:
    """
    Least-squares problem for named effects together with the nuisance parameters.

    Attributes
    ----------
    arm : ArmModel
        The arm without named effects.
    nuisance : Nuisance
        Regression problem of the nuisance parameters, without accepted causes.
    hyperparameters : Hyperparameters
        Standard deviations of discrepancy and noise.
    recordings : tuple of int
        Indices of the recordings that are fitted.
    patches_body : bool
        Whether the fitted arm includes the fitted change of rigid body and friction.
    spread : float
        Variance of values between recordings, over their variance for white noise.

    """

    arm: ArmModel
    nuisance: Nuisance
    hyperparameters: Hyperparameters
    recordings: tuple[int, ...]
    patches_body: bool
    spread: float = 0.0

    @classmethod
    def over_noise(cls, arm: ArmModel, evidence: Evidence, rng: np.random.Generator) -> JointFit:
        """
        Return the least-squares problem with free rigid body and without discrepancy.

        Parameters
        ----------
        arm : ArmModel
            The arm.
        evidence : Evidence
            Recordings with their noise.
        rng : numpy.random.Generator
            Draws the random states from which base parameters are found.

        """
        nuisance = Nuisance.of(Rows.over_noise(evidence), memoized_arm(arm), rng)
        every = tuple(range(len(nuisance.columns)))
        hyperparameters = Hyperparameters(1.0, 0.0, 0.0, 1.0, CORRELATED_ROWS)
        return cls(nuisance.arm, nuisance, hyperparameters, every, patches_body=True)

    def fit(self, named: Sequence[NamedEffect] = ()) -> Fitted:
        """
        Fit values and shape parameters of named effects by Gauss-Newton with a line search.

        Parameters
        ----------
        named : sequence of NamedEffect
            The effects with their initial values.

        """
        start = np.zeros(sum(len(own.kept) + len(own.effect.shape) for own in named))
        named = step_within_bounds(self.arm, named, start)
        linear = self.linear(named)
        posterior = linear.posterior(self.hyperparameters, self.recordings)
        loss = self._loss(named)
        # the comparison has refined the shapes, so four Gauss-Newton steps suffice
        for _ in range(4 if named else 0):
            means = linear.means(posterior)
            step = means[linear.value_slices[0].start : linear.value_slices[len(named) - 1].stop]
            for own, (kept, _) in zip(named, parameter_ranges(named), strict=True):
                step[kept.start : kept.stop] -= own.values[list(own.kept)]
            before = loss
            for share in (1.0, 0.5, 0.2):  # line search
                tried = step_within_bounds(self.arm, named, share * step)
                loss = self._loss(tried)
                if loss < before:
                    break
            else:
                break
            named, linear = tried, self.linear(tried)
            posterior = linear.posterior(self.hyperparameters, self.recordings)
            if before - loss < 1e-4 * max(abs(loss), 1e-12):
                break
        means, covariance_of_all = linear.moments(posterior)
        size = self.nuisance.columns[0].shape[2]
        change = self._change_by_first_day(linear, means)
        covariance = covariance_of_all[size:, size:] * (1.0 + self.spread) + np.diag(change**2)
        units = np.concatenate([np.zeros(0), *(one.unit for one in linear.accepted)])
        # data that determine a value reduce its prior variance to less than half
        undetermined = np.diag(covariance_of_all)[size:] > 0.5 * units**2
        covariance[undetermined], covariance[:, undetermined] = 0.0, 0.0
        covariance[undetermined, undetermined] = np.inf
        names, values = list[ParameterName](), list[float]()
        for own in named:  # values first, then shapes
            every = own.effect.parameters(self.arm.robot)
            names += [every[k] for k in own.kept]
            names += own.effect.shape_parameters(self.arm.robot)
            values += [*own.values[list(own.kept)].tolist(), *own.effect.shape]
        estimate = Estimate(tuple(names), np.array(values), covariance)
        return Fitted(self.arm_at(named, means), named, estimate, means[:size])

    def arm_at(self, named: Sequence[NamedEffect], means: FloatArray) -> ArmModel:
        """Return the arm with the named effects and, if `patches_body`, the fitted rigid body."""
        change = means[: self.nuisance.base.rank]
        arm, base, theta = self.arm, self.nuisance.base, self.arm.theta
        if self.patches_body and np.any(change):
            arm = arm.with_theta(base.lift(base.values(theta) + change, theta))
        return patched_arm(arm, named)

    def as_described(self) -> JointFit:
        """Return the same problem with the rigid body of the robot description."""
        return replace(self, hyperparameters=replace(self.hyperparameters, body=0.0))

    def unexplained_residual(self, fitted: Fitted) -> list[FloatArray]:
        """
        Return the residual of diagnosed recordings after all fitted torques are subtracted.

        Returns
        -------
        list of ndarray, each (M, n)
            Residual of each trajectory, zero in rows in which a joint does not move [N m].

        """
        rows = self.nuisance.rows
        nuisance = self.with_model(fitted.arm)
        means = fitted.means.copy()
        means[: self.nuisance.base.rank] *= not self.patches_body
        found = []
        for k in np.flatnonzero(rows.diagnosed).tolist():
            whole, start = nuisance.noise_at(means, self.hyperparameters, k), 0
            for part, weight in zip(rows.data, rows.weight, strict=True):
                if part.fold == k:
                    own = whole[:, start : start + len(weight)].T
                    found.append(own / np.where(weight > 0.0, weight, 1.0))
                    start += len(weight)
        return found

    def with_model(self, model: ArmModel) -> Nuisance:
        """Return the regression problem for the residual of another model."""
        rows = self.nuisance.rows
        unchanged = [np.zeros_like(part.unsure) for part in rows.data]
        return self.nuisance.with_residual(self._weighted_residual(model, unchanged))

    def _weighted_residual(
        self, model: ArmModel, torque: Sequence[FloatArray]
    ) -> list[FloatArray]:
        """Return weighted residuals: of the arm in baseline data, of `model` in diagnosed data."""
        rows, residual = self.nuisance.rows, list(self.nuisance.residual)
        rest = [
            own + part.residual(model) if rows.diagnosed[part.fold] else own
            for own, part in zip(torque, rows.data, strict=True)
        ]
        weighted = rows.weighted([own[:, :, np.newaxis] for own in rest], range(len(rows.torque)))
        for k in np.flatnonzero(rows.diagnosed).tolist():
            residual[k] = weighted[k][:, :, 0]
        return residual

    def _loss(self, named: Sequence[NamedEffect]) -> float:
        """Return the negative log likelihood of effects; nuisance parameters are fitted."""
        nuisance = self.with_model(patched_arm(self.arm, named))
        return nuisance.posterior(self.hyperparameters, self.recordings).loss

    def _change_by_first_day(self, linear: Nuisance, means: FloatArray) -> FloatArray:
        """
        Return how the values change if the causes may act in the baseline as well.

        The prior of a value in the baseline has zero mean, and the present value as standard
        deviation.

        """
        size, both = self.nuisance.columns[0].shape[2], linear
        if not self.nuisance.rows.n_baseline:
            return np.zeros(len(means) - size)
        for one, span in zip(linear.accepted, linear.value_slices, strict=True):
            if one.effect.lasting:
                continue
            unit = np.clip(np.abs(means[span]), 1e-3 * one.unit, one.unit)
            both = both.and_cause(replace(one, unit=unit, always=True))
        posterior = both.posterior(self.hyperparameters, self.recordings)
        return both.means(posterior)[size : len(means)] - means[size:]

    def linear(self, named: Sequence[NamedEffect]) -> Nuisance:
        """Return the regression problem, linearised at the values of the named effects."""
        if not named:
            return self.nuisance
        model = patched_arm(self.arm, named)
        rows, result = self.nuisance.rows, self.nuisance
        fitted = [k for k, part in enumerate(rows.data) if part.fold in self.recordings]
        blocks = {k: patch_columns(self.arm, named, rows.data[k]) for k in fitted}
        torque = [np.zeros_like(part.unsure) for part in rows.data]
        for n, own in enumerate(named):
            count, kept = blocks[fitted[0]][n].shape[2], list(own.kept)
            columns = [
                blocks[k][n] if k in blocks else np.zeros((*part.unsure.shape, count))
                for k, part in enumerate(rows.data)
            ]
            only = [x[:, :, : len(kept)] for x in columns]
            unit = value_unit(self.nuisance, own.effect, own.kept, rows.rms_of_diagnosed(only))
            # without a default, a shape is a position of 0.1 rad or m
            least = [abs(s.default) or 0.1 for s in own.effect.shapes]
            size = np.tile(least, len(own.effect.owners))
            # the comparison has refined the shape, so its prior deviation is small
            shapes = 0.3 * np.maximum(np.abs(own.effect.shape), size)
            unit = np.concatenate([unit, shapes])
            cause = cause_of(self.nuisance, own.effect, own.kept, columns, unit)
            result = result.and_cause(cause)
            for total, x in zip(torque, only, strict=True):
                total += x @ own.values[kept]
        return result.with_residual(self._weighted_residual(model, torque))


def patched_arm(arm: ArmModel, named: Sequence[NamedEffect]) -> ArmModel:
    """Add effects with their values to an arm model."""
    for own in named:
        arm = add_effect(arm, own.effect, own.values)
    return arm


def step_within_bounds(
    arm: ArmModel, named: Sequence[NamedEffect], change: FloatArray
) -> tuple[NamedEffect, ...]:
    """Change the fitted parameters of named effects by a step, within their bounds."""
    found = []
    for own, (place, shapes) in zip(named, parameter_ranges(named), strict=True):
        effect = own.effect
        lower, upper = bounds_of_change(effect, arm)
        values = own.values.copy()
        values[list(own.kept)] += change[list(place)]
        if shapes:
            low, high, step = _shape_bounds(effect)
            shape = np.array(effect.shape)
            # the search has refined the shape, so a step is small
            limit = np.maximum(0.1 * np.abs(shape), 30.0 * step)
            shape = shape + np.clip(change[list(shapes)], -limit, limit)
            effect = effect.with_shape(np.clip(shape, low, high))
        found.append(NamedEffect(effect, own.kept, np.clip(values, lower, upper)))
    return tuple(found)


def parameter_ranges(named: Sequence[NamedEffect]) -> list[tuple[range, range]]:
    """Return for each effect the index ranges of its values and of its shape parameters."""
    found, start = [], 0
    for own in named:
        shapes = start + len(own.kept)
        stop = shapes + len(own.effect.shape)
        found.append((range(start, shapes), range(shapes, stop)))
        start = stop
    return found


def _shape_bounds(effect: Effect) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lower bound, upper bound and finite-difference step of each shape parameter."""
    owners = len(effect.owners)
    low = np.tile([s.lower for s in effect.shapes], owners)
    high = np.tile([s.upper for s in effect.shapes], owners)
    size = np.tile([max(abs(s.default), 1e-3) for s in effect.shapes], owners)
    return low, high, 1e-3 * np.maximum(np.abs(np.array(effect.shape)), 0.1 * size)


def patch_columns(
    arm: ArmModel, named: Sequence[NamedEffect], part: Trajectory
) -> list[FloatArray]:
    """Return the torque's Jacobian by values and shape parameters of each effect, (M, n, p)."""
    model, blocks = memoized_arm(patched_arm(arm, named)), []
    for own in named:
        columns = [model.columns_of(own.effect, part.motion)[:, :, list(own.kept)]]
        if own.effect.shape:
            columns.append(_shape_columns(model, own.effect, part.motion))
        blocks.append(part.reduce(np.concatenate(columns, axis=2)))
    return blocks


def _shape_columns(model: ArmModel, effect: Effect, motion: Motion) -> FloatArray:
    """Return the torque's Jacobian by shape parameters, by finite differences, (N, n, S)."""
    place = len(model.effects) - 1 - model.effects[::-1].index(effect)
    low, high, step = _shape_bounds(effect)
    shape = np.array(effect.shape)

    def torque(index: int, value: float) -> FloatArray:
        moved = shape.copy()
        moved[index] = value
        other = effect.with_shape(moved)
        if effect.linear and not isinstance(effect, TorqueReading):
            return np.asarray(model.columns_of(other, motion) @ model.values[place])
        effects = (*model.effects[:place], other, *model.effects[place + 1 :])
        return replace(model, effects=effects).torque(motion)

    columns = np.empty((len(motion), motion.n_joints, len(shape)))
    for k, own in enumerate(step):
        above, below = np.clip(shape[k] + [own, -own], low[k], high[k]).tolist()
        columns[:, :, k] = (torque(k, above) - torque(k, below)) / max(above - below, 1e-12)
    return columns
