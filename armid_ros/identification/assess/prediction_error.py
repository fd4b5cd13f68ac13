# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torque prediction error of an arm model for a recording.

Friction, offset and drive inertia of every joint are fitted. The links have the described
parameters, or the most likely ones near them.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.identification.assess.grade_limits import FREEDOM, LIMITS
from armid_ros.identification.fitting.identifiability import near_deviation
from armid_ros.identification.fitting.least_squares import within_bounds
from armid_ros.identification.rows.checks import joined, SLOW_SHARE
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
from scipy.optimize import nnls
from scipy.stats import t as student

#: Number of columns of each joint: offset, viscous and Coulomb friction, drive inertia.
_N_OWN = 4


@dataclass(frozen=True)
class PredictionError:
    """
    Torque prediction error of each joint of an arm.

    Attributes
    ----------
    joints : ndarray, shape (n,)
        Error of each joint, as a share of its torque.
    torque : ndarray, shape (n,)
        Root mean square torque of each joint [N m or N].
    off : float
        Squared distance of the link parameters from the description, in prior standard deviations.

    """

    joints: FloatArray
    torque: FloatArray
    off: float = 0.0

    def overall(self, robot: Robot) -> float:
        """Return the larger of two relative torque errors: of prismatic and of revolute joints."""
        residual = self.joints * self.torque
        return max(
            float(np.linalg.norm(residual[own]) / np.linalg.norm(self.torque[own]))
            for own in (robot.prismatic, ~robot.prismatic)
            if np.any(own)
        )

    def gain(self, better: PredictionError) -> float:
        """
        Return the likelihood ratio of `better` to this prediction, per independent sample.

        The likelihood ratio of models with unknown noise is multiplied by the ratio of the
        priors of their links. Errors are limited to the range from the floor to the torque itself.

        """
        return self.of_data(better) * float(np.exp((self.off - better.off) / (2.0 * FREEDOM)))

    def of_data(self, better: PredictionError) -> float:
        """Return the likelihood ratio as `gain` does, but without priors on the links."""
        before, after = (np.clip(x.joints, LIMITS.floor, 1.0) for x in (self, better))
        return float(np.prod(before / after))


