# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of a trajectory and its gradient by the Fourier coefficients.

Columns of effects that add to the rigid body are those of the body. All others are differentiated
by finite differences, those that depend on nothing but the state of all samples at once.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.effects.direction import BlurredMotion
from armid_ros.excitation.fourier import fourier_basis, FourierTrajectory, MARGIN
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.search.rigid_gradient import RigidRegressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: The direction of motion is blurred below this share of a joint's velocity limit.
_BLUR = 0.05

#: Step of finite differences, of a state of size 1.
_STEP = 1e-6

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


@dataclass(frozen=True)
class Objective:
    """
    Cost of a trajectory as a function of its coefficients X = (q0, a, b), shape (n, 1 + 2 H).

    Attributes
    ----------
    problem : DesignProblem
        What is wanted.
    prior : ndarray, shape (r, r), or None
        Information that is there already.
    t : ndarray, shape (N,)
        Sample times [s].
    basis : tuple of ndarray, each of shape (N, 1 + 2 H)
        q, dq and ddq per coefficient.
    width : ndarray, shape (n,)
        Velocity below which the direction of motion is blurred [rad/s or m/s].

    """

    problem: DesignProblem
    prior: FloatArray | None
    t: FloatArray
    basis: tuple[FloatArray, FloatArray, FloatArray] = field(repr=False)
    width: FloatArray

    @classmethod
    def of(cls, problem: DesignProblem, prior: FloatArray | None = None) -> Objective:
        """Prepare for the samples of the settings."""
        settings = problem.settings
        t: FloatArray = np.linspace(0.0, settings.period, settings.samples, endpoint=False)
        velocity = problem.limits.velocity
        width = _BLUR * np.where(np.isfinite(velocity), velocity, 1.0)
        basis = fourier_basis(t, settings.period, settings.harmonics)
        return cls(problem, prior, t, basis, width)

    def motion(self, x: FloatArray) -> Motion:
        """Return the samples of coefficients X."""
        states = (basis @ x.T for basis in self.basis)
        return BlurredMotion(self.problem.limits.joints, self.t, *states, width=self.width)

    def value(self, x: FloatArray) -> tuple[float, Callable[[], FloatArray]]:
        """
        Return the smooth cost, and what works out its gradient.

        Parameters
        ----------
        x : ndarray, shape (n, 1 + 2 H)
            Coefficients.

        Returns
        -------
        cost : float
            Inf where the parameters cannot be seen.
        gradient : callable () -> ndarray, shape (n, 1 + 2 H)
            Derivative by the coefficients; a line search does without most of them.

        """
        problem, motion = self.problem, self.motion(x)
        still = problem.settings.target == 'gravity' or problem.arm.quasi_static
        felt = motion.at_rest() if still else motion
        rigid = RigidRegressor.of(problem.arm.body, felt)
        body = rigid.matrix()
        if problem.settings.target == 'effects':
            body = np.zeros_like(body)
        effects = [self._effect(effect, motion, x) for effect in problem.arm.effects]
        columns = np.concatenate([body, *(effect.columns for effect in effects)], axis=2)
        inverse_noise = (1.0 / problem.noise)[:, np.newaxis]
        w = (columns[:, :, problem.selected] * inverse_noise).reshape(-1, len(problem.selected))
        settings = problem.settings
        weight = settings.rate * settings.period * settings.n_periods / len(self.t)
        matrix = weight * (w.T @ w)
        if self.prior is not None:
            matrix = matrix + self.prior
        cost, by_matrix = problem.criterion.smooth(matrix)

        def gradient() -> FloatArray:
            weights = np.zeros_like(columns)
            by_w = (2.0 * weight * (w @ by_matrix)).reshape(*motion.q.shape, -1)
            weights[:, :, problem.selected] = by_w * inverse_noise
            return self._gradient(weights, rigid, effects, still)

        return cost, gradient

    def _gradient(
        self,
        weights: FloatArray,
        rigid: RigidRegressor,
        effects: list[EffectColumns],
        still: bool,
    ) -> FloatArray:
        """Turn derivatives by the columns, shape (N, n, P), into those by the coefficients."""
        size = 10 * weights.shape[1]
        total = np.zeros((weights.shape[1], self.basis[0].shape[1]))
        if self.problem.settings.target != 'effects':
            by_q, by_dq, by_ddq = rigid.pullback(weights[:, :, :size])
            total += self._chained(
                (by_q, 0.0 * by_dq, 0.0 * by_ddq) if still else (by_q, by_dq, by_ddq)
            )
        start = size
        for effect in effects:
            stop = start + effect.columns.shape[2]
            part = effect.pullback(weights[:, :, start:stop])
            total += self._chained(part) if isinstance(part, tuple) else part
            start = stop
        return total

    def _chained(self, by_state: Gradient) -> FloatArray:
        parts = [by.T @ basis for by, basis in zip(by_state, self.basis, strict=True)]
        return np.asarray(sum(parts))

    def _effect(self, effect: Effect, motion: Motion, x: FloatArray) -> EffectColumns:
        arm = self.problem.arm
        rows = effect.adds_to(arm.robot)
        if rows:
            felt = arm.felt(motion)
            return _rigid_columns(rows, motion, RigidRegressor.of(arm.body, felt))
        if effect.instantaneous:
            return _columns_by_state(effect, motion, arm)
        return self._columns_by_coefficient(effect, x)

    def _columns_by_coefficient(self, effect: Effect, x: FloatArray) -> EffectColumns:
        """Return columns that depend on the motion's past, with finite differences behind them."""
        joints, period = self.problem.limits.joints, self.problem.settings.period

        def columns(y: FloatArray) -> FloatArray:
            motion = FourierTrajectory.of(joints, period, y).with_margins(len(self.t))
            return self.problem.arm.columns_of(effect, motion)[MARGIN:-MARGIN]

        here = columns(x)

        def pullback(weights: FloatArray) -> FloatArray:
            gradient = np.empty_like(x)
            for index in np.ndindex(*x.shape):
                step = _STEP * max(1.0, abs(float(x[index])))
                moved = x.copy()
                moved[index] += step
                gradient[index] = np.sum(weights * (columns(moved) - here)) / step
            return gradient

        return EffectColumns(here, pullback)


def _rigid_columns(rows: Sequence[int], motion: Motion, rigid: RigidRegressor) -> EffectColumns:
    """Return the columns of what adds to rigid parameters: those of the parameters."""
    pick = list(rows)

    def pullback(weights: FloatArray) -> Gradient:
        spread = np.zeros((*motion.q.shape, 10 * motion.n_joints))
        spread[:, :, pick] = weights
        return rigid.pullback(spread)

    return EffectColumns(rigid.matrix()[:, :, pick], pullback)


def _columns_by_state(effect: Effect, motion: Motion, arm: ArmModel) -> EffectColumns:
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
            (along(argument, _STEP, weights) - along(argument, -_STEP, weights)) / (2.0 * _STEP)
            for argument in range(3)
        )
        return by_q, by_dq, by_ddq

    return EffectColumns(arm.columns_of(effect, motion), pullback)
