# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffness of what ties two machines, from the torques of one and the joint angles of both.

tau = Y pi + sum_s k_s J_s^T D_s is linear in k, but D, the way between the ends of a spring, is a
small difference of measured angles: noise in them makes J^T D too long on average and k too
small, by several per cent at 0.1 deg. To the torque the noise x of a motion does G x, where G is
the derivative of the model by the motion, so that residuals have the covariance
S = var(tau) + G var(x) G^T, in which k stands as well. The k that makes sum r^T S^-1 r smallest is
consistent (generalised total least squares); its columns are those at the motion that the
residuals make likely.
Source: Van Huffel and Vandewalle 1991; the leg pair's equations (16), (18), (23), (25).

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.ties.problem import InteractionProblem
from armid_ros.motion import FloatArray, read_only
import numpy as np
from scipy.optimize import minimize

#: Steps of Gauss and Newton, and of the quasi-Newton method where they do not lead to the end.
_ITERATIONS = 30, 300
#: Solutions of linear equations that lead to where the iteration begins.
_LINEAR = 4
#: Iterations that take the torques' noise as the residuals have it.
_FREE = 5
#: Iterations after which it stays as it is.
_SETTLED = 25
#: Steps below this share of a standard deviation end the iteration.
_CONVERGED = 1e-3
#: A step that overshoots is halved so many times, one that is too short doubled so many.
_HALVINGS, _DOUBLINGS = 10, 4
#: Of the residuals' mean square at least this share is the torques' own noise.
_LEAST_SHARE = 0.01
#: Torque per stiffness below which a spring is not drawn out, root mean square [m^2].
_DRAWN_OUT = 1e-9


