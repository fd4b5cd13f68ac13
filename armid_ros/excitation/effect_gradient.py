# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Columns of the effects, smooth in the motion, and their gradient in reverse.

The direction of motion, sign(dq), has no gradient; while a search runs it is tanh(dq / width).
Effects without an entry here are differentiated by finite differences of the state, where their
columns depend on nothing else.

"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.effects.load import Payload
from armid_ros.excitation.rigid_gradient import RigidRegressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Step of finite differences, of a state of size 1.
STEP = 1e-6

#: Derivative of a number by the samples q, dq and ddq, each of shape (N, n).
Gradient = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class SmoothColumns:
    """
    Columns of one effect with their gradient.

    Attributes
    ----------
    columns : ndarray, shape (N, n, P)
        Sensitivities with a smooth direction of motion.
    pullback : callable
        From derivatives of a number by the columns, shape (N, n, P), to those by the samples, or
        to those by the Fourier coefficients, shape (n, 1 + 2 H).

    """

    columns: FloatArray
    pullback: Callable[[FloatArray], Gradient | FloatArray]


def smooth_columns(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns | None:
    """
    Return the columns of an effect with their gradient, None where the gradient is not known.

    Parameters
    ----------
    effect : Effect
        One of those of the arm.
    motion : Motion
        N samples.
    width : ndarray, shape (n,)
        Velocity below which the direction of motion is blurred [rad/s or m/s].

    """
    rule = _RULES.get(effect.name)
    return None if rule is None else rule(effect, motion, width)


def payload_columns(effect: Payload, motion: Motion, rigid: RigidRegressor) -> SmoothColumns:
    """Return the columns of a payload: those of the link that carries it."""
    links = effect.indices(motion.joints)
    pick = np.concatenate([np.arange(10 * link, 10 * link + 10) for link in links])

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


def _diagonal(
    effect: Effect, motion: Motion, *quantities: tuple[FloatArray, int, FloatArray]
) -> SmoothColumns:
    """
    Columns of an effect that acts on each of its joints alone.

    A quantity is its values (N, n), what it depends on (0 q, 1 dq, 2 ddq) and the derivative.

    """
    joints = effect.indices(motion.joints)
    count = len(quantities)
    columns = np.zeros((*motion.q.shape, count * len(joints)))
    for position, joint in enumerate(joints):
        for offset, (values, _, _) in enumerate(quantities):
            columns[:, joint, count * position + offset] = values[:, joint]

    def pullback(weights: FloatArray) -> Gradient:
        gradient = (np.zeros_like(motion.q), np.zeros_like(motion.q), np.zeros_like(motion.q))
        for position, joint in enumerate(joints):
            for offset, (_, argument, slope) in enumerate(quantities):
                weight = weights[:, joint, count * position + offset]
                gradient[argument][:, joint] += weight * slope[:, joint]
        return gradient

    return SmoothColumns(columns, pullback)


def _viscous(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns:
    return _diagonal(effect, motion, (motion.dq, 1, np.ones_like(motion.dq)))


def _coulomb(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns:
    return _diagonal(effect, motion, (*_direction(motion.dq, width),))


def _asymmetric(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns:
    sign, _, slope = _direction(motion.dq, width)
    return _diagonal(
        effect,
        motion,
        (sign**2, 1, 2.0 * sign * slope),
        (sign * motion.dq, 1, sign + motion.dq * slope),
    )


def _offset(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns:
    one = np.ones_like(motion.q)
    return _diagonal(effect, motion, (one, 0, 0.0 * one))


def _rotor(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns:
    return _diagonal(effect, motion, (motion.ddq, 2, np.ones_like(motion.ddq)))


def _coupled(effect: Effect, motion: Motion, width: FloatArray) -> SmoothColumns:
    indices = effect.indices(motion.joints)
    pairs = list(zip(indices[::2], indices[1::2], strict=True))
    columns = np.zeros((*motion.q.shape, 3 * len(pairs)))
    slopes = []
    for position, (i, k) in enumerate(pairs):
        shaft = motion.dq[:, i] + motion.dq[:, k]
        sign, _, slope = _direction(shaft, np.minimum(width[i], width[k]))
        slopes.append(slope)
        for row, other in ((i, k), (k, i)):
            columns[:, row, 3 * position] = motion.ddq[:, other]
            columns[:, row, 3 * position + 1] = motion.dq[:, other]
            columns[:, row, 3 * position + 2] = sign

    def pullback(weights: FloatArray) -> Gradient:
        by_dq, by_ddq = np.zeros_like(motion.q), np.zeros_like(motion.q)
        for position, (i, k) in enumerate(pairs):
            for row, other in ((i, k), (k, i)):
                by_ddq[:, other] += weights[:, row, 3 * position]
                by_dq[:, other] += weights[:, row, 3 * position + 1]
                turn = weights[:, row, 3 * position + 2] * slopes[position]
                by_dq[:, i] += turn
                by_dq[:, k] += turn
        return np.zeros_like(motion.q), by_dq, by_ddq

    return SmoothColumns(columns, pullback)


def _direction(velocity: FloatArray, width: FloatArray) -> tuple[FloatArray, int, FloatArray]:
    sign = np.tanh(velocity / width)
    return sign, 1, (1.0 - sign**2) / width


_RULES: Mapping[str, Callable[[Effect, Motion, FloatArray], SmoothColumns]] = MappingProxyType(
    {
        'viscous_friction': _viscous,
        'coulomb_friction': _coulomb,
        'asymmetric_friction': _asymmetric,
        'torque_offset': _offset,
        'rotor_inertia': _rotor,
        'coupled_joint_friction': _coupled,
    }
)
