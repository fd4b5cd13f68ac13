# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The accuracy of spring stiffnesses from poses, and the choice of the best poses.

With Gaussian noise of torques and angles, the variance of an unbiased estimate is at least the
inverse of the information (Cramer and Rao). The information of a pose depends on geometry alone,
so poses are chosen before they are measured.

"""

from __future__ import annotations

from armid_ros.errors import IdentificationError
from armid_ros.identification.ties.problem import InteractionProblem
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Iterations of the multiplicative algorithm, after which weights are accurate to some per cent.
_ROUNDS = 200


def stiffness_bound(
    problem: InteractionProblem, theta: FloatArray, torque_noise: npt.ArrayLike
) -> FloatArray:
    """
    Return the smallest possible standard deviations of stiffnesses, shape (S,) [N/m].

    Parameters
    ----------
    problem : InteractionProblem
        Regression of the motion without noise, with the expected noise of its angles.
    theta : ndarray, shape (P,)
        Stiffnesses and inertias.
    torque_noise : array_like, number or shape (n,)
        Standard deviation of the torques [N m].

    Raises
    ------
    IdentificationError
        If the poses do not determine every stiffness.

    """
    information = _information(problem, theta, torque_noise).sum(axis=0)
    inverse = _inverse(information)
    return np.asarray(np.sqrt(np.diag(inverse)[: len(problem.segments)]))


def choose_poses(
    problem: InteractionProblem, theta: FloatArray, torque_noise: npt.ArrayLike, count: int
) -> npt.NDArray[np.intp]:
    """
    Choose the poses that determine the stiffnesses best, in units of their standard deviations.

    The multiplicative algorithm (Silvey, Titterington and Torsney 1978) gives the weights of an
    optimal design; the poses with the largest weights are chosen.

    Parameters
    ----------
    problem : InteractionProblem
        Regression of all planned poses. A choice by measured angles would depend on their noise.
    theta : ndarray, shape (P,)
        Approximate stiffnesses and inertias; a factor of two does not matter.
    torque_noise : array_like, number or shape (n,)
        Expected standard deviation of the torques [N m].
    count : int
        Number of poses.

    Returns
    -------
    ndarray of int, shape (count,)
        Chosen samples of the problem, in their order.

    Raises
    ------
    IdentificationError
        If all poses together do not determine every stiffness.

    """
    each = _information(problem, theta, torque_noise)
    size = np.sqrt(np.diag(each.sum(axis=0)))
    each = each / np.outer(size, size)
    springs = len(problem.segments)
    weight = np.full(len(each), 1.0 / len(each))
    for _ in range(_ROUNDS):
        inverse = _inverse(np.einsum('n,npq->pq', weight, each))
        relative = inverse[:, :springs] / np.sqrt(np.diag(inverse)[:springs])
        weight = weight * np.sqrt(np.einsum('npq,pk,qk->n', each, relative, relative))
        weight = weight / weight.sum()
    return np.sort(np.argsort(-weight)[:count])


def _information(
    problem: InteractionProblem, theta: FloatArray, torque_noise: npt.ArrayLike
) -> FloatArray:
    """Return the information of each pose on all parameters, shape (N, P, P)."""
    variance = np.broadcast_to(np.asarray(torque_noise, dtype=float) ** 2, problem.tau.shape[1:])
    by_motion = problem.sensitivity(theta)
    covariance = by_motion @ problem.motion_noise @ by_motion.transpose(0, 2, 1)
    scaled = np.linalg.solve(covariance + np.diag(variance), problem.columns)
    return np.asarray(np.einsum('nip,niq->npq', problem.columns, scaled))


def _inverse(information: FloatArray) -> FloatArray:
    size = np.sqrt(np.diag(information))
    try:
        inverse = np.linalg.inv(information / np.outer(size, size))
    except np.linalg.LinAlgError:
        inverse = np.full_like(information, np.nan)
    if not np.all(np.diag(inverse) > 0.0):
        raise IdentificationError(
            'these poses do not tell every stiffness; let the pair move more'
        )
    return np.asarray(inverse / np.outer(size, size))
