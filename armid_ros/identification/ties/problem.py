# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Regression of the stiffness of springs between two machines: torques, columns and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from armid_ros.errors import IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.identification.rows.signals import Conditioning, decimate, decimated_samples
from armid_ros.model import (
    BaseParameters,
    group_columns,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    regressor,
    rigid_parameter_names,
)
from armid_ros.model.spring_ties import tie_columns_derivatives, tie_geometry, TiedMachines
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy import signal
import scipy.linalg

Inertias = Literal['known', 'free']
#: Arrays of a problem with one row per sample.
STACKED = ('tau', 'known', 'columns', 'known_by_motion', 'columns_by_motion')
#: Arrays of a problem that do not depend on its samples.
_COMMON = ('motion_lags', 'torque_lags', 'torque_noise', 'described', 'precision')


@dataclass(frozen=True)
class InteractionProblem:
    """
    Linear regression of torques on springs between two machines, tau = known + columns theta.

    Attributes
    ----------
    tau : ndarray, shape (N, n)
        Measured torques of the machine [N m].
    known : ndarray, shape (N, n)
        Torque of the rigid body if its inertias are known; zero if they are free [N m].
    columns : ndarray, shape (N, n, P)
        Columns of springs, then of combinations of inertias.
    known_by_motion : ndarray, shape (N, n, 3 J)
        Derivatives of `known` by position, velocity, acceleration of all J = n + m joints.
    columns_by_motion : ndarray, shape (N, n, P, 3 J)
        Derivatives of `columns` by the same quantities.
    motion_lags : ndarray, shape (1 + L, 3 J, 3 J)
        Covariances of errors of the motion by noisy angles, between a sample and itself or each
        of the L next samples; L is 0 if errors are independent.
    torque_lags : ndarray, shape (1 + L,)
        Correlations of the noise of torques between these samples.
    torque_noise : ndarray, shape (n,)
        Smallest standard deviation of the noise of filtered torques [N m].
    segments : tuple of str
        Names of the springs.
    spring_joints : tuple of str
        Joint that moves each spring; empty for all springs together.
    rigid : tuple of ParameterName
        Free combinations of inertias.
    described : ndarray, shape (P,)
        Prior parameters from the description of the machine; zero without a prior.
    precision : ndarray, shape (P, P)
        Precision of the prior. Without a prior, the parameters of columns that are hardly more
        than noise would grow, as any value explains the torques.
    rms_extension : float
        Root mean square extension of the springs [m].

    """

    tau: FloatArray
    known: FloatArray
    columns: FloatArray
    known_by_motion: FloatArray
    columns_by_motion: FloatArray
    motion_lags: FloatArray
    torque_lags: FloatArray
    torque_noise: FloatArray
    segments: tuple[str, ...]
    spring_joints: tuple[str, ...]
    rigid: tuple[ParameterName, ...]
    described: FloatArray
    precision: FloatArray
    rms_extension: float

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in (*STACKED, *_COMMON):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def motion_noise(self) -> FloatArray:
        """Covariance of errors of a sample's motion due to noisy angles, shape (3 J, 3 J)."""
        return np.asarray(self.motion_lags[0])

    @property
    def position_noise(self) -> FloatArray:
        """Standard deviation of the noise of the angles of both machines, shape (J,) [rad]."""
        variance = np.diag(self.motion_noise)
        return np.asarray(np.sqrt(variance[: len(variance) // 3]))

    def with_springs(self, kept: npt.NDArray[np.intp]) -> InteractionProblem:
        """Return the regression problem with only the springs at the indices `kept`."""
        columns = [*kept.tolist(), *range(len(self.segments), self.columns.shape[2])]
        return replace(
            self,
            columns=self.columns[:, :, columns],
            columns_by_motion=self.columns_by_motion[:, :, columns],
            described=self.described[columns],
            precision=self.precision[np.ix_(columns, columns)],
            segments=tuple(self.segments[k] for k in kept),
            spring_joints=tuple(self.spring_joints[k] for k in kept),
        )

    def residual(self, theta: FloatArray) -> FloatArray:
        """Return the residual torques, (N, n) [N m], for given parameters, (P,)."""
        return np.asarray(self.tau - self.known - self.columns @ theta)

    def sensitivity(self, theta: FloatArray) -> FloatArray:
        """Return derivatives of the modelled torques by q, dq and ddq, shape (N, n, 3 J)."""
        spring = np.einsum('nipj,p->nij', self.columns_by_motion, theta)
        return np.asarray(self.known_by_motion + spring)

    def deviation(self, theta: FloatArray) -> FloatArray:
        """Return the rms residual of each joint that noise alone causes, shape (n,) [N m]."""
        by_motion = self.sensitivity(theta)
        angles = np.sum(by_motion @ self.motion_noise * by_motion, axis=2)
        return np.asarray(np.sqrt(np.mean(angles, axis=0) + self.torque_noise**2))


def interaction_problem(
    machines: TiedMachines,
    motion: Motion,
    other_motion: Motion,
    *,
    noise: tuple[npt.ArrayLike, npt.ArrayLike] = (0.0, 0.0),
    used: Conditioning | None = None,
    inertias: Inertias = 'known',
    separate: bool = False,
    slack: float | FloatArray = 0.0,
) -> InteractionProblem:
    """
    Return the regression problem of spring stiffness, from motions of both machines.

    Parameters
    ----------
    machines : TiedMachines
        Both machines, with the positions of the springs.
    motion, other_motion : Motion
        Motions of both machines on one time base; ``motion`` with torques.
    noise : tuple of two array_like
        Standard deviation of the noise of the angles of both machines, a number or (n + m,) [rad],
        and smallest standard deviation of the noise of torques, a number or (n,) [N m].
    used : Conditioning, optional
        Filters that were applied to the positions, and that decimate torques and columns. By
        default, every sample counts and the angles are not filtered.
    inertias : {'known', 'free'}
        Whether the machine's inertias are taken from its description or estimated as well.
    separate : bool
        Whether every spring has its own stiffness, or all have the same.
    slack : float or ndarray, shape (S,)
        Slack of the springs before they pull [m].

    Raises
    ------
    IdentificationError
        If there are no torques or the time bases differ.

    """
    robot, other, ties = machines.robot, machines.other, machines.ties
    if motion.tau is None:
        raise IdentificationError(f'{robot.name}: the motion has no torques; record the effort')
    if len(motion) != len(other_motion) or np.max(np.abs(motion.t - other_motion.t)) > 1e-6:
        raise IdentificationError(
            f'the motions of {robot.name} and {other.name} differ in their times; interpolate one'
        )
    kept = np.array(decimated_samples(len(motion), used) if used else range(len(motion)))
    slow, far = motion.select(kept), other_motion.select(kept)
    geometry = tie_geometry(robot, motion.q, other, other_motion.q, ties)
    springs = geometry.pulled(slack)
    by_both = tie_columns_derivatives(robot, slow.q, other, far.q, ties, slack)
    count, base = slow.n_joints + far.n_joints, None
    springs_by = np.pad(np.concatenate(by_both, axis=3), ((0, 0),) * 3 + ((0, 2 * count),))
    if not separate:
        springs, springs_by = (x.sum(axis=2, keepdims=True) for x in (springs, springs_by))
    names = tuple(tie.name for tie in ties) if separate else ('all',)
    if inertias == 'known':
        known = inverse_dynamics(robot, motion)
        known_by = _placed(np.stack(inverse_dynamics_derivatives(robot, slow), axis=2), count)
        columns, columns_by, spread = springs, springs_by, np.zeros((0, 1))
    else:
        known, known_by = np.zeros_like(motion.q), np.zeros((*slow.q.shape, 3 * count))
        body, base = _free_inertias(robot, motion, springs, names)
        body_by = _placed(_regressor_by_motion(robot, slow, base.independent), count)
        columns = np.concatenate([springs, body], axis=2)
        columns_by = np.concatenate([springs_by, body_by], axis=2)
        spread = base.grouping * robot.described_spread.ravel()
    tau, alone = motion.tau, np.zeros(springs.shape[2])  # springs have no prior
    motion_lags, torque_lags = _filtered_noise(used)
    if used is not None:
        tau, known, columns = (decimate(values, used) for values in (tau, known, columns))
    deviation = np.broadcast_to(np.asarray(noise[0], dtype=float), (count,))
    return InteractionProblem(
        tau,
        known,
        columns,
        known_by,
        columns_by,
        np.asarray(np.kron(motion_lags, np.diag(deviation**2))),
        torque_lags / torque_lags[0],
        np.sqrt(torque_lags[0]) * np.broadcast_to(np.asarray(noise[1], float), tau.shape[1:]),
        names,
        tuple(tie.joint for tie in ties) if separate else ('',),
        base.parameters if base else (),
        np.concatenate([alone, base.values(robot.rigid_parameters)]) if base else alone,
        scipy.linalg.block_diag(np.diag(alone), np.linalg.inv(spread @ spread.T)),
        float(np.sqrt(np.mean(np.sum(geometry.way**2, axis=2)))),
    )


def _free_inertias(
    robot: Robot, motion: Motion, springs: FloatArray, names: Sequence[str]
) -> tuple[FloatArray, BaseParameters]:
    """Return the regressor columns of identifiable inertias, and their base parameters."""
    # remainder of a column, as a share of it, below which it is a combination of the others
    tolerance = 1e-6
    body = regressor(robot, motion)
    every = rigid_parameter_names(robot)
    base = group_columns(body.reshape(-1, body.shape[2]), every, tolerance)
    w = np.concatenate([body[:, :, base.independent], springs], axis=2)
    w = w.reshape(-1, w.shape[2])
    scale = np.linalg.norm(w, axis=0)
    scaled = w / np.where(scale > 0.0, scale, 1.0)
    left = np.abs(np.diag(np.linalg.qr(scaled, mode='r')))[base.rank :]
    if len(left) and left.min() < tolerance:
        spring = names[int(np.argmin(left))] if len(names) > 1 else 'all springs'
        raise IdentificationError(
            f'the stiffness of {spring} cannot be distinguished from weight and inertia along '
            'this motion; keep the inertias known, or record more motion'
        )
    return body[:, :, base.independent], base


def _filtered_noise(used: Conditioning | None) -> tuple[FloatArray, FloatArray]:
    """Return the covariances over lags of filtered unit noise: of motion, and of torques."""
    # number of samples over which errors are correlated after filtering
    n_lags = 6
    # Covariances of position, velocity, acceleration of a sample with itself and with later
    # samples, (1 + lags, 3, 3), and of torques, (1 + lags,). Columns change slowly compared with
    # the filter of the decimation, so they do not affect the noise that passes it.
    if used is None:
        return np.diag([1.0, 0.0, 0.0])[np.newaxis], np.ones(1)
    w = np.linspace(0.0, np.pi, 8001)
    sections = signal.butter(4, used.cutoff_hz, fs=used.rate_hz, output='sos')
    gain = np.abs(signal.sosfreqz(sections, w)[1]) ** 4
    gain = gain * np.abs(signal.freqz(used.taps, worN=w)[1]) ** 2
    result = np.empty((1 + n_lags, 3, 3))
    for lag, i, j in np.ndindex(result.shape):
        turned = np.cos(w * lag * used.decimation + (i + j) * np.pi / 2.0)
        result[lag, i, j] = (-1) ** i * np.mean(gain * (used.rate_hz * w) ** (i + j) * turned)
    taps = used.taps
    ends = [len(taps) - lag * used.decimation for lag in range(1 + n_lags)]
    return result, np.array([taps[:end] @ taps[-end:] if end > 0 else 0.0 for end in ends])


def _regressor_by_motion(robot: Robot, motion: Motion, kept: npt.NDArray[np.intp]) -> FloatArray:
    """Return derivatives of P regressor columns by q, dq and ddq, shape (N, n, P, 3, n)."""
    h = 1e-5  # step of the central differences [rad or m]
    n = motion.n_joints
    result = np.empty((len(motion), n, len(kept), 3, n))
    for order, name in enumerate(('q', 'dq', 'ddq')):
        for j, step in enumerate(h * np.eye(n)):
            at = getattr(motion, name)
            after = regressor(robot, replace(motion, **{name: at + step}))
            before = regressor(robot, replace(motion, **{name: at - step}))
            result[:, :, :, order, j] = (after - before)[:, :, kept] / (2.0 * h)
    return result


def _placed(by_own: FloatArray, count: int) -> FloatArray:
    """Return derivatives by the own motion, followed by zeros for the other machine's motion."""
    result = np.zeros((*by_own.shape[:-1], count))
    result[..., : by_own.shape[-1]] = by_own
    return result.reshape((*by_own.shape[:-2], 3 * count))
