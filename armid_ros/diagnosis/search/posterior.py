# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Values of the named effects: the mean and the covariance of their posterior.

The model is that of the comparison of causes (`Nuisance`), with body, friction, discrepancy and
earlier values of the cause integrated out. Encoder offsets, delays, elasticities and shapes are
linear only to first order: the columns are recomputed at each mean (Gauss-Newton), and values
stay within their physical bounds.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.arm.model_file import add_effect
from armid_ros.diagnosis.data.days import Rows
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.search.candidates import cause_of, value_unit
from armid_ros.diagnosis.search.cause import Cause, NamedEffect, room
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.setting import LASTING, Setting
from armid_ros.effects import Effect, TorqueReading
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class Fitted:
    """
    Arm whose named effects have the means of their posteriors as values.

    Attributes
    ----------
    arm : ArmModel
        The arm; the named effects are its last ones.
    named : tuple of NamedEffect
        The named effects, with their fitted shapes and values.
    estimate : Estimate
        Estimate of the fitted parameters of the named effects, shapes included; the variance of a
        value that data do not determine is infinite.
    means : ndarray, shape (q,)
        Means of the nuisance parameters.

    """

    arm: ArmModel
    named: tuple[NamedEffect, ...]
    estimate: Estimate
    means: FloatArray


