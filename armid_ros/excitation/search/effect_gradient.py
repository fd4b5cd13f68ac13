# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Columns of effects, with what works out a gradient by the motion.

Columns of what adds to the rigid body are those of the body. All others are differentiated by
central differences of the state, of all samples at once.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.excitation.search.rigid_gradient import RigidRegressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Step of finite differences, of a state of size 1.
STEP = 1e-6

#: Derivative of a number by the samples q, dq and ddq, each of shape (N, n).
Gradient = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class EffectColumns:
    """
    Columns of one effect with their gradient.

    Attributes
    ----------
    columns : ndarray, shape (N, n, P)
        Sensitivities.
    pullback : callable
        From derivatives of a number by the columns, shape (N, n, P), to those by the samples, or
        to those by the Fourier coefficients, shape (n, 1 + 2 H).

    """

    columns: FloatArray
    pullback: Callable[[FloatArray], Gradient | FloatArray]


def rigid_columns(rows: Sequence[int], motion: Motion, rigid: RigidRegressor) -> EffectColumns:
    """Return the columns of what adds to rigid parameters: those of the parameters."""
    pick = list(rows)

    def pullback(weights: FloatArray) -> Gradient:
        spread = np.zeros((*motion.q.shape, 10 * motion.n_joints))
        spread[:, :, pick] = weights
        return rigid.pullback(spread)

    return EffectColumns(rigid.matrix()[:, :, pick], pullback)


def columns_by_state(effect: Effect, motion: Motion, arm: ArmModel) -> EffectColumns:
    """Return columns that depend on nothing but the state, with finite differences behind them."""
    n = motion.n_joints
    state = np.array([motion.q, motion.dq, motion.ddq])
    joints = np.arange(n)

    def along(argument: int, step: float, weights: FloatArray) -> FloatArray:
        """Return the weighted sum of the columns with each joint moved alone, (N, n)."""
        moved = np.repeat(
            state[:, np.newaxis], n, axis=1
        )  # [argument, moved joint, sample, joint]
        moved[argument, joints, :, joints] += step
        q, dq, ddq = moved.reshape(3, -1, n)
        samples = replace(motion, t=np.tile(motion.t, n), q=q, dq=dq, ddq=ddq)
        columns = arm.columns_of(effect, samples).reshape(n, *weights.shape)
        return np.asarray(np.einsum('jkrp,krp->kj', columns, weights))

    def pullback(weights: FloatArray) -> Gradient:
        by_q, by_dq, by_ddq = (
            (along(argument, STEP, weights) - along(argument, -STEP, weights)) / (2.0 * STEP)
            for argument in range(3)
        )
        return by_q, by_dq, by_ddq

    return EffectColumns(arm.columns_of(effect, motion), pullback)