def thinned(stretches: Sequence[Motion], rows: int) -> Motion | None:
    """Return about `rows` evenly spaced samples of motions; None if no motion has torques."""
    parts = [motion for motion in stretches if motion.tau is not None and len(motion) > 2]
    if not parts:
        return None
    motion = joined(parts)
    return motion.select(slice(None, None, max(1, len(motion) // rows)))


def prediction_error(robot: Robot, motion: Motion, *, near: bool) -> PredictionError:
    """
    Return torque errors after a fit of each joint's friction, offset and drive inertia.

    Friction and drive inertia are bounded below by zero, so they cannot explain a torque of the
    opposite sign.

    Parameters
    ----------
    robot : Robot
        Robot of the description.
    motion : Motion
        N samples with torque.
    near : bool
        Whether the links are fitted too. The prior of its parameters is a uniform density over
        their possible errors; residuals are those of a good identification, with few independent
        values in a recording.

    """
    assert motion.tau is not None
    scale, (own, weight) = root_mean_square(motion.tau), _friction_columns(motion)
    if not near:
        residual = (motion.tau - inverse_dynamics(robot, motion)) / scale * weight
        # an offset is the difference of two nonnegative values
        columns = np.concatenate([-own[:, :, :1], own], axis=2)
        prior = LIMITS.floor * np.eye(columns.shape[2])
        for joint, rows in enumerate(columns.transpose(1, 0, 2)):
            target = np.append(residual[:, joint], np.zeros(len(prior)))
            residual[:, joint] -= rows @ nnls(np.concatenate([rows, prior]), target)[0]
        return PredictionError(np.sqrt(np.mean(residual**2, axis=0)), scale)
    (count, n), joints = motion.q.shape, np.arange(motion.n_joints)
    body = regressor(robot, motion)
    target_torque = (motion.tau - body @ robot.rigid_parameters) / scale * weight
    by_body = body * (near_deviation(robot) * np.sqrt(FREEDOM / count))
    by_body *= (weight / scale)[:, :, np.newaxis]
    bodies = by_body.shape[2]
    of_joints = np.zeros((count, n, n, _N_OWN))
    of_joints[:, joints, joints] = own
    stacked = np.concatenate([by_body, of_joints.reshape(count, n, -1)], axis=2)
    stacked = stacked.reshape(count * n, -1)
    normal = stacked.T @ stacked + LIMITS.floor**2 * np.eye(stacked.shape[1])
    least = np.full(stacked.shape[1], -np.inf)
    least[bodies:].reshape(n, _N_OWN)[:, 1:] = 0.0
    free = np.asarray(np.linalg.solve(normal, stacked.T @ target_torque.ravel()))
    factor = np.asarray(np.linalg.cholesky(normal).T)
    values = within_bounds(free, factor, (least, np.full(len(free), np.inf)))
    residual = target_torque - (stacked @ values).reshape(target_torque.shape)
    off = float(np.sum(values[:bodies] ** 2)) * FREEDOM / count
    return PredictionError(np.sqrt(np.mean(residual**2, axis=0)), scale, off)


def common_values(motion: Motion, fixed: FloatArray, columns: FloatArray) -> FloatArray:
    """
    Return parameters that all joints share, such as gravity, fitted together with friction.

    The motion has N samples with torque, of which `fixed`, (N, n) [N m or N], is known. The
    regressor of the k values has shape (N, n, k). Returns the values, (k,).

    """
    assert motion.tau is not None
    own, weight = _friction_columns(motion)
    target_torque = (motion.tau - fixed)[:, :, np.newaxis]
    scale = root_mean_square(motion.tau)[:, np.newaxis]
    both = np.concatenate([columns, target_torque], axis=2) / scale * weight[:, :, np.newaxis]
    return shared_values(own.transpose(1, 0, 2), both.transpose(1, 0, 2))[0]


def shared_values(
    own: FloatArray, shared: FloatArray, near: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """
    Return fitted parameters that all joints share, and the half-widths of their intervals.

    Columns of single joints are projected out (Frisch and Waugh 1933). Joints are weighted by
    their residuals, down to the floor. The interval allows for residuals that are correlated in
    time or within a joint (Liang and Zeger 1986): scores are summed over blocks of the recording
    or over joints; the sums with the larger variance are used.

    Parameters
    ----------
    own : ndarray, shape (n, M, k)
        Own columns of each joint, with a mean square of about one.
    shared : ndarray, shape (n, M, c + 1)
        Columns of the c values, and the torque that they explain, as shares of the torque.
    near : ndarray, shape (n, M, b), optional
        Columns of bodies near the description, in prior deviations.

    Returns
    -------
    values, half_width : ndarray, shape (c,)
        The values, and the half-widths of their 95 % intervals.

    """
    # number of blocks of a recording whose scores give the deviation; nine degrees of freedom
    n_blocks = 10
    n, rows, bodies = len(own), own.shape[1], 0 if near is None else near.shape[2]
    both = shared if near is None else np.concatenate([near, shared], axis=2)
    turned = own.transpose(0, 2, 1)
    normal = turned @ own + LIMITS.floor**2 * np.eye(own.shape[2])
    both = both - own @ np.linalg.solve(normal, turned @ both)
    prior = np.diag((np.arange(both.shape[2] - 1) < bodies) * rows / FREEDOM)
    values, inverse, size = np.empty(0), prior, np.ones(n)
    columns, residual = both[:, :, :-1], both[:, :, -1]
    # the residuals of one pass give the weights of the next
    for _ in range(4):
        columns, target = (one / size[:, None, None] for one in (both[:, :, :-1], both[:, :, -1:]))
        stacked = columns.reshape(n * rows, -1)
        inverse = np.linalg.pinv(stacked.T @ stacked + prior, 1e-12, hermitian=True)
        values = inverse @ (stacked.T @ target.ravel())
        residual = target[:, :, 0] - columns @ values
        size = np.maximum(size * np.sqrt(np.mean(residual**2, axis=1)), LIMITS.floor)
    scores = (columns * residual[:, :, np.newaxis]) @ inverse
    blocks = np.stack([part.sum(axis=(0, 1)) for part in np.array_split(scores, n_blocks, axis=1)])
    # standard deviation of the total of several sums; zero if there is only one
    spreads = [
        np.sqrt(np.sum(sums**2, axis=0) * len(sums) / max(len(sums) - 1, 1))
        for sums in (blocks, scores.sum(axis=1))
    ]
    half = student.ppf(0.975, n_blocks - 1) * np.max(spreads, axis=0)
    return values[bodies:], half[bodies:]


def root_mean_square(columns: FloatArray) -> FloatArray:
    """Return the root mean square of each column; 1 for a column of zeros."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    return np.where(size > 0.0, size, 1.0)


def _friction_columns(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Return each joint's weighted regressor of friction, (N, n, 4), and the weights, (N, n)."""
    dq, ddq = motion.dq, motion.ddq
    columns = np.stack([np.ones_like(dq), dq, np.sign(dq), ddq], axis=-1)
    # Weights are zero where a joint rests or reverses: dry friction is arbitrary there, and
    # presliding looks like a delayed torque.
    speed = np.abs(dq)
    moves = speed > SLOW_SHARE * speed.max(axis=0)
    moves[:, ~moves.any(axis=0)] = True
    weight = moves / np.sqrt(moves.mean(axis=0))
    return columns / root_mean_square(columns) * weight[:, :, np.newaxis], weight
