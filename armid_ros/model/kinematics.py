# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Points of links along whole motions: all samples at once, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin


def point_motion(
    robot: Robot, joint: str, offset: npt.ArrayLike, q: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """
    Follow a point of a link.

    Parameters
    ----------
    robot : Robot
        The arm.
    joint : str
        The joint that moves the link.
    offset : array_like, shape (3,)
        The point in the frame of that joint [m].
    q : ndarray, shape (N, n)
        Joint positions.

    Returns
    -------
    position : ndarray, shape (N, 3)
        In the base frame [m].
    jacobian : ndarray, shape (N, 3, n)
        Derivative by the joint positions.

    """
    point = np.asarray(offset, dtype=np.float64)[np.newaxis]
    positions, jacobians = points_motion(robot, [joint], point, q)
    return positions[:, 0], jacobians[:, 0]


def points_motion(
    robot: Robot, joints: Sequence[str], offsets: FloatArray, q: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """
    Follow points of links.

    Parameters
    ----------
    robot : Robot
        The arm.
    joints : sequence of str
        The joints that move the links, one of each of k points.
    offsets : ndarray, shape (k, 3)
        The points in the frames of those joints [m].
    q : ndarray, shape (N, n)
        Joint positions.

    Returns
    -------
    positions : ndarray, shape (N, k, 3)
        In the base frame [m].
    jacobians : ndarray, shape (N, k, 3, n)
        Derivatives by the joint positions.

    """
    frames = _frames(robot, q, {robot.joints.index(joint) for joint in joints})
    positions = np.empty((len(q), len(joints), 3))
    jacobians = np.zeros((len(q), len(joints), 3, robot.n_joints))
    for k, (joint, offset) in enumerate(zip(joints, offsets, strict=True)):
        link = robot.joints.index(joint)
        frame = frames[link]
        positions[:, k] = frame.origin + frame.rotation @ offset
        for moved_by in _ancestors(robot, link):
            mover = frames[moved_by]
            arm = positions[:, k] - mover.origin
            jacobians[:, k, :, moved_by] = mover.slide + np.cross(mover.turn, arm)
    return positions, jacobians


@dataclass(frozen=True)
class _Frame:
    """Where a joint is: rotation (N, 3, 3), origin, and what it does per unit, (N, 3)."""

    rotation: FloatArray
    origin: FloatArray
    slide: FloatArray
    turn: FloatArray


def _frames(robot: Robot, q: FloatArray, links: set[int]) -> dict[int, _Frame]:
    """Return the frames of links and of all that carry them."""
    frames: dict[int, _Frame] = {}
    for link in sorted({above for end in links for above in _ancestors(robot, end)}):
        placement = robot.model.jointPlacements[link + 1]
        slide, turn = _axis(robot, link)
        way = placement.translation + np.outer(q[:, link], placement.rotation @ slide)
        rotation = placement.rotation @ _rotations(turn, q[:, link])
        parent = int(robot.model.parents[link + 1]) - 1
        if parent >= 0:
            base = frames[parent]
            way = base.origin + np.einsum('nxy,ny->nx', base.rotation, way)
            rotation = base.rotation @ rotation
        frames[link] = _Frame(rotation, way, rotation @ slide, rotation @ turn)
    return frames


def _ancestors(robot: Robot, link: int) -> list[int]:
    """Return the joints that move a link, from the base on."""
    return [int(joint) - 1 for joint in robot.model.supports[link + 1] if joint > 0]


def _axis(robot: Robot, link: int) -> tuple[FloatArray, FloatArray]:
    """Return what a joint does to its link per unit: translation and rotation, each (3,)."""
    model = robot.model
    motion = pin.computeJointJacobian(
        model, model.createData(), pin.neutral(model), link + 1
    ).reshape(6, -1)[:, link]
    return motion[:3], motion[3:]


def _rotations(axis: FloatArray, angles: FloatArray) -> FloatArray:
    """Return rotations about an axis, the identity where it is zero, shape (N, 3, 3)."""
    cross = pin.skew(axis)
    sine, rest = np.sin(angles)[:, np.newaxis, np.newaxis], 1.0 - np.cos(angles)
    return np.asarray(np.eye(3) + sine * cross + rest[:, np.newaxis, np.newaxis] * cross @ cross)
