# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm model with caches, for searches that evaluate the same motions many times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import Any, cast, TypeVar

from armid_ros.arm.arm_model import ArmModel
from armid_ros.model import regressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

_Method = TypeVar('_Method', bound=Callable[..., Any])


@dataclass
class _Regressor:
    """Cache entry: a motion, its rigid-body regressor, and the filtered regressor."""

    motion: Motion
    columns: FloatArray
    rows: FloatArray | None = None


def _once(compute: _Method) -> _Method:
    """Add a cache to a method of `ArmModel`, with one result for each motion."""

    @wraps(compute)
    def cached(arm: _Memoized, motion: Motion) -> Any:
        key = compute.__name__, id(motion)
        if key not in arm.known:
            arm.known[key] = motion, compute(arm, motion)
        return arm.known[key][1]

    return cast(_Method, cached)


@dataclass(frozen=True, repr=False)
class _Memoized(ArmModel):
    """
    Arm model that caches torques and regressors for each motion.

    Regressors depend on motion and gravity, not on inertial parameters, so copies share them.

    """

    regressors: dict[tuple[object, ...], _Regressor] = field(default_factory=dict, compare=False)

    @cached_property
    def known(self) -> dict[tuple[str, int], tuple[Motion, Any]]:
        """Cached results, by name of the quantity and identity of the motion."""
        return {}

    link_frames = _once(ArmModel.link_frames)
    gravity_columns = _once(ArmModel.gravity_columns)
    smoothed = _once(ArmModel.smoothed)
    load_derivatives = _once(ArmModel.load_derivatives)
    link_slopes = _once(ArmModel.link_slopes)
    _moved = _once(ArmModel.link_motion)
    _load = _once(ArmModel.load)
    _body_columns = _once(ArmModel.body_columns)
    _joint_torque = _once(ArmModel.joint_torque)

    def link_motion(self, motion: Motion) -> Motion:
        """Return the motion of the links: recorded motion plus displacements of the effects."""
        return motion if self.action().displacement is None else self._moved(motion)

    def regressor(self, motion: Motion) -> _Regressor | None:
        """Return the cached rigid-body regressor of a motion; None if it cannot be cached."""
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
        return np.array(self._load(motion))

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the rigid-body regressor along a recorded motion, shape (N, n, 10 n)."""
        known = self.regressor(motion)
        return self._body_columns(motion) if known is None else known.columns

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the true joint torque along a recorded motion, shape (N, n) [N m or N]."""
        return np.array(self._joint_torque(motion))


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
    """Return derivatives of torque readings by inertial parameters, filtered by `reduce`."""
    columns = arm.rigid_columns(motion)
    known = arm.regressor(motion) if isinstance(arm, _Memoized) else None
    if known is None or known.columns is not columns:
        return reduce(columns)
    if known.rows is None:
        known.rows = reduce(columns)
    return known.rows
