# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Cost and limits of a trajectory as smooth functions of Fourier coefficients, with gradients.

The compiled kernel differentiates the columns of the rigid body. Other columns that depend only on
the state are differentiated by finite differences of the states of all samples at once, columns
that depend on the past of the motion by finite differences of every coefficient.

Each limit of each joint is one constraint, c <= 0. It is the soft maximum (Kreisselmeier and
Steinhauser 1979) of the excess over all samples, relative to the limit. A soft maximum is never
below the maximum, so a trajectory with c <= 0 keeps the limits in every sample. It exceeds the
maximum by at most log(samples) / sharpness.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from armid_ros.excitation.fourier import fourier_basis, FourierTrajectory, MARGIN
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.problem import DesignProblem, parameter_mask
from armid_ros.model.rigid_body import regressor, regressor_slopes
from armid_ros.motion import BlurredMotion, FloatArray, Motion
import numpy as np
import numpy.typing as npt

#: Step of finite differences for a state of size 1.
_STEP = 1e-7


class Objective:
    """
    Design cost of a trajectory as a function of its coefficient matrix (q0, a, b).

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
        arm = problem.arm
        self._still = settings.target == 'gravity' or arm.quasi_static
        past = parameter_mask(arm, {one.name for one in arm.effects if not one.instantaneous})
        # indices of the standard parameters among the columns; columns of the past come last
        self._order = np.argsort(np.argsort(past, kind='stable'))

    def value(self, x: FloatArray) -> tuple[float, Callable[[], FloatArray]]:
        """
        Return a smooth approximation of the cost, and a function that computes its gradient.

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
        state, past = self._state_columns(motion), self._past_columns(x)
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
            total = self._state_gradient(motion, weights)
            # differentiate sum(weights * columns) by the coefficients, where columns need the past
            if past:
                weights = weights[:, :, -sum(block.shape[2] for block in past) :]
                here = _weighted(past, weights)
                for index in np.ndindex(*x.shape):
                    moved = x.copy()
                    moved[index] += _STEP
                    there = _weighted(self._past_columns(moved), weights)
                    total[index] += (there - here).sum() / _STEP
            return total

        return cost, gradient

    def _state_gradient(self, motion: Motion, weights: FloatArray) -> FloatArray:
        """Return the gradient of the weighted sum of `_state_columns` by Fourier coefficients."""
        (count, n), arm = motion.q.shape, self.problem.arm
        total, size = np.zeros((n, self.basis[0].shape[1])), len(arm.robot.rigid_parameters)
        of_body = motion.at_rest() if self._still else motion
        slopes = regressor_slopes(arm.body, of_body, weights[:, :, :size])
        if slopes is not None:
            weights, slopes = weights[:, :, size:], slopes[:1] if self._still else slopes
            total += sum(by.T @ basis for by, basis in zip(slopes, self.basis, strict=False))
        here = _weighted(self._state_columns(motion, slopes is None), weights)
        state = np.array([motion.q, motion.dq, motion.ddq])
        for argument, basis in enumerate(self.basis):
            # eight joints at once, to limit the memory of their columns
            for joints in np.array_split(np.arange(n), -(-n // 8)):
                moved = np.tile(state, (1, len(joints), 1)).reshape(3, len(joints), count, n)
                moved[argument, np.arange(len(joints)), :, joints] += _STEP
                q, dq, ddq = moved.reshape(3, -1, n)
                times = np.tile(motion.t, len(joints))
                moving = replace(motion, t=times, q=q, dq=dq, ddq=ddq)
                there = self._state_columns(moving, slopes is None)
                total[joints] += (_weighted(there, weights) - here) @ basis / _STEP
        return total

    def _state_columns(self, motion: Motion, with_body: bool = True) -> list[FloatArray]:
        """Return the regressor columns of the rigid body and of each instantaneous effect."""
        arm = self.problem.arm
        effects = [arm.columns_of(e, motion) for e in arm.effects if e.instantaneous]
        if not with_body:
            return effects
        if self.problem.settings.target == 'effects':
            return [np.zeros((*motion.q.shape, len(arm.robot.rigid_parameters))), *effects]
        return [regressor(arm.body, motion.at_rest() if self._still else motion), *effects]

    def _past_columns(self, x: FloatArray) -> list[FloatArray]:
        """Return the regressor columns of each effect that depends on the past motion."""
        problem = self.problem
        effects = [effect for effect in problem.arm.effects if not effect.instantaneous]
        path = FourierTrajectory.of(problem.limits.joints, problem.settings.period, x)
        motion = path.with_margins(len(self.t))
        return [problem.arm.columns_of(effect, motion)[MARGIN:-MARGIN] for effect in effects]


def _weighted(blocks: Sequence[FloatArray], weights: FloatArray) -> FloatArray:
    """Return the weighted sum of regressor columns at each sample of k motions, (k, N)."""
    total, start = np.zeros((1, len(weights))), 0
    for block in blocks:
        stop = start + block.shape[2]
        part = block.reshape(-1, *weights.shape[:2], block.shape[2])
        total = total + np.einsum('jkrp,krp->jk', part, weights[:, :, start:stop])
        start = stop
    return total


#: Number of parts of the period, each with one clearance constraint. A solver step can then
#: avoid several close approaches together.
_CLEARANCE_PARTS = 20


#: Values of some constraints, and a function that computes their gradients.
Part = tuple[FloatArray, Callable[[], FloatArray]]


class Constraints:
    """
    Limits and clearance as constraints on the coefficients of a trajectory.

    Parameters
    ----------
    problem : DesignProblem
        Problem with the limits and the prior model.
    clearance : ClearanceModel or None
        Bodies to keep apart.
    reserve : float
        Share of every limit that is reserved for peaks between the samples.
    sharpness : float
        Sharpness of the soft maximum.
    more_times : ndarray
        Additional times at which torque and clearance are evaluated [s].

    """

    def __init__(
        self,
        problem: DesignProblem,
        clearance: ClearanceModel | None,
        *,
        reserve: float,
        sharpness: float,
        more_times: FloatArray,
    ) -> None:
        self.problem, self.clearance = problem, clearance
        self.reserve, self.sharpness = reserve, sharpness
        period, harmonics = problem.settings.period, problem.settings.harmonics
        samples = problem.settings.samples
        # samples for position, velocity and acceleration, and for torque and clearance
        dense: FloatArray = np.linspace(0.0, period, 5 * samples, endpoint=False)
        states: FloatArray = np.linspace(0.0, period, 3 * samples, endpoint=False)
        self.dense = fourier_basis(dense, period, harmonics)
        self.t = np.unique(np.concatenate([states, more_times]))
        self.basis = fourier_basis(self.t, period, harmonics)

    def value(self, x: FloatArray) -> Part:
        """
        Return the constraint values, and a function that computes their gradients.

        Parameters
        ----------
        x : ndarray, shape (n, 1 + 2 H)
            Coefficients.

        Returns
        -------
        values : ndarray, shape (m,)
            Zero or negative if the limit is kept.
        gradients : callable () -> ndarray, shape (m, n, 1 + 2 H)
            Derivatives by the coefficients; evaluated only when needed, because a line search
            rarely needs them.

        """
        limits = self.problem.limits
        span = limits.upper - limits.lower
        span = np.where(np.isfinite(span), span, 1.0)
        q, dq, ddq = self.dense
        velocity, acceleration = limits.velocity, limits.acceleration
        parts = [
            self._own_joint(q, x, limits.lower, limits.upper, span),
            self._own_joint(dq, x, -velocity, velocity, velocity),
            self._own_joint(ddq, x, -acceleration, acceleration, acceleration),
        ]
        motion = Motion(limits.joints, self.t, *(basis @ x.T for basis in self.basis))
        if np.isfinite(limits.torque).any():
            parts.append(self._torque(motion))
        if self.clearance is not None and len(self.clearance.pairs):
            parts.append(self._clear(motion))
        return (
            np.concatenate([values for values, _ in parts]),
            lambda: np.concatenate([gradients() for _, gradients in parts]),
        )

    def _own_joint(
        self,
        basis: FloatArray,
        x: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        unit: FloatArray,
    ) -> Part:
        """Return constraints on position, velocity or acceleration of each limited joint."""
        values = basis @ x.T
        limited, totals, signed = self._between(values, lower, upper, unit)

        def gradients() -> FloatArray:
            result = np.zeros((len(limited), values.shape[1], basis.shape[1]))
            result[np.arange(len(limited)), limited] = signed @ basis
            return result

        return totals, gradients

    def _torque(self, motion: Motion) -> Part:
        arm, limit = self.problem.arm, self.problem.limits.torque
        limited, totals, weights = self._between(arm.joint_torque(motion), -limit, limit, limit)

        def gradients() -> FloatArray:
            # directions of dry friction, states of presliding and twists of springs are constant
            action = arm.along(motion).action()
            by_q, by_dq, by_ddq = arm.link_slopes(motion)
            if action.damping is not None:
                by_dq = by_dq + action.damping
            if action.inertia is not None:
                by_ddq = by_ddq + action.inertia
            if action.torque is not None:
                more = action.torque_derivatives(motion)
                by_q, by_dq = by_q + more[0], by_dq + more[1]
            parts = [
                np.einsum('lk,klm,kc->lmc', weights, by[:, limited], basis, optimize=True)
                for by, basis in zip((by_q, by_dq, by_ddq), self.basis, strict=True)
            ]
            return np.asarray(np.sum(parts, axis=0))

        return totals, gradients

    def _clear(self, motion: Motion) -> Part:
        """Return one clearance constraint for each of 20 equal parts of the period."""
        assert self.clearance is not None
        # unit of the constraint [m]; bodies that are 0.6 units beyond the margin are ignored. At a
        # sharpness of 60, their weight in the soft maximum is exp(-36)
        margin, unit, ignored = self.clearance.margin, 0.1, 0.6
        near = self.clearance.near(motion.q, margin + ignored * unit)
        stretch = self.t[near.sample] * (_CLEARANCE_PARTS / self.problem.settings.period)
        totals = np.full(_CLEARANCE_PARTS, -ignored)
        weighted: list[tuple[int, npt.NDArray[np.intp], FloatArray]] = []
        for number in range(_CLEARANCE_PARTS):
            rows = np.flatnonzero(stretch.astype(int) == number)
            if len(rows):
                lack = (margin - near.distance[rows]) / unit
                totals[number], weights = self._soft_maximum(lack)
                weighted.append((number, rows, -weights[:, np.newaxis] / unit))

        def gradients() -> FloatArray:
            result = np.zeros((_CLEARANCE_PARTS, motion.n_joints, self.basis[0].shape[1]))
            for number, rows, weights in weighted:
                result[number] = (weights * near.by_q[rows]).T @ self.basis[0][near.sample[rows]]
            return result

        return totals, gradients

    def _between(
        self, values: FloatArray, lower: FloatArray, upper: FloatArray, unit: FloatArray
    ) -> tuple[npt.NDArray[np.intp], FloatArray, FloatArray]:
        """Return limited joints, the soft maximum of each joint's excess, and its derivatives."""
        limited = np.flatnonzero(np.isfinite(lower) | np.isfinite(upper))
        lower, upper, unit = (one[limited, np.newaxis] for one in (lower, upper, unit))
        over, under = values.T[limited] - upper, lower - values.T[limited]
        excess = np.concatenate([over, under], axis=1) / unit + self.reserve
        totals, weights = self._soft_maximum(excess)
        return limited, totals, (weights[:, : len(values)] - weights[:, len(values) :]) / unit

    def _soft_maximum(self, excess: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the soft maximum of excesses along the last axis, and its derivatives."""
        largest = excess.max(axis=-1, keepdims=True)
        weights = np.exp(self.sharpness * (excess - largest))
        total = weights.sum(axis=-1, keepdims=True)
        return (largest + np.log(total) / self.sharpness)[..., 0], weights / total
