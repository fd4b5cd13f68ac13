# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffness of springs between two machines, from torques of one and joint angles of both.

The torque tau = Y pi + sum_s k_s J_s^T D_s is linear in the stiffness k. The vector D between the
ends of a spring is a small difference of measured angles. Noise of the angles makes J^T D too long
on average, so k is too small, by several per cent at 0.1 deg. The noise x of a motion changes the
torque by G x, where G is the derivative of the model by the motion. Residuals r then have the
covariance S = var(tau) + G var(x) G^T, which also depends on k. The stiffness that minimises
sum r^T S^-1 r is consistent (generalised total least squares). The columns are computed at the
most likely motion, given the residuals.
Source: Van Huffel and Vandewalle 1991; the leg pair's equations (16), (18), (23), (25).

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.fitting.covariance import score_products, widened
from armid_ros.identification.ties.problem import InteractionProblem
from armid_ros.motion import FloatArray, read_only
import numpy as np
from scipy.optimize import minimize

#: Smallest z-score of a spring that exists; without a spring, it has a probability of 3e-5.
MIN_Z_SCORE = 4.0


@dataclass(frozen=True)
class Interaction:
    """
    Estimated stiffness of springs between two machines.

    Attributes
    ----------
    estimate : Estimate
        Stiffnesses, then free combinations of inertias.
    uncorrected : ndarray, shape (P,)
        Least-squares estimate of the same parameters, with the bias by noisy angles.
    segments : tuple of str
        Names of the springs; a single 'all' if all have the same stiffness.
    torque_noise : ndarray, shape (n,)
        Standard deviation of the torques, as given or as estimated [N m].
    position_noise : ndarray, shape (n + m,)
        Standard deviation of the noise of both machines' angles, which is corrected for [rad].
    residual : ndarray, shape (N, n)
        Residual of the torques [N m].
    misfit : float
        Sum of weighted squared residuals; the expected value is the degrees of freedom.

    """

    estimate: Estimate
    uncorrected: FloatArray
    segments: tuple[str, ...]
    torque_noise: FloatArray
    position_noise: FloatArray
    residual: FloatArray
    misfit: float

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness of every spring, shape (S,) [N/m]."""
        return self.estimate.values[: len(self.segments)]

    @property
    def std(self) -> FloatArray:
        """Standard deviations of the stiffnesses, shape (S,) [N/m]."""
        return self.estimate.std[: len(self.segments)]

    @property
    def bias(self) -> FloatArray:
        """Bias of least-squares stiffnesses due to noisy angles, shape (S,) [N/m]."""
        return np.asarray(self.uncorrected[: len(self.segments)] - self.stiffness)

    def interval(self, confidence: float = 0.95) -> FloatArray:
        """Return the confidence interval of each stiffness, shape (S, 2) [N/m]."""
        return self.estimate.interval(confidence)[: len(self.segments)]


def identify_interaction(problem: InteractionProblem) -> Interaction:
    """
    Estimate spring stiffnesses and free inertias, corrected for bias by noisy angles.

    Parameters
    ----------
    problem : InteractionProblem
        Torques, columns and noise; see ``interaction_problem``. Residuals larger than the noise
        widen the intervals.

    Raises
    ------
    IdentificationError
        If the motion does not identify every stiffness, or the iteration does not converge.

    """
    uncorrected = _least_squares(problem, problem.columns)
    # start: the same stiffness for all springs by least squares, which noise affects little
    count = len(problem.segments)
    together = problem.columns[:, :, :count].sum(axis=2, keepdims=True)
    columns = np.concatenate([together, problem.columns[:, :, count:]], axis=2)
    theta = _least_squares(problem, columns)
    theta = np.concatenate([np.full(count, theta[0]), theta[1:]])
    noise = problem.torque_noise
    # assumed share of torque noise in the mean square of residuals if no noise was measured
    least = 0.01 * np.mean(problem.residual(theta) ** 2, axis=0) + 1e-18
    used = np.where(noise > 0.0, noise**2, least)
    theta = _most_likely(problem, theta, used)
    step = _gauss_newton(problem, theta, used)
    excess = max(1.0, step.misfit / max(1, problem.tau.size - len(theta)))
    names = tuple(
        ParameterName('interaction_stiffness', joint, 'N/m') for joint in problem.spring_joints
    )
    return Interaction(
        Estimate(names + problem.rigid, theta, _covariance(problem, theta, used, step, excess)),
        read_only(uncorrected),
        problem.segments,
        read_only(np.sqrt(used)),
        problem.position_noise,
        read_only(problem.residual(theta)),
        step.misfit,
    )


def _most_likely(
    problem: InteractionProblem, theta: FloatArray, variance: FloatArray
) -> FloatArray:
    """Return the maximum-likelihood parameters, found by BFGS from start values."""
    # largest gradient, in standard deviations, at the end of the iteration
    converged = 1e-3
    # Where noise dominates a column, the information overestimates the curvature of the loss, and
    # Gauss-Newton steps oscillate. BFGS begins with the information and learns the curvature from
    # the gradients.
    information = _gauss_newton(problem, theta, variance).information
    size = np.sqrt(np.diag(information))
    root = np.linalg.cholesky(information / np.outer(size, size))
    unit = np.linalg.inv(root).T / size[:, np.newaxis]  # directions of one standard deviation

    def half_loss(z: FloatArray) -> tuple[float, FloatArray]:
        """Return half the loss and its gradient at z standard deviations from the start values."""
        here = theta + unit @ z
        step = _gauss_newton(problem, here, variance)
        away = here - problem.described
        loss = step.misfit + float(away @ problem.precision @ away)
        return 0.5 * loss, -unit.T @ step.gradient

    found = minimize(
        half_loss,
        np.zeros(len(theta)),
        jac=True,
        method='BFGS',
        options={'gtol': converged, 'maxiter': 300},
    )
    if not np.max(np.abs(found.jac)) < 10.0 * converged:
        raise IdentificationError(
            'the stiffness of the springs does not converge: the angles are too noisy for '
            f'extensions of {1e3 * problem.rms_extension:.2g} mm; filter them more, or move more'
        )
    return np.asarray(theta + unit @ found.x)


def _least_squares(problem: InteractionProblem, columns: FloatArray) -> FloatArray:
    """Return least-squares parameters; raise an error for a spring that never stretches."""
    w = columns.reshape(-1, columns.shape[2])
    scale = np.linalg.norm(w, axis=0)
    springs = scale[: columns.shape[2] - len(problem.rigid)]
    # the spring is not extended if its RMS torque per stiffness [m^2] is smaller
    if not np.all(springs > 1e-9 * np.sqrt(len(w))):
        name = problem.segments[int(np.argmin(springs))]
        raise IdentificationError(
            f'spring {name} never stretches; record a motion that stretches the spring'
        )
    y = problem.tau - problem.known
    return np.asarray(np.linalg.lstsq(w / scale, y.ravel(), rcond=None)[0] / scale)


class _Step(NamedTuple):
    """Problem linearised at the most likely motion, with the covariance S of its residuals."""

    gradient: FloatArray  # negative gradient of half the loss, (P,)
    information: FloatArray  # (P, P)
    columns: FloatArray  # (N, n, P)
    weighted: FloatArray  # S^-1 times the residuals, (N, n)
    misfit: float


def _gauss_newton(problem: InteractionProblem, theta: FloatArray, variance: FloatArray) -> _Step:
    """Linearise the problem at the most likely motion, given the residuals."""
    by_motion = problem.sensitivity(theta)
    covariance = _noise(problem, by_motion, variance)
    residual = problem.residual(theta)
    weighted = np.linalg.solve(covariance, residual[..., np.newaxis])[..., 0]
    correction = np.einsum('nij,ni->nj', by_motion @ problem.motion_noise, weighted)
    columns = problem.columns + np.einsum('nipj,nj->nip', problem.columns_by_motion, correction)
    information = np.einsum('nip,niq->pq', columns, np.linalg.solve(covariance, columns))
    information += problem.precision
    gradient = np.einsum('nip,ni->p', columns, weighted)
    gradient += problem.precision @ (problem.described - theta)
    misfit = float(np.sum(residual * weighted))
    return _Step(gradient, information, columns, np.asarray(weighted), misfit)


def _noise(problem: InteractionProblem, by_motion: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the covariance S of each sample's residuals, shape (N, n, n)."""
    covariance = by_motion @ problem.motion_noise @ by_motion.transpose(0, 2, 1)
    return np.asarray(covariance + np.diag(variance))


