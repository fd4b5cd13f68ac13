# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The cost of a trajectory and its gradient by the Fourier coefficients.

Columns that depend only on the state are differentiated by finite differences of the states of all
samples at once. Columns that depend on the past of the motion are differentiated by differences of
every coefficient.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from armid_ros.effects.direction import BlurredMotion
from armid_ros.excitation.fourier import fourier_basis, FourierTrajectory, MARGIN
from armid_ros.excitation.problem import DesignProblem, marked
from armid_ros.model import regressor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Step of finite differences for a state of size 1.
_STEP = 1e-7


class Objective:
    """
    Cost of a trajectory as a function of its coefficients X = (q0, a, b), shape (n, 1 + 2 H).

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    prior : ndarray, shape (r, r), optional
        Information of earlier recordings.

    """

    def __init__(self, problem: DesignProblem, prior: FloatArray | None = None) -> None:
        self.problem, self.prior, settings = problem, prior, problem.settings
        self.t: FloatArray = np.linspace(0.0, settings.period, settings.samples, endpoint=False)
        self.basis = fourier_basis(self.t, settings.period, settings.harmonics)
        velocity = problem.limits.velocity
        # the direction of motion is smoothed below 5 % of the velocity limit
        self.width = 0.05 * np.where(np.isfinite(velocity), velocity, 1.0)
        past = marked(problem.arm, lambda effect: not effect.instantaneous)
        # indices of the standard parameters among the columns; columns of the past are last
        self._order = np.argsort(np.argsort(past, kind='stable'))

    def value(self, x: FloatArray) -> tuple[float, Callable[[], FloatArray]]:
        """
        Return the smooth cost, and a function that computes its gradient.

        Parameters
        ----------
        x : ndarray, shape (n, 1 + 2 H)
            Coefficients.

        Returns
        -------
        cost : float
            Smooth cost; inf if the parameters are not identifiable.
        gradient : callable () -> ndarray, shape (n, 1 + 2 H)
            Derivative by the coefficients; evaluated only when needed, because a line search
            rarely needs it.

        """
        problem, settings = self.problem, self.problem.settings
        states = (basis @ x.T for basis in self.basis)
        motion = BlurredMotion(problem.limits.joints, self.t, *states, width=self.width)
        state, past = self._by_state(motion), self._by_past(x)
        columns = np.concatenate(state + past, axis=2)
        order = self._order[problem.base.independent]
        inverse_noise = 1.0 / problem.noise[:, np.newaxis]
        w = (columns[:, :, order] * inverse_noise).reshape(-1, len(order))
        weight = settings.rate * settings.period * settings.n_periods / len(self.t)
        matrix = weight * (w.T @ w)
        if self.prior is not None:
            matrix = matrix + self.prior
        cost, by_matrix = problem.criterion.smooth(matrix)

        def gradient() -> FloatArray:
            weights = np.zeros_like(columns)
            by_w = 2.0 * weight * (w @ by_matrix)
            weights[:, :, order] = by_w.reshape(*motion.q.shape, -1) * inverse_noise
            by_state = self._state_gradient(motion, _weighted(state, weights), weights)
            return by_state + self._past_gradient(x, past, weights)

        return cost, gradient

    def _state_gradient(self, motion: Motion, here: FloatArray, weights: FloatArray) -> FloatArray:
        """Differentiate sum(weights * columns) by the coefficients, for columns of the state."""
        count, n = motion.q.shape
        total = np.zeros((n, self.basis[0].shape[1]))
        state = np.array([motion.q, motion.dq, motion.ddq])
        for argument, basis in enumerate(self.basis):
            # eight joints at once; limits the memory of their columns
            for joints in np.array_split(np.arange(n), -(-n // 8)):
                moved = np.tile(state, (1, len(joints), 1)).reshape(3, len(joints), count, n)
                moved[argument, np.arange(len(joints)), :, joints] += _STEP
                q, dq, ddq = moved.reshape(3, -1, n)
                t = np.tile(motion.t, len(joints))
                there = self._by_state(replace(motion, t=t, q=q, dq=dq, ddq=ddq))
                total[joints] += (_weighted(there, weights) - here) @ basis / _STEP
        return total

    def _past_gradient(
        self, x: FloatArray, past: Sequence[FloatArray], weights: FloatArray
    ) -> FloatArray:
        """Differentiate sum(weights * columns) by the coefficients, for columns of the past."""
        total = np.zeros_like(x)
        if past:
            weights = weights[:, :, -sum(block.shape[2] for block in past) :]
            here = _weighted(past, weights)
            for index in np.ndindex(*x.shape):
                moved = x.copy()
                moved[index] += _STEP
                total[index] = (_weighted(self._by_past(moved), weights) - here).sum() / _STEP
        return total

    def _by_state(self, motion: Motion) -> list[FloatArray]:
        """Return the columns that depend only on the state: of the rigid body and of effects."""
        arm, target = self.problem.arm, self.problem.settings.target
        if target == 'effects':
            body = np.zeros((*motion.q.shape, len(arm.robot.rigid_parameters)))
        else:
            still = target == 'gravity' or arm.quasi_static
            body = regressor(arm.body, motion.at_rest() if still else motion)
        return [body, *(arm.columns_of(e, motion) for e in arm.effects if e.instantaneous)]

    def _by_past(self, x: FloatArray) -> list[FloatArray]:
        """Return the columns of effects that depend on the past of the motion."""
        problem = self.problem
        effects = [effect for effect in problem.arm.effects if not effect.instantaneous]
        path = FourierTrajectory.of(problem.limits.joints, problem.settings.period, x)
        motion = path.with_margins(len(self.t))
        return [problem.arm.columns_of(effect, motion)[MARGIN:-MARGIN] for effect in effects]


def _weighted(blocks: Sequence[FloatArray], weights: FloatArray) -> FloatArray:
    """Return sum(weights * columns) of each sample, blocks of (k N, n, P) to (k, N)."""
    total, start = 0.0, 0
    for block in blocks:
        stop = start + block.shape[2]
        part = block.reshape(-1, *weights.shape[:2], block.shape[2])
        total = total + np.einsum('jkrp,krp->jk', part, weights[:, :, start:stop])
        start = stop
    return np.asarray(total)