@dataclass(frozen=True)
class JointFit:
    """
    Values of named effects, fitted jointly with the nuisance parameters.

    Attributes
    ----------
    arm : ArmModel
        The arm without named effects.
    nuisance : Nuisance
        Data and nuisance columns, without accepted causes.
    setting : Setting
        Amplitudes of discrepancy and noise.
    recordings : tuple of int
        Recordings that are fitted.
    stated : bool
        Whether the fitted arm includes the fitted change of body and friction.
    spread : float
        Variance of values between recordings, over their variance for white noise.

    """

    arm: ArmModel
    nuisance: Nuisance
    setting: Setting
    recordings: tuple[int, ...]
    stated: bool
    spread: float = 0.0

    @classmethod
    def over_noise(
        cls,
        arm: ArmModel,
        evidence: Evidence,
        rng: np.random.Generator,
        known: FloatArray | None = None,
    ) -> JointFit:
        """
        Return a fit with a free rigid body, in which the residual is only noise.

        Parameters
        ----------
        arm : ArmModel
            The arm.
        evidence : Evidence
            Data and their noise.
        rng : numpy.random.Generator
            Draws the random states from which base parameters are found.
        known : ndarray, shape (P, P), optional
            Information on the parameters of the arm, added to that of its description.

        """
        nuisance = Nuisance.of(Rows.over_noise(evidence), memoized_arm(arm), rng, known)
        every = tuple(range(len(nuisance.columns)))
        setting = Setting(1.0, 0.0, 0.0, 1.0, LASTING)
        return cls(nuisance.arm, nuisance, setting, every, stated=True)

    @property
    def refits_body(self) -> bool:
        """Whether the body of the arm is refitted."""
        return self.stated and self.setting.body > 0.0

    def fit(self, named: Sequence[NamedEffect] = ()) -> Fitted:
        """
        Fit the values of named effects.

        Parameters
        ----------
        named : sequence of NamedEffect
            The effects at their initial values.

        """
        linear, named = self.linear(named), tuple(named)
        under = linear.marginal(self.setting, self.recordings)
        loss = self._loss(named)
        # the comparison has refined the shapes, so four Gauss-Newton steps suffice
        for _ in range(4 if named else 0):
            means = linear.means(under)
            step = means[linear.spans[0].start : linear.spans[len(named) - 1].stop]
            for own, (kept, _) in zip(named, places(named), strict=True):
                step[kept.start : kept.stop] -= own.values[list(own.kept)]
            before = loss
            for share in (1.0, 0.5, 0.2):  # line search
                tried = moved(self.arm, named, share * step)
                loss = self._loss(tried)
                if loss < before:
                    break
            else:
                break
            named, linear = tried, self.linear(tried)
            under = linear.marginal(self.setting, self.recordings)
            if before - loss < 1e-4 * max(abs(loss), 1e-12):
                break
        means, posterior = linear.whole(under)
        size = self.nuisance.columns[0].shape[2]
        change = self._change_by_first_day(linear, means)
        covariance = posterior[size:, size:] * (1.0 + self.spread) + np.diag(change**2)
        units = np.concatenate([np.zeros(0), *(one.unit for one in linear.accepted)])
        # data that determine a value reduce its prior variance to less than half
        undetermined = np.diag(posterior)[size:] > 0.5 * units**2
        covariance[undetermined], covariance[:, undetermined] = 0.0, 0.0
        covariance[undetermined, undetermined] = np.inf
        estimate = Estimate(*fitted_parameters(self.arm.robot, named), covariance)
        return Fitted(self.arm_at(named, means), named, estimate, means[:size])

    def arm_at(self, named: Sequence[NamedEffect], means: FloatArray) -> ArmModel:
        """Return the arm with the named causes, and with fitted body and friction if stated."""
        change = means[: self.nuisance.rank]
        arm, base, theta = self.arm, self.nuisance.base, self.arm.theta
        if self.stated and np.any(change):
            arm = arm.with_theta(base.lift(base.values(theta) + change, theta))
        return patched_arm(arm, named)

    def as_described(self) -> JointFit:
        """Return the fit with the rigid body fixed to the description."""
        return replace(self, setting=replace(self.setting, body=0.0))

    def residual_of_day(self, fitted: Fitted) -> list[FloatArray]:
        """
        Return the residual of the diagnosed day minus the fitted body, friction and discrepancy.

        Returns
        -------
        list of ndarray, each (M, n)
            Residual of each trajectory, zero in rows that are not informative [N m].

        """
        rows = self.nuisance.rows
        nuisance = self.with_model(fitted.arm)
        means = fitted.means.copy()
        means[: self.nuisance.rank] *= not self.stated
        found = []
        for k in np.flatnonzero(rows.today).tolist():
            whole, start = nuisance.noise_at(means, self.setting, k), 0
            for part, weight in zip(rows.data, rows.weight, strict=True):
                if part.fold == k:
                    own = whole[:, start : start + len(weight)].T
                    found.append(own / np.where(weight > 0.0, weight, 1.0))
                    start += len(weight)
        return found

    def with_model(self, model: ArmModel) -> Nuisance:
        """Return the nuisance parameters with the residual of a model of the diagnosed day."""
        return self.nuisance.with_residual(self._weighted_residual(model))

    def _weighted_residual(self, model: ArmModel) -> list[FloatArray]:
        """Return the weighted residual of each recording, (n, M), with a model of today."""
        rows = self.nuisance.rows
        rest = [
            part.residual(model) if rows.today[part.fold] else np.zeros_like(part.unsure)
            for part in rows.data
        ]
        joints = range(rest[0].shape[1])
        weighted = rows.weighted([own[:, :, np.newaxis] for own in rest], joints)
        return [
            own[:, :, 0] if today else before
            for own, before, today in zip(
                weighted, self.nuisance.residual, rows.today, strict=True
            )
        ]

    def _loss(self, named: Sequence[NamedEffect]) -> float:
        """Return the negative log likelihood, the nuisance parameters integrated out."""
        nuisance = self.with_model(patched_arm(self.arm, named))
        return nuisance.marginal(self.setting, self.recordings).loss

    def _change_by_first_day(self, linear: Nuisance, means: FloatArray) -> FloatArray:
        """
        Return the change of the values for a cause that also acted on the first day.

        The prior of a value on the first day has zero mean, and the present value as standard
        deviation.

        """
        size, both = self.nuisance.columns[0].shape[2], linear
        if not self.nuisance.rows.before:
            return np.zeros(len(means) - size)
        for one, span in zip(linear.accepted, linear.spans, strict=True):
            if one.effect.lasting:
                continue
            unit = np.clip(np.abs(means[span]), 1e-3 * one.unit, one.unit)
            both = both.and_cause(replace(one, unit=unit, always=True))
        under = both.marginal(self.setting, self.recordings)
        return both.means(under)[size : len(means)] - means[size:]

    def linear(self, named: Sequence[NamedEffect]) -> Nuisance:
        """Return the columns of nuisance parameters and named causes, linearised at values."""
        if not named:
            return self.nuisance
        model = patched_arm(self.arm, named)
        rows, result = self.nuisance.rows, self.nuisance
        fitted = [k for k, part in enumerate(rows.data) if part.fold in self.recordings]
        blocks = {k: patch_columns(self.arm, named, rows.data[k]) for k in fitted}
        made = list[Cause]()
        torque = [np.zeros((*part.unsure.shape, 1)) for part in rows.data]
        for n, own in enumerate(named):
            count, kept = blocks[fitted[0]][n].shape[2], list(own.kept)
            columns = [
                blocks[k][n] if k in blocks else np.zeros((*part.unsure.shape, count))
                for k, part in enumerate(rows.data)
            ]
            only = [x[:, :, : len(kept)] for x in columns]
            unit = value_unit(self.nuisance, own.effect, own.kept, rows.rms_today(only))
            # without a default, a shape is a position of 0.1 rad or m
            least = [abs(s.default) or 0.1 for s in own.effect.shapes]
            size = np.tile(least, len(own.effect.owners))
            # the comparison has refined the shape, so its prior deviation is small
            shapes = 0.3 * np.maximum(np.abs(own.effect.shape), size)
            unit = np.concatenate([unit, shapes])
            made.append(cause_of(result, own.effect, own.kept, columns, unit))
            for total, x in zip(torque, only, strict=True):
                total[:, :, 0] += x @ own.values[kept]
        for cause in made:
            result = result.and_cause(cause)
        present = rows.weighted(torque, range(len(rows.torque)))
        return result.with_residual(
            [
                rest + x[:, :, 0] if today else rest
                for rest, x, today in zip(
                    self._weighted_residual(model), present, rows.today, strict=True
                )
            ]
        )


