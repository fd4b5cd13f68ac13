# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm model with caches, for searches that evaluate the same motions many times."""

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


@dataclass
class _Regressor:
    """Cache entry: a motion, its rigid-body regressor, and that regressor filtered."""

    motion: Motion
    columns: FloatArray
    rows: FloatArray | None = None


@dataclass(frozen=True, repr=False)
class _Memoized(ArmModel):
    """
    Arm model that caches torques and regressors for each motion.

    Regressors depend on motion and gravity, not on inertial parameters, so copies share them.

    """

    regressors: dict[tuple[object, ...], _Regressor] = field(default_factory=dict, compare=False)

    @cached_property
    def _known(self) -> dict[tuple[str, int], tuple[Motion, Any]]:
        """Return the cached results, by quantity and motion."""
        return {}

    def _once(self, name: str, motion: Motion, compute: Callable[[Motion], _Result]) -> _Result:
        """Return a cached quantity along a motion; compute it at the first call."""
        key = name, id(motion)
        if key not in self._known:
            self._known[key] = motion, compute(motion)
        result: _Result = self._known[key][1]
        return result

    def link_motion(self, motion: Motion) -> Motion:
        """Return the true motion of the links for a motion that sensors recorded."""
        if self.action().displacement is None:
            return motion
        return self._once('link', motion, super().link_motion)

    def link_frames(self, motion: Motion) -> LinkFrames:
        """Return the frames of all links in each sample of a recorded motion."""
        return self._once('frames', motion, super().link_frames)

    def regressor(self, motion: Motion) -> _Regressor | None:
        """Return the rigid-body regressor of a motion from the cache; None if not cacheable."""
        if self.action().displacement is not None:
            return None
        key = self._key(motion)
        if key not in self.regressors:
            used = sum(one.columns.nbytes for one in self.regressors.values())
            # memory of the cached regressors [bytes]; further regressors are not kept
            if used + 10 * motion.q.nbytes * motion.n_joints > 1_000_000_000:
                return None
            self.regressors[key] = _Regressor(
                motion, regressor(self.body, self.rigid_body_motion(motion))
            )
        return self.regressors[key]

    def _key(self, motion: Motion) -> tuple[object, ...]:
        """Return the cache key of a regressor: motion, gravity and ``quasi_static``."""
        places = (array.ctypes.data for array in (motion.q, motion.dq, motion.ddq))
        return *places, len(motion), tuple(self.body.gravity.tolist()), self.quasi_static

    def load(self, motion: Motion) -> FloatArray:
        """Return the rigid-body torque for a motion of the links, shape (N, n) [N m]."""
        known = self.regressors.get(self._key(motion))
        if known is not None:
            return known.columns @ self.body.rigid_parameters
        return np.array(self._once('load', motion, super().load))

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the rigid-body regressor along a recorded motion, shape (N, n, 10 n)."""
        known = self.regressor(motion)
        return self._once('body', motion, super().body_columns) if known is None else known.columns

    def gravity_columns(self, motion: Motion) -> FloatArray:
        """Return the derivatives of the rigid-body torque by the gravity vector, (N, n, 3)."""
        return self._once('gravity', motion, super().gravity_columns)

    def smoothed(self, motion: Motion) -> Motion:
        """Return a recorded motion without frequencies above its band limit ``band_hz``."""
        return self._once('smooth', motion, super().smoothed)

    def load_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the derivatives of the rigid-body torque by q, dq and ddq, (N, n, n) each."""
        return self._once('derivatives', motion, super().load_derivatives)

    def link_torque_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray] | None:
        """Return derivatives of the effects' torques on links by q and dq; None without any."""
        return self._once('holding', motion, super().link_torque_derivatives)

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the true joint torque along a recorded motion, shape (N, n) [N m or N]."""
        return np.array(self._once('torque', motion, super().joint_torque))


def memoized_arm(arm: ArmModel) -> ArmModel:
    """Return an equal arm model that caches torques and regressors."""
    if isinstance(arm, _Memoized):
        return arm
    return _Memoized(arm.robot, arm.effects, arm.values, arm.quasi_static)


def plain_arm(arm: ArmModel) -> ArmModel:
    """Return an equal arm model without caches."""
    return ArmModel(arm.robot, arm.effects, arm.values, arm.quasi_static)


def rigid_rows(
    arm: ArmModel, motion: Motion, reduce: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return filtered derivatives of torque readings by inertial parameters, (M, n, 10 n)."""
    columns = arm.rigid_columns(motion)
    known = arm.regressor(motion) if isinstance(arm, _Memoized) else None
    if known is None or known.columns is not columns:
        return reduce(columns)
    if known.rows is None:
        known.rows = reduce(columns)
    return known.rows
