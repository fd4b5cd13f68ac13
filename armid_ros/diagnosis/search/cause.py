# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A candidate cause: an effect with a shape on certain joints, its columns and its bounds."""

from __future__ import annotations

from collections.abc import Sequence
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
    An effect on certain joints with one shape.

    Attributes
    ----------
    effect : Effect
        The effect, with its joints and shape.
    kept : tuple of int
        Its parameters that are fitted; the others are zero.
    unit : ndarray, shape (p,)
        Unit of each value: has the torque of the joint, or is the largest plausible value if less.
    prior : float
        Log odds before any data.
    joints : tuple of int
        The t joints on which the cause acts.
    columns : tuple of ndarray, each (t, M, p)
        Weighted columns in each recording.
    products, own, aim : ndarray, shape (K, q, p), (K, p, p), (K, p)
        Products of `columns` with the nuisance columns, with themselves, and with the residual, in
        each of K recordings.
    torque : ndarray, shape (n, p)
        Root mean square torque per unit of each value on the diagnosed day [N m].
    shapes : int
        Number of shapes that were tried.
    size : float
        Standard deviation of the prior of its values, over their unit, once it is accepted.
    always : bool
        Whether it acts on both days, once it is accepted.

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
        """Identity of the cause without its shape: name, joints and quantities."""
        return self.effect.name, self.effect.joints, self.kept

    def acts(self, today: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Return in which recordings or groups the cause acts: today, or on both days."""
        return np.ones_like(today) if self.always or self.effect.lasting else today

    def at(self, values: FloatArray, robot: Robot) -> NamedEffect:
        """Return the effect with the fitted values of the cause; other parameters are zero."""
        whole = np.zeros(len(self.effect.parameters(robot)))
        whole[list(self.kept)] = values
        return NamedEffect(self.effect, self.kept, whole)

    def among(self, effect: Effect, values: npt.NDArray[np.intp], shapes: int) -> Cause:
        """Return the cause with some of its values only, for an effect on fewer joints."""
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

    def aimed_at(self, residual: Sequence[FloatArray]) -> Cause:
        """Return the cause with `aim` recomputed for another residual, (n, M) per recording."""
        joints = list(self.joints)
        pairs = zip(self.columns, residual, strict=True)
        aim = [np.einsum('tmp,tm->p', x, y[joints]) for x, y in pairs]
        return replace(self, aim=np.array(aim))

    def products_with(self, other: Cause) -> FloatArray:
        """Return products of the columns with those of another cause, (K, p, p')."""
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
    A named effect with its values.

    Attributes
    ----------
    effect : Effect
        Joints and shape.
    kept : tuple of int
        Its parameters that are fitted; the others are zero.
    values : ndarray, shape (P,)
        Values of all its parameters.

    """

    effect: Effect
    kept: tuple[int, ...]
    values: FloatArray


def room(effect: Effect, arm: ArmModel) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of a change of the arm's values within the bounds of the effect, (P,)."""
    lower, upper = effect.bounds()
    there = {
        name: value
        for own, values in zip(arm.effects, arm.values, strict=True)
        if isinstance(effect, type(own)) and not own.shapes and not own.points
        for name, value in zip(own.parameters(arm.robot), values.tolist(), strict=True)
    }
    values = np.array([there.get(name, 0.0) for name in effect.parameters(arm.robot)])
    return lower - values, upper - values