def _covariance(
    problem: InteractionProblem,
    theta: FloatArray,
    variance: FloatArray,
    step: _Step,
    excess: float,
) -> FloatArray:
    """Return the sandwich covariance H^-1 B H^-1 of the parameters, shape (P, P)."""
    # B is the covariance of the scores. Filters correlate neighbouring samples by a known
    # amount. If scores vary more, as with coloured noise, standard deviations are increased.
    # Independent poses have B = H.
    information = step.information
    size = np.sqrt(np.diag(information))
    scaled = np.linalg.inv(information / np.outer(size, size))
    inverse = scaled / np.outer(size, size)
    if len(problem.torque_lags) == 1:
        return np.asarray(excess * inverse)
    by_motion = problem.sensitivity(theta)
    weighted = np.linalg.solve(_noise(problem, by_motion, variance), step.columns)
    moved = np.einsum('nij,nip->npj', by_motion, weighted)
    scores = np.einsum('nip,ni->np', step.columns, step.weighted)
    known = information
    lags = len(problem.torque_lags)
    for lag in range(1, lags):
        lagged = np.einsum('npj,jk,nqk->pq', moved[:-lag], problem.motion_lags[lag], moved[lag:])
        torque = problem.torque_lags[lag] * variance
        lagged += np.einsum('nip,i,niq->pq', weighted[:-lag], torque, weighted[lag:])
        known = known + lagged + lagged.T
    covariance = excess * inverse @ known @ inverse
    return widened(covariance, inverse, score_products([scores], lags))
