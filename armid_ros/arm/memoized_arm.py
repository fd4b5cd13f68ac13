# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with caches, for searches that evaluate the same motions many times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from armid_ros.arm.arm_model import ArmModel
from armid_ros.model import LinkFrames, regressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

_Result = TypeVar('_Result')


class Regressors:
    """
    Cache of the regressors of recorded motions, by motion and gravity.

    Regressors do not depend on inertial parameters, so arms of one description share them.

    """

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], tuple[Motion, FloatArray]] = {}
        self._in_rows: dict[int, FloatArray | None] = {}
        # remaining memory of the cache [bytes]; regressors beyond it are not kept
        self._room = 1_000_000_000

    def of(self, arm: ArmModel, motion: Motion) -> FloatArray | None:
        """Return the regressor of a motion, shape (N, n, 10 n); None if memory is exhausted."""
        path = (motion.q, motion.dq, motion.ddq)
        gravity = tuple(np.asarray(arm.body.gravity).tolist())
        key = *(array.ctypes.data for array in path), len(motion), gravity, arm.quasi_static
        if key not in self._known:
            size = 10 * motion.q.nbytes * motion.n_joints
            if size > self._room:
                return None
            self._room -= size
            self._known[key] = motion, regressor(arm.body, arm.felt(motion))
            self._in_rows[id(self._known[key][1])] = None
        return self._known[key][1]

    def in_rows(
        self, columns: FloatArray, reduce: Callable[[FloatArray], FloatArray]
    ) -> FloatArray:
        """Return filtered columns, cached for a known regressor; each has only one filter."""
        if id(columns) not in self._in_rows:
            return reduce(columns)
        rows = self._in_rows[id(columns)]
        if rows is None:
            rows = self._in_rows[id(columns)] = reduce(columns)
        return rows


@dataclass(frozen=True, repr=False)
class _Memoized(ArmModel):
    """An arm with caches of torques and regressors; copies of it share the regressors."""

    regressors: Regressors = field(default_factory=Regressors, compare=False)

    @cached_property
    def _known(self) -> dict[tuple[str, int], tuple[Motion, Any]]:
        return {}

    def _once(self, what: str, motion: Motion, compute: Callable[[Motion], _Result]) -> _Result:
        key = what, id(motion)
        if key not in self._known:
            self._known[key] = motion, compute(motion)
        result: _Result = self._known[key][1]
        return result

    def link_motion(self, motion: Motion) -> Motion:
        """Return the true motion of the links for a recorded motion."""
        if self.action().displacement is None:
            return motion
        return self._once('link', motion, super().link_motion)

    def link_frames(self, motion: Motion) -> LinkFrames:
        """Return the frames of all links along a recorded motion."""
        return self._once('frames', motion, super().link_frames)

    def _regressor(self, motion: Motion) -> FloatArray | None:
        """Return the cached regressor; None if links move otherwise, or memory is exhausted."""
        if self.action().displacement is not None:
            return None
        return self.regressors.of(self, motion)

    def load(self, motion: Motion) -> FloatArray:
        """Return the torque of the rigid body along a motion of the links, (N, n) [N m]."""
        return np.array(self._once('load', motion, super().load))

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the regressor of the load along a recorded motion, shape (N, n, 10 n)."""
        known = self._regressor(motion)
        return self._once('body', motion, super().body_columns) if known is None else known

    def gravity_columns(self, motion: Motion) -> FloatArray:
        """Differentiate the load along a recorded motion by gravity, shape (N, n, 3)."""
        return self._once('gravity', motion, super().gravity_columns)

    def smoothed(self, motion: Motion) -> Motion:
        """Return a recorded motion without frequencies beyond its band."""
        return self._once('smooth', motion, super().smoothed)

    def load_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Differentiate the load by position, velocity, acceleration, each (N, n, n)."""
        return self._once('derivatives', motion, super().load_derivatives)

    def link_torque_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray] | None:
        """Differentiate torques on the link side by q and dq, each (N, n, n); None without any."""
        return self._once('holding', motion, super().link_torque_derivatives)

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the true torques of a recorded motion, shape (N, n) [N m]."""
        return np.array(self._once('torque', motion, super().joint_torque))


def memoized_arm(arm: ArmModel) -> ArmModel:
    """Return the arm with caches of torques and regressors."""
    if isinstance(arm, _Memoized):
        return arm
    return _Memoized(arm.robot, arm.effects, arm.values, arm.quasi_static)


def plain_arm(arm: ArmModel) -> ArmModel:
    """Return the arm without caches."""
    return ArmModel(arm.robot, arm.effects, arm.values, arm.quasi_static)


def rigid_rows(
    arm: ArmModel, motion: Motion, reduce: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return the filtered sensitivities to the rigid parameters, (M, n, 10 n)."""
    columns = arm.rigid_columns(motion)
    return (
        arm.regressors.in_rows(columns, reduce) if isinstance(arm, _Memoized) else reduce(columns)
    )
