# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with named effects, and the Jacobian of its torque by their values and shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.arm.model_file import with_named
from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.effects import Effect, TorqueReading
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


def patched_arm(arm: ArmModel, named: Sequence[NamedEffect]) -> ArmModel:
    """Return an arm with named effects."""
    for own in named:
        arm = with_named(arm, own.effect, own.values)
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
    """Return the positions of values and of shapes of each effect among the fitted parameters."""
    found, start = [], 0
    for own in named:
        shapes = start + len(own.kept)
        stop = shapes + len(own.effect.shape)
        found.append((range(start, shapes), range(shapes, stop)))
        start = stop
    return found


def room(effect: Effect, arm: ArmModel) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of values that are added to those of the arm, each (P,)."""
    lower, upper = effect.bounds()
    there = {
        name: value
        for own, values in zip(arm.effects, arm.values, strict=True)
        if isinstance(effect, type(own)) and not own.shapes and not own.points
        for name, value in zip(own.parameters(arm.robot), values.tolist(), strict=True)
    }
    values = np.array([there.get(name, 0.0) for name in effect.parameters(arm.robot)])
    return lower - values, upper - values


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
