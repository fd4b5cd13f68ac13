# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Kinematics of all samples at once, in world coordinates.

Spatial vectors are (linear, angular) at the world origin, as Pinocchio orders them. In these
coordinates the axis S_j of a joint turns with every joint m that carries it,
dS_j/dq_m = S_m x S_j, and everything else follows from that.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin


@dataclass(frozen=True)
class Chain:
    """
    What does not move: how the joints hang on one another.

    Attributes
    ----------
    parents : tuple of int
        Parent joint of each joint, -1 for the base.
    placements : tuple of (rotation, translation)
        Frame of each joint at zero in its parent's frame.
    axes : ndarray, shape (n, 3)
        Direction of each joint in its own frame.
    prismatic : ndarray of bool, shape (n,)
        True where a joint slides.
    carries : ndarray, shape (n, n)
        1 where joint m carries joint i: m is i or one of its ancestors; [m, i].
    gravity : ndarray, shape (3,)
        [m/s^2].

    """

    parents: tuple[int, ...]
    placements: tuple[tuple[FloatArray, FloatArray], ...]
    axes: FloatArray
    prismatic: npt.NDArray[np.bool_]
    carries: FloatArray
    gravity: FloatArray

    @classmethod
    def of(cls, robot: Robot) -> Chain:
        """Read the chain off a robot's model."""
        model = robot.model
        data = model.createData()
        n = robot.n_joints
        parents = tuple(int(model.parents[i + 1]) - 1 for i in range(n))
        carries = np.eye(n)
        for i, parent in enumerate(parents):
            if parent >= 0:
                carries[:, i] += carries[:, parent]
        axes = np.empty((n, 3))
        zero = np.zeros(n)
        for i in range(n):
            jacobian = pin.computeJointJacobian(model, data, zero, i + 1)
            column = jacobian.reshape(6, n)[:, i]  # of one joint it comes without its second axis
            axes[i] = column[:3] if robot.prismatic[i] else column[3:]
        placements = tuple(
            (np.array(m.rotation), np.array(m.translation))
            for m in list(model.jointPlacements)[1:]
        )
        return cls(parents, placements, axes, robot.prismatic, carries, robot.gravity)

    @property
    def n_joints(self) -> int:
        """Return the number of joints n."""
        return len(self.parents)

    def pose(self, q: FloatArray) -> Pose:
        """Place all joints, q of shape (N, n) [rad or m]."""
        count, n = q.shape
        rotation = np.empty((count, n, 3, 3))
        position = np.empty((count, n, 3))
        sine, versine = np.sin(q), 1.0 - np.cos(q)
        for i, (parent, (turn, shift)) in enumerate(
            zip(self.parents, self.placements, strict=True)
        ):
            if parent < 0:
                base, origin = np.broadcast_to(turn, (count, 3, 3)), np.tile(shift, (count, 1))
            else:
                base = rotation[:, parent] @ turn
                origin = position[:, parent] + rotation[:, parent] @ shift
            axis = self.axes[i]
            if self.prismatic[i]:
                rotation[:, i] = base
                position[:, i] = origin + q[:, i, np.newaxis] * (base @ axis)
            else:
                skew = hat(axis)
                about = (
                    np.eye(3)
                    + sine[:, i, np.newaxis, np.newaxis] * skew
                    + versine[:, i, np.newaxis, np.newaxis] * (skew @ skew)
                )
                rotation[:, i] = base @ about
                position[:, i] = origin
        direction = np.einsum('knij,nj->kni', rotation, self.axes)
        moving = cross(position, direction)
        slides = self.prismatic[:, np.newaxis]
        axes = np.concatenate(
            [np.where(slides, direction, moving), np.where(slides, 0.0, direction)], axis=2
        )
        return Pose(rotation, position, axes)


@dataclass(frozen=True)
class Pose:
    """
    Where the joints are in N samples.

    Attributes
    ----------
    rotation, position : ndarray, shape (N, n, 3, 3) and (N, n, 3)
        Joint frames in the world.
    axes : ndarray, shape (N, n, 6)
        Spatial joint axes S_j in the world.

    """

    rotation: FloatArray
    position: FloatArray
    axes: FloatArray

    def to_body(self, motions: FloatArray) -> FloatArray:
        """Express spatial motions in joint frames, shape (N, n, ..., 6), one frame per n."""
        extra = motions.ndim - 3
        p = self.position.reshape(*self.position.shape[:2], *(1,) * extra, 3)
        linear = motions[..., :3] - cross(p, motions[..., 3:])
        flat = (*self.position.shape[:2], -1, 3)
        # row vectors: v' R is R' v
        body = [x.reshape(flat) @ self.rotation for x in (linear, motions[..., 3:])]
        return np.concatenate([x.reshape(linear.shape) for x in body], axis=-1)

    def from_body_force(self, forces: FloatArray) -> FloatArray:
        """Express spatial forces given in joint frames, shape (N, n, ..., 6), in the world."""
        extra = forces.ndim - 3
        flat = (*self.position.shape[:2], -1, 3)
        back = np.swapaxes(self.rotation, -1, -2)
        linear = (forces[..., :3].reshape(flat) @ back).reshape(forces[..., :3].shape)
        angular = (forces[..., 3:].reshape(flat) @ back).reshape(linear.shape)
        p = self.position.reshape(*self.position.shape[:2], *(1,) * extra, 3)
        return np.concatenate([linear, angular + cross(p, linear)], axis=-1)


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the last axis; several times faster than numpy's on small arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    result[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    result[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


def motion_cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the spatial cross product of two motions, a x b."""
    linear = cross(a[..., 3:], b[..., :3]) + cross(a[..., :3], b[..., 3:])
    return np.concatenate([linear, cross(a[..., 3:], b[..., 3:])], axis=-1)


def force_cross(a: FloatArray, f: FloatArray) -> FloatArray:
    """Return the spatial cross product of a motion and a force, a x* f."""
    angular = cross(a[..., 3:], f[..., 3:]) + cross(a[..., :3], f[..., :3])
    return np.concatenate([cross(a[..., 3:], f[..., :3]), angular], axis=-1)


def hat(v: FloatArray) -> FloatArray:
    """Return the matrix of the cross product with v, shape (..., 3) to (..., 3, 3)."""
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -v[..., 2], v[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = v[..., 2], -v[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -v[..., 1], v[..., 0]
    return matrix
