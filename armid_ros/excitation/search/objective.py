# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The cost of a trajectory and its gradient by the Fourier coefficients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from armid_ros.effects import Effect
from armid_ros.effects.direction import BlurredMotion
from armid_ros.excitation.fourier import fourier_basis
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.search.effect_gradient import (
    columns_by_state,
    EffectColumns,
    Gradient,
    rigid_columns,
    STEP,
)
from armid_ros.excitation.search.rigid_gradient import RigidRegressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: The direction of motion is blurred below this share of a joint's velocity limit.
_BLUR = 0.05

#: Samples before and after the period for columns that depend on the motion around a sample.
_MARGIN = 8


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
    wide : tuple of ndarray
        Times and basis with some samples more before and after the period.
    width : ndarray, shape (n,)
        Velocity below which the direction of motion is blurred [rad/s or m/s].

    """

    problem: DesignProblem
    prior: FloatArray | None
    t: FloatArray
    basis: tuple[FloatArray, FloatArray, FloatArray] = field(repr=False)
    wide: tuple[FloatArray, tuple[FloatArray, FloatArray, FloatArray]] = field(repr=False)
    width: FloatArray

    @classmethod
    def of(cls, problem: DesignProblem, prior: FloatArray | None = None) -> Objective:
        """Prepare for the samples of the settings."""
        settings = problem.settings
        t: FloatArray = np.linspace(0.0, settings.period, settings.samples, endpoint=False)
        velocity = problem.limits.velocity
        width = _BLUR * np.where(np.isfinite(velocity), velocity, 1.0)
        wide: FloatArray = np.arange(-_MARGIN, settings.samples + _MARGIN) * t[1]
        bases = [fourier_basis(u, settings.period, settings.harmonics) for u in (t, wide)]
        return cls(problem, prior, t, bases[0], (wide, bases[1]), width)

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
            return rigid_columns(rows, motion, RigidRegressor.of(arm.body, felt))
        if effect.instantaneous:
            return columns_by_state(effect, motion, arm)
        return self._columns_by_coefficient(effect, x)

    def _columns_by_coefficient(self, effect: Effect, x: FloatArray) -> EffectColumns:
        """Return columns that depend on the motion's past, with finite differences behind them."""
        joints, (times, basis) = self.problem.limits.joints, self.wide

        def columns(y: FloatArray) -> FloatArray:
            motion = Motion(joints, times, *(b @ y.T for b in basis))
            return self.problem.arm.columns_of(effect, motion)[_MARGIN:-_MARGIN]

        here = columns(x)

        def pullback(weights: FloatArray) -> FloatArray:
            gradient = np.empty_like(x)
            for index in np.ndindex(*x.shape):
                step = STEP * max(1.0, abs(float(x[index])))
                moved = x.copy()
                moved[index] += step
                gradient[index] = np.sum(weights * (columns(moved) - here)) / step
            return gradient

        return EffectColumns(here, pullback)