def patched_arm(arm: ArmModel, named: Sequence[NamedEffect]) -> ArmModel:
    """Return an arm with named effects."""
    for own in named:
        arm = add_effect(arm, own.effect, own.values)
    return arm


def moved(
    arm: ArmModel, named: Sequence[NamedEffect], change: FloatArray
) -> tuple[NamedEffect, ...]:
    """Return the named effects after a step of all fitted parameters, within bounds."""
    found = []
    for own, (place, shapes) in zip(named, places(named), strict=True):
        effect = own.effect
        lower, upper = room(effect, arm)
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


def fitted_parameters(
    robot: Robot, named: Sequence[NamedEffect]
) -> tuple[tuple[ParameterName, ...], FloatArray]:
    """Return names and values of the fitted parameters of each effect, its shapes last."""
    names: list[ParameterName] = []
    numbers: list[float] = []
    for own in named:
        every = own.effect.parameters(robot)
        names += [*(every[k] for k in own.kept), *own.effect.shape_parameters(robot)]
        numbers += [*own.values[list(own.kept)].tolist(), *own.effect.shape]
    return tuple(names), np.array(numbers)


def places(named: Sequence[NamedEffect]) -> list[tuple[range, range]]:
    """Return where the values and shapes of each effect are among the fitted parameters."""
    found, start = [], 0
    for own in named:
        shapes = start + len(own.kept)
        stop = shapes + len(own.effect.shape)
        found.append((range(start, shapes), range(shapes, stop)))
        start = stop
    return found


def _shape_bounds(effect: Effect) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the bounds of a shape and the finite-difference steps, per value."""
    owners = len(effect.owners)
    low = np.tile([s.lower for s in effect.shapes], owners)
    high = np.tile([s.upper for s in effect.shapes], owners)
    size = np.tile([max(abs(s.default), 1e-3) for s in effect.shapes], owners)
    return low, high, 1e-3 * np.maximum(np.abs(np.array(effect.shape)), 0.1 * size)


def patch_columns(
    arm: ArmModel, named: Sequence[NamedEffect], part: Trajectory
) -> list[FloatArray]:
    """Return the Jacobian of values and shapes of each named effect in rows, (M, n, p) each."""
    model, blocks = memoized_arm(patched_arm(arm, named)), []
    for own in named:
        columns = [model.columns_of(own.effect, part.motion)[:, :, list(own.kept)]]
        if own.effect.shape:
            columns.append(_shape_columns(model, own.effect, part.motion))
        blocks.append(part.reduce(np.concatenate(columns, axis=2)))
    return blocks


def _shape_columns(model: ArmModel, effect: Effect, motion: Motion) -> FloatArray:
    """Return the finite-difference Jacobian of the torque by the shape, (N, n, S)."""
    place = len(model.effects) - 1 - model.effects[::-1].index(effect)
    low, high, step = _shape_bounds(effect)
    shape = np.array(effect.shape)

    def torque(index: int, value: float) -> FloatArray:
        """Return the torque for another shape, up to a part independent of the shape."""
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