@dataclass(frozen=True)
class Interaction:
    """
    What was found.

    Attributes
    ----------
    estimate : Estimate
        Stiffnesses, then the combinations of inertias that were free.
    uncorrected : ndarray, shape (P,)
        The same by least squares, with the bias of noisy angles in it.
    segments : tuple of str
        Names of the springs; a single 'all' where they have one stiffness.
    torque_noise : ndarray, shape (n,)
        Standard deviation of the torques, as given or as estimated [N m].
    position_noise : ndarray, shape (n + m,)
        Standard deviation of the angles of both machines that was corrected for [rad].
    residual : ndarray, shape (N, n)
        Of the torques [N m].
    misfit : float
        Weighted squares of the residuals, one for each degree of freedom where all is right.

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
        """Their standard deviations, shape (S,) [N/m]."""
        return self.estimate.std[: len(self.segments)]

    @property
    def bias(self) -> FloatArray:
        """Return what noisy angles would have done to them, shape (S,) [N/m]."""
        return np.asarray(self.uncorrected[: len(self.segments)] - self.stiffness)

    def interval(self, confidence: float = 0.95) -> FloatArray:
        """Return lower and upper ends of confidence intervals, shape (S, 2) [N/m]."""
        return self.estimate.interval(confidence)[: len(self.segments)]


def identify_interaction(
    problem: InteractionProblem, torque_noise: FloatArray | float | None = None
) -> Interaction:
    """
    Estimate stiffnesses, and free inertias with them, without the bias of noisy angles.

    Parameters
    ----------
    problem : InteractionProblem
        Torques, columns and their derivatives: see ``interaction_problem``.
    torque_noise : float or ndarray, shape (n,), optional
        Standard deviation of the torques [N m]; by default as it was measured in a recording, or
        from the residuals. What residuals have beyond it widens the intervals.

    Raises
    ------
    IdentificationError
        If the motion does not show every stiffness, or the iteration does not end.

    """
    uncorrected = _least_squares(problem, problem.columns)
    # one stiffness for all springs by least squares, which noise does not blow up
    count = len(problem.segments)
    together = problem.columns[:, :, :count].sum(axis=2, keepdims=True)
    columns = np.concatenate([together, problem.columns[:, :, count:]], axis=2)
    theta = _least_squares(problem, columns)
    theta = np.concatenate([np.full(count, theta[0]), theta[1:]])
    # the variance of the torques as asked for or as measured in them, if it was
    noise = torque_noise
    if noise is None and np.all(problem.torque_noise > 0.0):
        noise = problem.torque_noise
    given = None if noise is None else np.zeros(problem.tau.shape[1]) + np.asarray(noise) ** 2
    used = _torque_variance(problem, theta) if given is None else given
    for _ in range(_LINEAR):
        theta = _compensated(problem, theta, used)
        used = _torque_variance(problem, theta) if given is None else given
    for iteration in range(_ITERATIONS[0]):
        if given is None and iteration < _SETTLED:  # or the two chase each other
            share = 1.0 / max(1, iteration - _FREE)
            used = (1.0 - share) * used + share * _torque_variance(problem, theta)
        step, information, _, _ = _gauss_newton(problem, theta, used)
        step = _scaled(problem, theta, step, used)
        theta = theta + step
        if step @ information @ step < _CONVERGED**2 * len(step):
            break
    else:
        theta = _along_the_valley(problem, theta, used)
    freedom = max(1, problem.tau.size - len(theta))
    misfit = _misfit(problem, theta, used)
    excess = max(1.0, misfit / freedom)
    names = tuple(
        ParameterName('interaction_stiffness', joint, 'N/m') for joint in problem.spring_joints
    )
    return Interaction(
        Estimate(names + problem.rigid, theta, _covariance(problem, theta, used, excess)),
        read_only(uncorrected),
        problem.segments,
        read_only(np.sqrt(used)),
        problem.position_noise,
        read_only(problem.residual(theta)),
        misfit,
    )


def _compensated(
    problem: InteractionProblem, theta: FloatArray, variance: FloatArray
) -> FloatArray:
    """Solve the normal equations less what noise adds to them on average."""
    # Linear, so that it leads from anywhere to near the solution; weights are those at theta.
    weight = np.linalg.inv(_noise(problem, problem.sensitivity(theta), variance))
    weighted = np.einsum('nij,njp->nip', weight, problem.columns)
    each = np.einsum('nij,njpx->nipx', weight, problem.columns_by_motion @ problem.motion_noise)
    matrix = np.einsum('nip,niq->pq', problem.columns, weighted)
    matrix -= np.einsum('nipx,niqx->pq', problem.columns_by_motion, each)
    aim = np.einsum('nip,ni->p', weighted, problem.tau - problem.known)
    aim += np.einsum('nipx,nix->p', each, problem.known_by_motion)
    matrix += problem.precision
    aim += problem.precision @ problem.described
    size = np.sqrt(np.abs(np.diag(matrix)))
    return np.asarray(np.linalg.solve(matrix / np.outer(size, size), aim / size) / size)


def _scaled(
    problem: InteractionProblem, theta: FloatArray, step: FloatArray, variance: FloatArray
) -> FloatArray:
    """Return a step, by powers of two as long as the weighted residuals become smaller."""
    # Where noise makes most of a column, as of accelerations that are small, the information is
    # too large and steps are too short, ten times and more; others overshoot. Nothing if none is
    # good.
    before = _loss(problem, theta, variance)
    reached = _loss(problem, theta + step, variance)
    for _ in range(_HALVINGS):
        if reached <= before:
            break
        step = step / 2.0
        reached = _loss(problem, theta + step, variance)
    else:
        return np.zeros_like(step)
    for _ in range(_DOUBLINGS):
        further = _loss(problem, theta + 2.0 * step, variance)
        if further >= reached:
            break
        step, reached = 2.0 * step, further
    return step


def _along_the_valley(
    problem: InteractionProblem, theta: FloatArray, variance: FloatArray
) -> FloatArray:
    """Return the solution, from a theta near it, by a quasi-Newton method (BFGS)."""
    # Where noise makes most of a column the loss is a valley much flatter than the information
    # says, in which steps of Gauss and Newton go to and fro. The curvature is learned from the
    # gradients, beginning with the information.
    _, information, _, _ = _gauss_newton(problem, theta, variance)
    size = np.sqrt(np.diag(information))
    root = np.linalg.cholesky(information / np.outer(size, size))
    unit = np.linalg.inv(root).T / size[:, np.newaxis]  # of one standard deviation each

    def half_loss(z: FloatArray) -> tuple[float, FloatArray]:
        here = theta + unit @ z
        step, information, _, _ = _gauss_newton(problem, here, variance)
        return 0.5 * _loss(problem, here, variance), -unit.T @ information @ step

    found = minimize(
        half_loss,
        np.zeros(len(theta)),
        jac=True,
        method='BFGS',
        options={'gtol': _CONVERGED, 'maxiter': _ITERATIONS[1]},
    )
    if not np.max(np.abs(found.jac)) < 10.0 * _CONVERGED:
        raise IdentificationError(
            'the stiffness does not settle: the angles are too noisy for ways of '
            f'{1e3 * problem.typical_way:.2g} mm; filter them, or move more'
        )
    return np.asarray(theta + unit @ found.x)


def _loss(problem: InteractionProblem, theta: FloatArray, variance: FloatArray) -> float:
    away = theta - problem.described
    return _misfit(problem, theta, variance) + float(away @ problem.precision @ away)


def _misfit(problem: InteractionProblem, theta: FloatArray, variance: FloatArray) -> float:
    covariance = _noise(problem, problem.sensitivity(theta), variance)
    residual = problem.residual(theta)
    pull = np.linalg.solve(covariance, residual[..., np.newaxis])[..., 0]
    return float(np.sum(residual * pull))


def _least_squares(problem: InteractionProblem, columns: FloatArray) -> FloatArray:
    w = columns.reshape(-1, columns.shape[2])
    scale = np.linalg.norm(w, axis=0)
    springs = scale[: columns.shape[2] - len(problem.rigid)]
    if not np.all(springs > _DRAWN_OUT * np.sqrt(len(w))):
        name = problem.segments[int(np.argmin(springs))]
        raise IdentificationError(f'{name}: its spring is never drawn out, so nothing shows it')
    y = problem.tau - problem.known
    return np.asarray(np.linalg.lstsq(w / scale, y.ravel(), rcond=None)[0] / scale)


def _torque_variance(problem: InteractionProblem, theta: FloatArray) -> FloatArray:
    """Return what of the residuals' variance the angles do not explain, shape (n,)."""
    residual = problem.residual(theta)
    by_motion = problem.sensitivity(theta)
    explained = np.mean(np.sum(by_motion @ problem.motion_noise * by_motion, axis=2), axis=0)
    total = np.mean(residual**2, axis=0)
    least = np.maximum(problem.torque_noise**2, _LEAST_SHARE * total + 1e-18)
    return np.asarray(np.maximum(total - explained, least))


