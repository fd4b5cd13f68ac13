# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The regression of the springs between two machines: torques, columns, and what noise does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from armid_ros.effects.load import described_spread
from armid_ros.errors import IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.identification.rows.signals import Conditioning, decimate, decimated_samples
from armid_ros.model import (
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

#: A column is taken as a combination of the others if its remainder is below this share.
_RANK_TOLERANCE = 1e-6
#: Step of the central differences of rigid columns [rad or m].
_STEP = 1e-5

#: Samples over which errors may last after filtering.
_LAGS = 6

Inertias = Literal['known', 'free']
#: Arrays of a problem that have its samples first.
STACKED = ('tau', 'known', 'columns', 'known_by_motion', 'columns_by_motion')
#: The others.
_ALIKE = ('motion_lags', 'torque_lags', 'torque_noise', 'described', 'precision')


@dataclass(frozen=True)
class InteractionProblem:
    """
    tau = known + columns theta, and how it depends on the angles of both machines.

    Attributes
    ----------
    tau : ndarray, shape (N, n)
        Measured torques of the machine [N m].
    known : ndarray, shape (N, n)
        What the rigid body takes, where its inertias are known; zero where they are free.
    columns : ndarray, shape (N, n, P)
        Springs, then combinations of inertias.
    known_by_motion : ndarray, shape (N, n, 3 J)
        Derivatives by positions, velocities and accelerations of the J = n + m joints of both.
    columns_by_motion : ndarray, shape (N, n, P, 3 J)
        Derivatives by the same.
    motion_lags : ndarray, shape (1 + L, 3 J, 3 J)
        Covariances of what noisy angles make of positions, velocities and accelerations of a
        sample and of itself and the L next; none where errors are independent.
    torque_lags : ndarray, shape (1 + L,)
        Correlations of the noise of torques of the same.
    torque_noise : ndarray, shape (n,)
        Standard deviation that the torques have at least, as they are here [N m].
    segments : tuple of str
        Names of the springs.
    spring_joints : tuple of str
        The joint that moves each; empty for all at once.
    rigid : tuple of ParameterName
        The combinations of inertias that are free.
    described : ndarray, shape (P,)
        Parameters as the machine's description has them; zero where it says nothing.
    precision : ndarray, shape (P, P)
        How strongly it is believed. Of columns that are hardly more than noise any value explains
        the torques, the larger the better; it keeps them to what a body can have.
    typical_way : float
        How far springs are drawn out, root mean square [m].

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
    typical_way: float

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in (*STACKED, *_ALIKE):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def motion_noise(self) -> FloatArray:
        """Covariance of what noisy angles make of the motion of a sample, shape (3 J, 3 J)."""
        return np.asarray(self.motion_lags[0])

    @property
    def position_noise(self) -> FloatArray:
        """Return the standard deviation of the angles of both machines, shape (J,) [rad]."""
        variance = np.diag(self.motion_noise)
        return np.asarray(np.sqrt(variance[: len(variance) // 3]))

    def with_springs(self, kept: npt.NDArray[np.intp]) -> InteractionProblem:
        """Return the problem with some of its springs only."""
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
        """Return what is left of the torques, shape (N, n) [N m]."""
        return np.asarray(self.tau - self.known - self.columns @ theta)

    def sensitivity(self, theta: FloatArray) -> FloatArray:
        """Return the derivative of the model by the motion, shape (N, n, 3 J)."""
        spring = np.einsum('nipj,p->nij', self.columns_by_motion, theta)
        return np.asarray(self.known_by_motion + spring)

    def deviation(self, theta: FloatArray) -> FloatArray:
        """Return what noise gives the residuals, root mean square, shape (n,) [N m]."""
        by_motion = self.sensitivity(theta)
        angles = np.sum(by_motion @ self.motion_noise * by_motion, axis=2)
        return np.asarray(np.sqrt(np.mean(angles, axis=0) + self.torque_noise**2))


@dataclass(frozen=True)
class MachineNoise:
    """
    What sensors add to the truth.

    Attributes
    ----------
    position : array_like, number or shape (n + m,)
        Standard deviation of the angles of both machines [rad].
    torque : array_like, number or shape (n,)
        Standard deviation that the torques have at least [N m].

    """

    position: npt.ArrayLike = 0.0
    torque: npt.ArrayLike = 0.0


def interaction_problem(
    machines: TiedMachines,
    motion: Motion,
    other_motion: Motion,
    *,
    noise: MachineNoise | None = None,
    used: Conditioning | None = None,
    inertias: Inertias = 'known',
    separate: bool = False,
    slack: float | FloatArray = 0.0,
) -> InteractionProblem:
    """
    Set up the regression on motions of both machines.

    Parameters
    ----------
    machines : TiedMachines
        Both, and where the springs are.
    motion, other_motion : Motion
        On one time base; ``motion`` with torques.
    noise : MachineNoise, optional
        What sensors add; nothing by default.
    used : Conditioning, optional
        The filters that the positions went through, and by which torques and columns are to be
        decimated. By default every sample counts and noise is in the angles alone.
    inertias : {'known', 'free'}
        Whether the machine's inertias are those of its description or are estimated as well.
    separate : bool
        Whether every spring has a stiffness of its own, or all have one.
    slack : float or ndarray, shape (S,)
        Way that the springs give before they pull [m].

    Raises
    ------
    IdentificationError
        If there are no torques or the time bases differ.

    """
    robot, other, ties = machines.robot, machines.other, machines.ties
    if motion.tau is None:
        raise IdentificationError(f'{robot.name}: no torques; the stiffness is in them alone')
    if len(motion) != len(other_motion) or np.max(np.abs(motion.t - other_motion.t)) > 1e-6:
        raise IdentificationError(
            f'{robot.name} and {other.name}: their motions have to be on one time base'
        )
    kept = np.array(decimated_samples(len(motion), used) if used else range(len(motion)))
    slow, far = motion.select(kept), other_motion.select(kept)
    geometry = tie_geometry(robot, motion.q, other, other_motion.q, ties)
    springs = geometry.pulled(slack)
    by_both = tie_columns_derivatives(robot, slow.q, other, far.q, ties, slack)
    by_angles = np.concatenate(by_both, axis=3)
    springs_by = np.concatenate([by_angles, np.zeros_like(by_angles), np.zeros_like(by_angles)], 3)
    if not separate:
        springs, springs_by = (x.sum(axis=2, keepdims=True) for x in (springs, springs_by))
    names = tuple(tie.name for tie in ties) if separate else ('all',)
    count = springs_by.shape[3] // 3
    if inertias == 'known':
        by = np.stack(inverse_dynamics_derivatives(robot, slow), axis=2)
        body = _Body(inverse_dynamics(robot, motion), _placed(by, count))
    else:
        body = _free_body(
            robot, motion, slow, springs, count, names if separate else ('the springs',)
        )
    columns, columns_by = body.beside(springs, springs_by)
    tau, known = motion.tau, body.known
    passed, left = np.diag([1.0, 0.0, 0.0])[np.newaxis], np.ones(1)
    if used is not None:
        tau, known, columns = (decimate(values, used) for values in (tau, known, columns))
        passed, left = _passed(used)
    noise = noise or MachineNoise()
    deviation = np.broadcast_to(np.asarray(noise.position, dtype=float), (count,))
    return InteractionProblem(
        tau,
        known,
        columns,
        body.known_by,
        columns_by,
        np.asarray(np.kron(passed, np.diag(deviation**2))),
        left / left[0],
        np.sqrt(left[0]) * np.broadcast_to(np.asarray(noise.torque, float), tau.shape[1:]),
        names,
        tuple(tie.joint for tie in ties) if separate else ('',),
        body.parameters,
        np.concatenate([np.zeros(springs.shape[2]), body.described]),
        scipy.linalg.block_diag(np.zeros((springs.shape[2],) * 2), body.precision),
        float(np.sqrt(np.mean(np.sum(geometry.way**2, axis=2)))),
    )


@dataclass(frozen=True)
class _Body:
    """
    What the rigid body is in a problem: torque that is known, or columns of free inertias.

    Attributes are those of an InteractionProblem, without its springs.

    """

    known: FloatArray
    known_by: FloatArray
    columns: FloatArray | None = None
    columns_by: FloatArray | None = None
    parameters: tuple[ParameterName, ...] = ()
    described: FloatArray = field(default_factory=lambda: np.zeros(0))
    precision: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def beside(self, springs: FloatArray, springs_by: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the columns of springs and body, and their derivatives."""
        if self.columns is None or self.columns_by is None:
            return springs, springs_by
        columns = np.concatenate([springs, self.columns], axis=2)
        return columns, np.concatenate([springs_by, self.columns_by], axis=2)


def _free_body(
    robot: Robot,
    motion: Motion,
    slow: Motion,
    springs: FloatArray,
    count: int,
    names: Sequence[str],
) -> _Body:
    """Return the inertial columns that are identifiable with the springs, and the prior."""
    body = regressor(robot, motion)
    every = rigid_parameter_names(robot)
    base = group_columns(body.reshape(-1, body.shape[2]), every, _RANK_TOLERANCE)
    w = np.concatenate([body[:, :, base.independent], springs], axis=2)
    w = w.reshape(-1, w.shape[2])
    scale = np.linalg.norm(w, axis=0)
    scaled = w / np.where(scale > 0.0, scale, 1.0)
    left = np.abs(np.diag(np.linalg.qr(scaled, mode='r')))[base.rank :]
    if len(left) and left.min() < _RANK_TOLERANCE:
        raise IdentificationError(
            f'{names[int(np.argmin(left))]}: its stiffness cannot be distinguished from weight '
            'and inertia along this motion; keep the inertias known, or move more'
        )
    spread = base.grouping * described_spread(robot).ravel()
    return _Body(
        np.zeros_like(motion.q),
        np.zeros((*slow.q.shape, 3 * count)),
        body[:, :, base.independent],
        _placed(_regressor_by_motion(robot, slow, base.independent), count),
        base.parameters,
        base.values(robot.rigid_parameters),
        np.asarray(np.linalg.inv(spread @ spread.T)),
    )


def _passed(used: Conditioning) -> tuple[FloatArray, FloatArray]:
    """Return what filters leave of white noise of positions and of torques, of rows and lags."""
    # of position, velocity, acceleration of a row with itself and with later ones, shape
    # (1 + lags, 3, 3), and of torques, (1 + lags,). Columns change slowly compared with the filter
    # of the decimation, so noise passes it as if it were alone
    w = np.linspace(0.0, np.pi, 8001)
    sections = signal.butter(4, used.cutoff_hz, fs=used.rate_hz, output='sos')
    gain = np.abs(signal.sosfreqz(sections, w)[1]) ** 4
    gain = gain * np.abs(signal.freqz(used.taps(), worN=w)[1]) ** 2
    result = np.empty((1 + _LAGS, 3, 3))
    for lag, i, j in np.ndindex(result.shape):
        turned = np.cos(w * lag * used.decimation + (i + j) * np.pi / 2.0)
        result[lag, i, j] = (-1) ** i * np.mean(gain * (used.rate_hz * w) ** (i + j) * turned)
    taps = used.taps()
    ends = [len(taps) - lag * used.decimation for lag in range(1 + _LAGS)]
    return result, np.array([taps[:end] @ taps[-end:] if end > 0 else 0.0 for end in ends])


def _regressor_by_motion(robot: Robot, motion: Motion, kept: npt.NDArray[np.intp]) -> FloatArray:
    """Return the derivatives of some rigid columns, shape (N, n, P, 3, n)."""
    n = motion.n_joints
    result = np.empty((len(motion), n, len(kept), 3, n))
    for order, name in enumerate(('q', 'dq', 'ddq')):
        for j, step in enumerate(_STEP * np.eye(n)):
            at = getattr(motion, name)
            after = regressor(robot, replace(motion, **{name: at + step}))
            before = regressor(robot, replace(motion, **{name: at - step}))
            result[:, :, :, order, j] = (after - before)[:, :, kept] / (2.0 * _STEP)
    return result


def _placed(by_own: FloatArray, count: int) -> FloatArray:
    """Spread derivatives by the machine's motion, shape (..., 3, n), over both: (..., 3 J)."""
    result = np.zeros((*by_own.shape[:-1], count))
    result[..., : by_own.shape[-1]] = by_own
    return result.reshape((*by_own.shape[:-2], 3 * count))
