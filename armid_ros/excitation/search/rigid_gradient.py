# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The rigid-body regressor of all samples at once, and its gradient in reverse.

A criterion is a number that depends on the regressor Y(q, dq, ddq). Given what it changes by with
every entry of Y, ``pullback`` says what it changes by with q, dq and ddq, at the cost of about
one more regressor. Notation and derivation: docs/excitation.md, 'The gradient'.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.excitation.geometry.pose import (
    carried_by,
    cross,
    force_cross,
    hat,
    motion_cross,
    Pose,
)
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

#: Index pairs of Ixx, Ixy, Iyy, Ixz, Iyz, Izz in the inertia matrix, Pinocchio's order.
_INERTIA = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
_BASIS = np.zeros((6, 3, 3))
for _number, (_row, _column) in enumerate(_INERTIA):
    _BASIS[_number, _row, _column] = _BASIS[_number, _column, _row] = 1.0


@dataclass(frozen=True)
class RigidRegressor:
    """
    The regressor of N samples, with what its gradient needs.

    Attributes
    ----------
    carries : ndarray, shape (n, n)
        See `carried_by`.
    pose : Pose
        Where its joints are.
    velocity, acceleration : ndarray, shape (N, n, 6)
        Spatial motion of the bodies in the world; the acceleration is that against free fall.
    local_velocity, local_acceleration : ndarray, shape (N, n, 6)
        The same in the body frames.
    local_axes : ndarray, shape (N, n, n, 6)
        [k, i, j]: axis of joint j in the frame of body i; zero unless j carries i.
    bodies : ndarray, shape (N, n, 6, 10)
        Force on each body, per inertial parameter, in its frame.

    """

    carries: FloatArray
    pose: Pose
    velocity: FloatArray
    acceleration: FloatArray
    local_velocity: FloatArray
    local_acceleration: FloatArray
    local_axes: FloatArray
    bodies: FloatArray

    @classmethod
    def of(cls, robot: Robot, motion: Motion) -> RigidRegressor:
        """Evaluate along a motion of N samples."""
        pose, dq, ddq = Pose.of(robot, motion.q), motion.dq, motion.ddq
        axes, carries = pose.axes, carried_by(robot)
        velocity = np.einsum('mi,kmc->kic', carries, axes * dq[..., np.newaxis])
        drive = axes * ddq[..., np.newaxis]
        drive += motion_cross(velocity, axes) * dq[..., np.newaxis]
        acceleration = np.einsum('mi,kmc->kic', carries, drive)
        acceleration[..., :3] -= robot.gravity
        count, n = dq.shape
        spread = np.broadcast_to(axes[:, np.newaxis], (count, n, n, 6))
        local_axes = pose.to_body(spread) * carries.T[:, :, np.newaxis]
        local_velocity, local_acceleration = pose.to_body(velocity), pose.to_body(acceleration)
        bodies = _body_regressor(local_velocity, local_acceleration)
        return cls(
            carries,
            pose,
            velocity,
            acceleration,
            local_velocity,
            local_acceleration,
            local_axes,
            bodies,
        )

    def matrix(self) -> FloatArray:
        """Return Y, shape (N, n, 10 n)."""
        count, n = self.velocity.shape[:2]
        y = self.local_axes @ self.bodies  # [k, i, j, c]
        return np.ascontiguousarray(y.transpose(0, 2, 1, 3)).reshape(count, n, 10 * n)

    def pullback(self, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Differentiate sum over all entries of weights * Y.

        Parameters
        ----------
        weights : ndarray, shape (N, n, 10 n)
            Derivative of some number by the entries of Y.

        Returns
        -------
        by_q, by_dq, by_ddq : ndarray, shape (N, n)
            Derivative of that number by the samples.

        """
        carries, axes, velocity = self.carries, self.pose.axes, self.velocity
        count, n = velocity.shape[:2]
        by_body = weights.reshape(count, n, n, 10).transpose(0, 2, 1, 3)  # [k, i, j, c]
        by_body = by_body * carries.T[:, :, np.newaxis]
        # [k, i, c]: combination of joint axes that each parameter's force is projected on
        projection = np.swapaxes(by_body, -1, -2) @ self.local_axes
        by_velocity, by_acceleration = _body_pullback(
            projection, self.local_velocity, self.local_acceleration
        )
        by_velocity = self.pose.from_body_force(by_velocity)
        by_acceleration = self.pose.from_body_force(by_acceleration)
        by_axes = self.pose.from_body_force(by_body @ np.swapaxes(self.bodies, -1, -2))

        def beyond(values: FloatArray) -> FloatArray:
            """Sum over the bodies that each joint carries."""
            return np.asarray(np.einsum('mi,kic->kmc', carries, values))

        total_v, total_a = beyond(by_velocity), beyond(by_acceleration)
        bent = beyond(force_cross(velocity, by_acceleration))
        turned_v = motion_cross(axes, velocity)
        turned_a = motion_cross(axes, self.acceleration)
        by_q = -_dot(total_v, turned_v) - _dot(bent, turned_v)
        by_q += _dot(total_a, motion_cross(turned_v, velocity) - turned_a)
        # [k, m, j]: derivative by the axis of j as body m and those beyond it see it
        seen = np.einsum('mi,kijc->kmjc', carries, by_axes)
        before = (carries - np.eye(n)).T[:, :, np.newaxis]  # j carries m, j is not m
        across = motion_cross(axes[:, :, np.newaxis], axes[:, np.newaxis])  # S_m x S_j
        by_q -= np.einsum('kmjc,kmjc->km', seen * before, across)
        by_dq = _dot(total_v, axes) + _dot(bent, axes) - 2.0 * _dot(total_a, turned_v)
        return by_q, by_dq, _dot(total_a, axes)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum('kmc,kmc->km', a, b))


def _body_regressor(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Force on a body per inertial parameter, shape (..., 6, 10), all in its own frame."""
    v, omega = velocity[..., :3], velocity[..., 3:]
    a, alpha = acceleration[..., :3], acceleration[..., 3:]
    d = a + cross(omega, v)
    result = np.zeros((*velocity.shape[:-1], 6, 10))
    result[..., :3, 0] = d
    spin = hat(omega)
    result[..., :3, 1:4] = hat(alpha) + spin @ spin
    result[..., 3:, 1:4] = -hat(d)
    for number, (r, c) in enumerate(_INERTIA):
        column = result[..., 3:, 4 + number]
        column[..., r] += alpha[..., c]
        if r != c:
            column[..., c] += alpha[..., r]
    l_omega = np.einsum('pij,...j->...pi', _BASIS, omega)
    result[..., 3:, 4:] += np.swapaxes(cross(omega[..., np.newaxis, :], l_omega), -1, -2)
    return result


def _body_pullback(
    projection: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """
    Differentiate sum_c projection_c . (column c of the body regressor) by the body's motion.

    Parameters
    ----------
    projection : ndarray, shape (..., 10, 6)
        What each parameter's force is multiplied with.
    velocity, acceleration : ndarray, shape (..., 6)
        Motion of the body in its own frame.

    """
    v, omega = velocity[..., :3], velocity[..., 3:]
    moment = projection[..., 1:4, :3]  # [c, r]
    turning = projection[..., 1:4, 3:]
    z = projection[..., 4:, 3:]
    by_d = projection[..., 0, :3] + _axial(turning)
    l_z = np.einsum('pij,...pj->...i', _BASIS, z)
    by_alpha = l_z - _axial(moment)
    symmetric = moment + np.swapaxes(moment, -1, -2)
    trace = np.trace(moment, axis1=-2, axis2=-1)[..., np.newaxis]
    by_omega = (symmetric @ omega[..., np.newaxis])[..., 0] - 2.0 * trace * omega
    l_omega = np.einsum('pij,...j->...pi', _BASIS, omega)
    by_omega += cross(l_omega, z).sum(axis=-2)
    by_omega += np.einsum('pij,...pj->...i', _BASIS, cross(z, omega[..., np.newaxis, :]))
    by_omega += cross(v, by_d)
    by_velocity = np.concatenate([cross(by_d, omega), by_omega], axis=-1)
    return by_velocity, np.concatenate([by_d, by_alpha], axis=-1)


def _axial(rows: FloatArray) -> FloatArray:
    """Return sum_c rows_c x e_c, shape (..., 3, 3) to (..., 3)."""
    return np.stack(
        [
            rows[..., 1, 2] * -1.0 + rows[..., 2, 1],
            rows[..., 2, 0] * -1.0 + rows[..., 0, 2],
            rows[..., 0, 1] * -1.0 + rows[..., 1, 0],
        ],
        axis=-1,
    )