def _gauss_newton(
    problem: InteractionProblem, theta: FloatArray, variance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the step of the parameters and their information, and what both are made of."""
    # These are the columns at the motion that the residuals make likely, shape (N, n, P), and the
    # residuals over their covariance, shape (N, n).
    by_motion = problem.sensitivity(theta)
    covariance = _noise(problem, by_motion, variance)
    pull = np.linalg.solve(covariance, problem.residual(theta)[..., np.newaxis])[..., 0]
    correction = np.einsum('nij,ni->nj', by_motion @ problem.motion_noise, pull)
    columns = problem.columns + np.einsum('nipj,nj->nip', problem.columns_by_motion, correction)
    information = np.einsum('nip,niq->pq', columns, np.linalg.solve(covariance, columns))
    information += problem.precision
    gradient = np.einsum('nip,ni->p', columns, pull)
    gradient += problem.precision @ (problem.described - theta)
    size = np.sqrt(np.diag(information))
    step = np.linalg.solve(information / np.outer(size, size), gradient / size) / size
    return np.asarray(step), np.asarray(information), np.asarray(columns), np.asarray(pull)


def _noise(problem: InteractionProblem, by_motion: FloatArray, variance: FloatArray) -> FloatArray:
    """Return S, the covariance of the residuals of every sample, shape (N, n, n)."""
    covariance = by_motion @ problem.motion_noise @ by_motion.transpose(0, 2, 1)
    return np.asarray(covariance + np.diag(variance))


def _covariance(
    problem: InteractionProblem, theta: FloatArray, variance: FloatArray, excess: float
) -> FloatArray:
    """Return the covariance of the parameters at the solution, H^-1 B H^-1."""
    # B is that of the scores. Filters make neighbours alike, by how much is known; where the
    # scores add up to more, as of noise that was not white before, deviations are widened (Newey
    # and West 1987). Poses are independent, and B is H.
    _, information, columns, pull = _gauss_newton(problem, theta, variance)
    size = np.sqrt(np.diag(information))
    scaled = np.linalg.inv(information / np.outer(size, size))
    inverse = scaled / np.outer(size, size)
    if len(problem.torque_lags) == 1:
        return np.asarray(excess * inverse)
    by_motion = problem.sensitivity(theta)
    weighted = np.linalg.solve(_noise(problem, by_motion, variance), columns)
    moved = np.einsum('nij,nip->npj', by_motion, weighted)
    scores = np.einsum('nip,ni->np', columns, pull)
    known, seen = information, scores.T @ scores
    lags = len(problem.torque_lags)
    for lag in range(1, lags):
        alike = np.einsum('npj,jk,nqk->pq', moved[:-lag], problem.motion_lags[lag], moved[lag:])
        torque = problem.torque_lags[lag] * variance
        alike += np.einsum('nip,i,niq->pq', weighted[:-lag], torque, weighted[lag:])
        known = known + alike + alike.T
        product = (1.0 - lag / lags) * scores[:-lag].T @ scores[lag:]
        seen = seen + product + product.T
    covariance = excess * inverse @ known @ inverse
    lasting = np.diag(inverse @ seen @ inverse) / np.diag(covariance)
    factor = np.sqrt(np.maximum(lasting, 1.0))
    return np.asarray(covariance * np.outer(factor, factor))
