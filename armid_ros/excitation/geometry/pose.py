# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Joint axes of all samples at once, in world coordinates.

Spatial vectors are (linear, angular) at the world origin, as Pinocchio orders them. In these
coordinates the axis S_j of a joint turns with every joint m that carries it,
dS_j/dq_m = S_m x S_j, and everything else follows from that.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np


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

    @classmethod
    def of(cls, robot: Robot, q: FloatArray) -> Pose:
        """Place all joints of a robot, q of shape (N, n) [rad or m]."""
        along = LinkFrames.of(robot, q)
        links = [along.frames[joint] for joint in range(robot.n_joints)]
        return cls(
            np.stack([link.rotation.transpose(2, 0, 1) for link in links], axis=1),
            np.stack([link.origin.T for link in links], axis=1),
            np.ascontiguousarray(
                np.concatenate([along.lines, along.turns], axis=1).transpose(2, 0, 1)
            ),
        )

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


def carried_by(robot: Robot) -> FloatArray:
    """Return 1 where joint m carries joint i, m is i or one of its ancestors, (n, n) [m, i]."""
    carries = np.zeros((robot.n_joints, robot.n_joints))
    for number, joint in enumerate(robot.geometry):
        carries[list(joint.movers), number] = 1.0
    return carries


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
