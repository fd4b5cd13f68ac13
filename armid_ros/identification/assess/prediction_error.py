# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How well an arm predicts a recording.

Friction, offset and drive inertia of every joint are fitted. The body is that of the description,
and blocks of the recording take turns at being fitted and being predicted; or it is the best of
those that the description may mean.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.effects.load import described_spread
from armid_ros.identification.assess.grade_limits import FREEDOM, LIMITS
from armid_ros.identification.fitting.triangle import within
from armid_ros.model import regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Blocks of a recording, of which every other one is fitted.
_BLOCKS = 10
#: Columns of each joint's own: offset, viscous and Coulomb friction, drive inertia.
_OWN = 4
#: A joint below this share of its top speed may be held by its friction.
_SLOW = 0.05
#: Fits of what joints share: the first tells how much each leaves.
_PASSES = 4


@dataclass(frozen=True)
class PredictionError:
    """
    Prediction error of the torque.

    Attributes
    ----------
    joints : ndarray, shape (n,)
        Of each joint, as a share of its torque.
    torque : ndarray, shape (n,)
        Root mean square torque of each joint [N m or N].
    shared : ndarray, shape (k,)
        Values that all joints share, fitted to all blocks.
    off : float
        Sum of squares of what the body is off by from that of the description, in deviations.

    """

    joints: FloatArray
    torque: FloatArray
    shared: FloatArray
    off: float = 0.0

    def whole(self, robot: Robot) -> float:
        """Return the error of all slides or of all other joints together, whichever is more."""
        alike = [robot.prismatic, ~robot.prismatic]
        left = self.joints * self.torque
        return max(
            float(np.linalg.norm(left[own]) / np.linalg.norm(self.torque[own]))
            for own in alike
            if np.any(own)
        )

    def gain(self, better: PredictionError) -> float:
        """
        Return the factor by which errors are larger than others, of all joints together.

        It is the likelihood ratio of two models with unknown noise, per sample, times that of
        their bodies by the description, per independent value of a recording. Errors below the
        floor and above the torque itself count as that much.

        """
        return self.of_data(better) * float(np.exp((self.off - better.off) / (2.0 * FREEDOM)))

    def of_data(self, better: PredictionError) -> float:
        """Return that factor without the likelihood of the bodies."""
        return float(np.prod(self._counted() / better._counted()))

    def least(self, other: PredictionError) -> PredictionError:
        """Return the smaller error of every joint."""
        joints = np.minimum(self.joints, other.joints)
        return PredictionError(joints, self.torque, np.empty(0))

    def best_gain(self) -> float:
        """Return the largest gain that anything could have."""
        return float(np.prod(self._counted() / LIMITS.floor))

    def _counted(self) -> FloatArray:
        return np.clip(self.joints, LIMITS.floor, 1.0)


