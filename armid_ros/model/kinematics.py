# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Positions, velocities and Jacobians of points on links, for all samples of a motion at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np


def points_motion(
    robot: Robot, joints: Sequence[str], offsets: FloatArray, q: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """
    Return positions and Jacobians of points on links at joint positions q.

    Parameters
    ----------
    robot : Robot
        The arm.
    joints : sequence of str
        The joints that move the links of the k points.
    offsets : ndarray, shape (k, 3)
        The points in the frames of these joints [m].
    q : ndarray, shape (N, n)
        Joint positions.

    Returns
    -------
    positions : ndarray, shape (N, k, 3)
        Positions in the base frame [m].
    jacobians : ndarray, shape (N, k, 3, n)
        Derivatives of the positions by the joint positions.

    """
    return LinkFrames.of(robot, q, joints).points(joints, offsets)


@dataclass(frozen=True)
class _Frame:
    """Frame of a link in N samples: rotation, origin [m], and the joints that move the link."""

    rotation: FloatArray
    origin: FloatArray
    movers: tuple[int, ...]

    def turned(self, vectors: FloatArray) -> FloatArray:
        """Rotate vectors (3,), (3, N) or (3, m, N) from the link frame to the base frame."""
        x, y, z = (self.rotation[:, axis] for axis in range(3))
        if vectors.ndim == 3:
            x, y, z = x[:, np.newaxis], y[:, np.newaxis], z[:, np.newaxis]
        return np.asarray(x * vectors[0] + y * vectors[1] + z * vectors[2])


@dataclass(frozen=True)
class LinkFrames:
    """
    Link frames and joint twists along a motion.

    Samples are on the last axis of attributes, and on the first axis of results.

    Attributes
    ----------
    joints : tuple of str
        All moving joints of the robot.
    frames : dict
        Frames of the links, by the number of their joint.
    lines, turns : ndarray, shape (m, 3, N)
        Twist of the moved bodies per unit velocity of each joint: velocity at the origin of the
        base frame [m/rad, or m/m], and angular velocity.
    coupling : ndarray, shape (N, m, n), or None
        Derivative of the moving joints by the driven ones; None if these are the same.

    """

    joints: tuple[str, ...]
    frames: Mapping[int, _Frame]
    lines: FloatArray
    turns: FloatArray
    coupling: FloatArray | None = None

    @classmethod
    def of(cls, robot: Robot, q: FloatArray, joints: Sequence[str] | None = None) -> LinkFrames:
        """
        Compute the frames of the links that `joints` move, at joint positions q.

        Parameters
        ----------
        robot : Robot
            The arm.
        q : ndarray, shape (N, n)
            Joint positions.
        joints : sequence of str, optional
            Joints that move the links; all by default.

        Raises
        ------
        RobotError
            If the robot has no such joint.

        """
        ends = [robot.tree.index(joint) for joint in joints or robot.moving]
        frames: dict[int, _Frame] = {}
        lines, turns = np.zeros((2, len(robot.moving), 3, len(q)))
        coupling = None
        if robot.mechanism is not None:
            q, coupling, _ = robot.mechanism.states(q)
        for link in sorted({above for end in ends for above in robot.geometry[end].movers}):
            joint, angles = robot.geometry[link], q[:, link]
            origin = joint.origin[:, np.newaxis] + np.outer(joint.sliding, angles)
            rotation = joint.turning @ [np.ones_like(angles), np.sin(angles), 1.0 - np.cos(angles)]
            if joint.parent >= 0:
                base = frames[joint.parent]
                origin = base.origin + base.turned(origin)
                rotation = base.turned(rotation)
            frames[link] = frame = _Frame(rotation, origin, joint.movers)
            turns[link] = frame.turned(joint.turn)
            lines[link] = frame.turned(joint.slide) + _cross(origin, turns[link])
        return cls(robot.moving, frames, lines, turns, coupling)

    @classmethod
    def in_the_middle(cls, robot: Robot) -> LinkFrames:
        """Compute the link frames with all joints in mid-range, or at 0 without limits."""
        return cls.of(robot, robot.middle_pose[np.newaxis])

    def places(self, joint: str, offset: FloatArray) -> FloatArray:
        """Return the positions (N, 3) [m] of a link point `offset` (3,), in the base frame."""
        frame = self.frames[self.joints.index(joint)]
        return np.asarray((frame.origin + frame.turned(offset)).T)

    def points(self, joints: Sequence[str], offsets: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, k, 3) and Jacobians (N, k, 3, n) of k points on links."""
        positions = np.empty((len(joints), 3, self.lines.shape[2]))
        jacobians = np.zeros((len(joints), *self.lines.shape))
        for k, (joint, offset) in enumerate(zip(joints, offsets, strict=True)):
            positions[k] = self.places(joint, offset).T
            for mover in self.frames[self.joints.index(joint)].movers:
                jacobians[k, mover] = self.lines[mover] + _cross(self.turns[mover], positions[k])
        by_joint = jacobians.transpose(3, 0, 2, 1)
        if self.coupling is not None:  # from moving joints to driven joints
            by_joint = np.einsum('k...m,kmn->k...n', by_joint, self.coupling)
        return positions.transpose(2, 0, 1), by_joint


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products (3, N) of the columns of two arrays (3, N)."""
    result = np.empty(b.shape)
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[x] = a[y] * b[z] - a[z] * b[y]
    return result
