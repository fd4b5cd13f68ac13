# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The cost of a trajectory and its gradient by the Fourier coefficients."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.effects import Effect
from armid_ros.effects.load import Payload
from armid_ros.excitation.chain import Chain
from armid_ros.excitation.effect_gradient import smooth_columns, SmoothColumns
from armid_ros.excitation.fourier import fourier_basis
from armid_ros.excitation.problem import Problem
from armid_ros.excitation.rigid_gradient import RigidRegressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: The direction of motion is blurred below this share of a joint's velocity limit.
_BLUR = 0.05

#: Step of the finite differences of effects without a known gradient, as a share of the
#: coefficients' size.
_STEP = 1e-6


@dataclass(frozen=True)
class Objective:
    """
    Cost of a trajectory as a function of its coefficients X = (q0, a, b), shape (n, 1 + 2 H).

    Attributes
    ----------
    problem : Problem
        What is wanted.
    prior : ndarray, shape (r, r), or None
        Information that is there already.
    chain : Chain
        The arm.
    t : ndarray, shape (N,)
        Sample times [s].
    basis : tuple of ndarray, each of shape (N, 1 + 2 H)
        q, dq and ddq per coefficient.
    width : ndarray, shape (n,)
        Velocity below which the direction of motion is blurred [rad/s or m/s].

    """

    problem: Problem
    prior: FloatArray | None
    chain: Chain
    t: FloatArray
    basis: tuple[FloatArray, FloatArray, FloatArray] = field(repr=False)
    width: FloatArray

    @classmethod
    def of(cls, problem: Problem, prior: FloatArray | None = None) -> Objective:
        """Prepare for the samples of the settings."""
        settings = problem.settings
        t: FloatArray = np.linspace(0.0, settings.period, settings.samples, endpoint=False)
        velocity = problem.limits.velocity
        width = _BLUR * np.where(np.isfinite(velocity), velocity, 1.0)
        basis = fourier_basis(t, settings.period, settings.harmonics)
        return cls(problem, prior, Chain.of(problem.arm.robot), t, basis, width)

    def motion(self, x: FloatArray) -> Motion:
        """Return the samples of coefficients X."""
        return Motion(self.problem.limits.joints, self.t, *(basis @ x.T for basis in self.basis))

    def value(self, x: FloatArray) -> tuple[float, FloatArray]:
        """
        Return the smooth cost and its gradient.

        Parameters
        ----------
        x : ndarray, shape (n, 1 + 2 H)
            Coefficients.

        Returns
        -------
        cost : float
            Inf where the parameters cannot be seen.
        gradient : ndarray, shape (n, 1 + 2 H)
            Derivative by the coefficients.

        """
        problem, motion = self.problem, self.motion(x)
        target, rest = problem.settings.target, np.zeros_like(motion.q)
        still = target == 'gravity'
        rigid = RigidRegressor.of(
            self.chain, motion.q, rest if still else motion.dq, rest if still else motion.ddq
        )
        blocks = [np.zeros((*motion.q.shape, 10 * self.chain.n_joints))]
        if target != 'effects':
            blocks[0] = rigid.matrix()
        effects = [(e, self._effect(e, motion, rigid)) for e in problem.arm.effects]
        columns = np.concatenate([*blocks, *(c.columns for _, c in effects)], axis=2)
        inverse_noise = (1.0 / problem.noise)[:, np.newaxis]
        w = (columns[:, :, problem.selected] * inverse_noise).reshape(-1, len(problem.selected))
        settings = problem.settings
        weight = settings.rate * settings.period * settings.n_periods / len(self.t)
        matrix = weight * (w.T @ w)
        if self.prior is not None:
            matrix = matrix + self.prior
        cost, by_matrix = problem.criterion.smooth(matrix)
        weights = np.zeros_like(columns)
        by_w = (2.0 * weight * (w @ by_matrix)).reshape(*motion.q.shape, -1)
        weights[:, :, problem.selected] = by_w * inverse_noise
        return cost, self._gradient(x, weights, rigid, [c for _, c in effects], still)

    def _gradient(
        self,
        x: FloatArray,
        weights: FloatArray,
        rigid: RigidRegressor,
        effects: list[SmoothColumns],
        still: bool,
    ) -> FloatArray:
        """Chain derivatives by the columns, shape (N, n, P), to those by the coefficients."""
        size = 10 * self.chain.n_joints
        by_state = [np.zeros(weights.shape[:2]) for _ in range(3)]
        if self.problem.settings.target != 'effects':
            parts = rigid.pullback(weights[:, :, :size])
            by_state = [parts[0], *(0.0 * part if still else part for part in parts[1:])]
        unknown: list[tuple[Effect, FloatArray]] = []
        start = size
        for effect, smooth in zip(self.problem.arm.effects, effects, strict=True):
            stop = start + smooth.columns.shape[2]
            part = weights[:, :, start:stop]
            if smooth.pullback is None:
                unknown.append((effect, part))
            else:
                for total, addition in zip(by_state, smooth.pullback(part), strict=True):
                    total += addition
            start = stop
        gradient = sum(
            (total.T @ basis for total, basis in zip(by_state, self.basis, strict=True)),
            np.zeros_like(x),
        )
        for effect, part in unknown:
            gradient = gradient + self._difference(x, effect, part)
        return np.asarray(gradient)

    def _effect(self, effect: Effect, motion: Motion, rigid: RigidRegressor) -> SmoothColumns:
        if isinstance(effect, Payload):
            if self.problem.settings.target == 'gravity':
                rigid = RigidRegressor.of(self.chain, motion.q, motion.dq, motion.ddq)
            return _payload(effect, motion, rigid)
        return smooth_columns(effect, motion, self.width) or SmoothColumns(
            effect.columns(motion, self.problem.arm), None
        )

    def _difference(self, x: FloatArray, effect: Effect, weights: FloatArray) -> FloatArray:
        """Differentiate sum(weights * columns) by the coefficients, by central differences."""
        gradient = np.empty_like(x)
        arm = self.problem.arm
        for index in np.ndindex(*x.shape):
            step = _STEP * max(1.0, abs(float(x[index])))
            ends = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[index] += sign * step
                ends.append(float(np.sum(weights * effect.columns(self.motion(moved), arm))))
            gradient[index] = (ends[0] - ends[1]) / (2.0 * step)
        return gradient


def _payload(effect: Payload, motion: Motion, rigid: RigidRegressor) -> SmoothColumns:
    """Columns of a payload: those of the link that carries it."""
    links = effect.indices(motion.joints)
    pick = np.concatenate([np.arange(10 * link, 10 * link + 10) for link in links])

    def pullback(weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        spread = np.zeros((*motion.q.shape, 10 * motion.n_joints))
        spread[:, :, pick] = weights
        return rigid.pullback(spread)

    return SmoothColumns(rigid.matrix()[:, :, pick], pullback)
