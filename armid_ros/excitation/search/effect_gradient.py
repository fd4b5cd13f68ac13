# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Columns of effects that do not know their own gradient.

Those of what adds to the rigid body are the body's. Others are differentiated by finite
differences of the state, where they depend on nothing else.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.effects.smooth import Gradient, SmoothColumns
from armid_ros.excitation.search.rigid_gradient import RigidRegressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Step of finite differences, of a state of size 1.
STEP = 1e-6


def rigid_columns(rows: Sequence[int], motion: Motion, rigid: RigidRegressor) -> SmoothColumns:
    """Return the columns of what adds to rigid parameters: those of the parameters."""
    pick = list(rows)

    def pullback(weights: FloatArray) -> Gradient:
        spread = np.zeros((*motion.q.shape, 10 * motion.n_joints))
        spread[:, :, pick] = weights
        return rigid.pullback(spread)

    return SmoothColumns(rigid.matrix()[:, :, pick], pullback)


def columns_by_state(effect: Effect, motion: Motion, arm: ArmModel) -> SmoothColumns:
    """Return columns that depend on nothing but the state, with finite differences behind them."""

    def pullback(weights: FloatArray) -> Gradient:
        gradient = np.empty((3, *motion.q.shape))
        for argument, joint in np.ndindex(3, motion.n_joints):
            ends = []
            for sign in (1.0, -1.0):
                state = np.array([motion.q, motion.dq, motion.ddq])
                state[argument, :, joint] += sign * STEP
                ends.append(arm.columns_of(effect, Motion(motion.joints, motion.t, *state)))
            difference = np.sum(weights * (ends[0] - ends[1]), axis=(1, 2))
            gradient[argument, :, joint] = difference / (2.0 * STEP)
        return gradient[0], gradient[1], gradient[2]

    return SmoothColumns(arm.columns_of(effect, motion), pullback)