def thinned(stretches: Sequence[Motion], rows: int) -> Motion | None:
    """Put stretches with torques one after the other, and keep about so many of the samples."""
    parts = [motion for motion in stretches if motion.tau is not None and len(motion) > 2]
    if not parts:
        return None
    names = ('t', 'q', 'dq', 'ddq', 'tau')
    arrays = [np.concatenate([getattr(part, name) for part in parts]) for name in names]
    step = max(1, len(arrays[0]) // rows)
    return Motion(parts[0].joints, *(array[::step] for array in arrays))


def described_error(motion: Motion, fixed: FloatArray, columns: FloatArray) -> PredictionError:
    """
    Predict with the body of the description.

    Parameters
    ----------
    motion : Motion
        N samples with torque.
    fixed : ndarray, shape (N, n)
        Torque that is known [N m].
    columns : ndarray, shape (N, n, k)
        What k values that all joints share are multiplied by.

    """
    assert motion.tau is not None
    scale, weight = _scale(motion.tau), _weight(motion)
    rest = (motion.tau - fixed) / scale * weight
    shared = columns * (weight / scale)[:, :, np.newaxis]
    own = np.stack([_own_columns(motion, joint) for joint in range(motion.n_joints)])
    own *= weight.T[:, :, np.newaxis]
    left = np.empty_like(rest)
    for fitted in _folds(len(motion)):
        values = _shared_values(own, rest, shared, fitted)
        error = rest - shared @ values
        left[~fitted] = _left(own[:, :, np.newaxis], error.T[:, :, np.newaxis], fitted)[:, :, 0].T
    everything = np.ones(len(motion), dtype=bool)
    return _error(left, scale, _shared_values(own, rest, shared, everything))


def nearest_error(robot: Robot, motion: Motion) -> PredictionError:
    """
    Return what the likeliest of the bodies that a description may mean leaves of all blocks.

    Parameters of a description are off by a uniform density as wide as they may be, errors are
    those of a good identification, and a recording has few independent values of them. Friction
    and the inertia of a drive are not below zero: they explain no torque of the opposite sign.

    """
    assert motion.tau is not None
    count, n = motion.q.shape
    scale, weight = _scale(motion.tau), _weight(motion)
    body = regressor(robot, motion)
    rest = (motion.tau - body @ robot.rigid_parameters) / scale * weight
    deviation = described_spread(robot).ravel() / np.sqrt(3.0)
    own = np.zeros((count, n, n, _OWN))
    for joint in range(n):
        own[:, joint, joint] = _own_columns(motion, joint)
    by_body = body * deviation * np.sqrt(FREEDOM / count) / scale[:, np.newaxis]
    columns = np.concatenate([by_body, own.reshape(count, n, -1)], axis=2)
    stacked = (columns * weight[:, :, np.newaxis]).reshape(-1, columns.shape[2])
    normal = stacked.T @ stacked + LIMITS.floor**2 * np.eye(stacked.shape[1])
    least = np.full(stacked.shape[1], -np.inf)
    least[len(deviation) :].reshape(n, _OWN)[:, 1:] = 0.0
    free = np.asarray(np.linalg.solve(normal, stacked.T @ rest.ravel()))
    factor = np.asarray(np.linalg.cholesky(normal).T)
    values = within(free, factor, (least, np.full(len(free), np.inf)))
    found = _error(rest - (stacked @ values).reshape(rest.shape), scale, np.empty(0))
    off = float(np.sum(values[: len(deviation)] ** 2)) * FREEDOM / count
    return replace(found, off=off)


def left_of_blocks(columns: FloatArray, rest: FloatArray) -> FloatArray:
    """
    Return what is left of rows where blocks take turns at being fitted and being predicted.

    Parameters
    ----------
    columns : ndarray, shape (N, n, k)
        Of mean square one, what values are multiplied by.
    rest : ndarray, shape (N, n)
        What is fitted, as a share of the torque of each joint.

    Returns
    -------
    ndarray, shape (N, n)

    """
    left = np.empty_like(rest)
    for fitted in _folds(len(rest)):
        left[~fitted] = _left(columns[np.newaxis], rest[np.newaxis], fitted)[0]
    return left


def _left(columns: FloatArray, rest: FloatArray, fitted: npt.NDArray[np.bool_]) -> FloatArray:
    """
    Return what a fit to some rows, values held as by a residual at the floor, leaves of others.

    A row whose prediction is less sure than a measurement of it (leverage above one, Hoaglin and
    Welsch 1978) stays as described: a joint that is jogged alone may rest in all that was fitted.

    Parameters
    ----------
    columns : ndarray, shape (P, N, m, k)
        Of P problems.
    rest : ndarray, shape (P, N, m)
        What is fitted.
    fitted : ndarray of bool, shape (N,)
        Rows that are.

    """
    count, _, _, size = columns.shape
    own, others = (columns[:, rows].reshape(count, -1, size) for rows in (fitted, ~fitted))
    turned = own.transpose(0, 2, 1)
    normal = turned @ own + LIMITS.floor**2 * np.eye(size)
    values = np.linalg.solve(normal, turned @ rest[:, fitted].reshape(count, -1, 1))
    spread = np.linalg.solve(normal, others.transpose(0, 2, 1)).transpose(0, 2, 1)
    told = np.sum(others * spread, axis=-1) <= 1.0
    predicted = np.where(told, (others @ values)[:, :, 0], 0.0)
    wanted = rest[:, ~fitted]
    return np.asarray(wanted - predicted.reshape(wanted.shape))


def _shared_values(
    own: FloatArray, rest: FloatArray, shared: FloatArray, fitted: npt.NDArray[np.bool_]
) -> FloatArray:
    """Fit what joints share, with what each has of its own taken out (Frisch and Waugh 1933)."""
    # Joints count by what they leave, down to the floor: one whose friction is another than what
    # is fitted to it tells little of what all have in common.
    if shared.shape[2] == 0:
        return np.empty(0)
    both = np.concatenate([shared[fitted], rest[fitted, :, np.newaxis]], axis=2)
    both = both.transpose(1, 0, 2)
    basis, told, _ = np.linalg.svd(own[:, fitted], full_matrices=False)
    basis = basis * (told > 1e-9 * told[:, :1])[:, np.newaxis]
    both -= basis @ (basis.transpose(0, 2, 1) @ both)
    values, size = np.empty(0), np.ones(len(both))
    for _ in range(_PASSES):
        stacked = (both / size[:, np.newaxis, np.newaxis]).reshape(-1, both.shape[2])
        values = np.asarray(np.linalg.lstsq(stacked[:, :-1], stacked[:, -1], rcond=None)[0])
        left = both[:, :, -1] - both[:, :, :-1] @ values
        size = np.maximum(np.sqrt(np.mean(left**2, axis=1)), LIMITS.floor)
    return values


def _own_columns(motion: Motion, joint: int) -> FloatArray:
    dq, ddq = motion.dq[:, joint], motion.ddq[:, joint]
    columns = np.column_stack([np.ones(len(dq)), dq, np.sign(dq), ddq])
    return columns / _scale(columns)


def _weight(motion: Motion) -> FloatArray:
    """Return weights of rows, shape (N, n), of mean square one."""
    # They are zero where a joint rests or turns round. Dry friction is any torque there: a bristle
    # that gives way before it slips looks like a torque that comes late.
    speed = np.abs(motion.dq)
    moves = speed > _SLOW * speed.max(axis=0)
    moves[:, ~moves.any(axis=0)] = True
    return np.asarray(moves / np.sqrt(moves.mean(axis=0)))


def _folds(count: int) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    even = (np.arange(count) * _BLOCKS // count) % 2 == 0
    return even, ~even


def _scale(columns: FloatArray) -> FloatArray:
    """Return the root mean square of every column; one where there is none."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    return np.where(size > 0.0, size, 1.0)


def _error(left: FloatArray, scale: FloatArray, shared: FloatArray) -> PredictionError:
    return PredictionError(np.sqrt(np.mean(left**2, axis=0)), scale, shared)
