# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A candidate cause of a residual: an effect on certain joints, with its regression columns."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Cause:
    """
    Candidate cause of a residual: effect, joints and shape parameters, with the regressor.

    Attributes
    ----------
    effect : Effect
        The effect, with its joints and shape.
    kept : tuple of int
        Indices of its parameters that are fitted; the others are zero.
    unit : ndarray, shape (p,)
        Scale of each value: its torque equals that of the joint, or it is the largest plausible
        value if that is smaller.
    prior : float
        Prior log odds.
    joints : tuple of int
        Indices of the t joints on which the cause acts.
    columns : tuple of ndarray, each (t, M, p)
        Weighted regression columns in each recording.
    products, own, aim : ndarray, shape (K, q, p), (K, p, p), (K, p)
        Inner products of `columns` with the nuisance columns, with themselves, and with the
        residual, in each of K recordings.
    torque : ndarray, shape (n, p)
        Root mean square torque per unit value in the diagnosed recordings [N m].
    shapes : int
        Number of shapes that were tried.
    size : float
        Prior standard deviation of the values over `unit`, for an accepted cause.
    always : bool
        Whether an accepted cause acts in baseline and diagnosed recordings.

    """

    effect: Effect
    kept: tuple[int, ...]
    unit: FloatArray
    prior: float
    joints: tuple[int, ...]
    columns: tuple[FloatArray, ...]
    products: FloatArray
    own: FloatArray
    aim: FloatArray
    torque: FloatArray
    shapes: int = 1
    size: float = 1.0
    always: bool = False

    @property
    def key(self) -> tuple[str, tuple[str, ...], tuple[int, ...]]:
        """Identity of a cause: name and joints of its effect, and indices of its fitted values."""
        return self.effect.name, self.effect.joints, self.kept

    def acts(self, diagnosed: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Return for each recording whether the cause acts; `diagnosed` is a recording mask."""
        return np.ones_like(diagnosed) if self.always or self.effect.lasting else diagnosed

    def at(self, values: FloatArray, robot: Robot) -> NamedEffect:
        """Return the effect with the given fitted values and all other parameters zero."""
        whole = np.zeros(len(self.effect.parameters(robot)))
        whole[list(self.kept)] = values
        return NamedEffect(self.effect, self.kept, whole)

    def among(self, effect: Effect, values: npt.NDArray[np.intp], shapes: int) -> Cause:
        """Return the cause for the same effect on fewer joints, from a subset of the columns."""
        return replace(
            self,
            effect=effect,
            kept=tuple(range(len(values))),
            unit=self.unit[values],
            prior=self.prior - float(np.log(shapes)),
            columns=tuple(x[:, :, values] for x in self.columns),
            products=self.products[:, :, values],
            own=self.own[:, values[:, np.newaxis], values],
            aim=self.aim[:, values],
            torque=self.torque[:, values],
            shapes=shapes,
        )

    def products_with(self, other: Cause) -> FloatArray:
        """Return the inner products of the columns of two causes, shape (K, p, p')."""
        total = np.zeros((len(self.columns), len(self.unit), len(other.unit)))
        for k, joint in enumerate(self.joints):
            if joint in other.joints:
                theirs = other.joints.index(joint)
                for own, x, y in zip(total, self.columns, other.columns, strict=True):
                    own += x[k].T @ y[theirs]
        return total


@dataclass(frozen=True)
class NamedEffect:
    """
    Effect with a value for each of its parameters.

    Attributes
    ----------
    effect : Effect
        The effect, with its joints and shape.
    kept : tuple of int
        Indices of its parameters that are fitted; the others are zero.
    values : ndarray, shape (P,)
        Values of all its parameters.

    """

    effect: Effect
    kept: tuple[int, ...]
    values: FloatArray


def bounds_of_change(effect: Effect, arm: ArmModel) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and largest change (P,) that keeps effect values in their bounds."""
    lower, upper = effect.bounds()
    there = {
        (parameter.name, parameter.joint): value
        for own, values in zip(arm.effects, arm.values, strict=True)
        if not own.shapes and not own.points
        for parameter, value in zip(own.parameters(arm.robot), values.tolist(), strict=True)
    }
    names = [(parameter.name, parameter.joint) for parameter in effect.parameters(arm.robot)]
    values = np.array([there.get(name, 0.0) for name in names])
    return lower - values, upper - values
