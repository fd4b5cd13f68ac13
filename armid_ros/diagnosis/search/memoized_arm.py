# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm that is asked the same again and again while everything is compared with everything."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class _Memoized(ArmModel):
    """An arm that computes the torques of a motion once, for all effects that ask."""

    @cached_property
    def _known(self) -> dict[tuple[str, int], tuple[Motion, Any]]:
        return {}

    def _once(self, what: str, motion: Motion, compute: Callable[[Motion], Any]) -> Any:
        key = what, id(motion)
        if key not in self._known:
            self._known[key] = motion, compute(motion)
        return self._known[key][1]

    def link_motion(self, motion: Motion) -> Motion:
        """Return where the links are along a recorded motion."""
        linked: Motion = self._once('link', motion, super().link_motion)
        return linked

    def link_frames(self, motion: Motion) -> LinkFrames:
        """Return where all links are along a recorded motion."""
        frames: LinkFrames = self._once('frames', motion, super().link_frames)
        return frames

    def load(self, motion: Motion) -> FloatArray:
        """Return what the rigid body takes, shape (N, n) [N m]."""
        return np.array(self._once('load', motion, super().load))

    def body_columns(self, motion: Motion) -> FloatArray:
        """Return the regressor of the load along a recorded motion, shape (N, n, 10 n)."""
        columns: FloatArray = self._once('body', motion, super().body_columns)
        return columns

    def gravity_columns(self, motion: Motion) -> FloatArray:
        """Differentiate the load along a recorded motion by gravity, shape (N, n, 3)."""
        columns: FloatArray = self._once('gravity', motion, super().gravity_columns)
        return columns

    def smoothed(self, motion: Motion) -> Motion:
        """Return a recorded motion without what is beyond its band."""
        smooth: Motion = self._once('smooth', motion, super().smoothed)
        return smooth

    def load_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Differentiate the load by position, velocity, acceleration, each (N, n, n)."""
        by_q, by_dq, by_ddq = self._once('derivatives', motion, super().load_derivatives)
        return by_q, by_dq, by_ddq

    def link_torque_derivatives(self, motion: Motion) -> tuple[FloatArray, FloatArray] | None:
        """Differentiate what holds the links by position and velocity, each (N, n, n)."""
        slopes: tuple[FloatArray, FloatArray] | None
        slopes = self._once('holding', motion, super().link_torque_derivatives)
        return slopes

    def joint_torque(self, motion: Motion) -> FloatArray:
        """Return the true torques of a recorded motion, shape (N, n) [N m]."""
        return np.array(self._once('torque', motion, super().joint_torque))


def memoized_arm(arm: ArmModel) -> ArmModel:
    """Return the arm, made to compute the torques of each motion once."""
    return _Memoized(arm.robot, arm.effects, arm.values, arm.quasi_static)
