# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How high the bodies of an arm are: the lowest and the highest point of a motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armid_ros.excitation.geometry.capsules import outline
from armid_ros.excitation.geometry.pose import Pose
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import CollisionModel
import coal
import numpy as np


@dataclass(frozen=True)
class LowestPoint:
    """
    Where a motion comes lowest.

    Attributes
    ----------
    height : float
        Of the point above the origin of the base, along the vertical [m].
    link : str
        Link that it belongs to.
    time : float
        When [s].

    """

    height: float
    link: str
    time: float


def lowest_point(
    collision: CollisionModel, up: FloatArray, motion: Motion, exempt: Sequence[str] = ()
) -> LowestPoint:
    """
    Return the lowest point of the moving links in the samples of a motion.

    A link without a collision body counts with the frame of its joint.

    Parameters
    ----------
    collision : CollisionModel
        Bodies of the arm.
    up : ndarray, shape (3,)
        Unit vector of the vertical, in the base frame.
    motion : Motion
        N samples.
    exempt : sequence of str
        Links that do not count, because they stand on the floor.

    """
    lowest = LowestPoint(np.inf, '', 0.0)
    for link, below, _ in link_heights(collision, up, motion.q):
        if link in exempt:
            continue
        sample = int(np.argmin(below))
        if below[sample] < lowest.height:
            lowest = LowestPoint(float(below[sample]), link, float(motion.t[sample]))
    return lowest


def link_heights(
    collision: CollisionModel, up: FloatArray, q: FloatArray, *, fixed: bool = False
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """
    Yield link by link how far down and how far up it reaches in poses, q of shape (N, n).

    Yields
    ------
    link : str
        Its name.
    lowest, highest : ndarray, shape (N,)
        Heights above the origin of the base [m].

    """
    robot = collision.robot
    pose = Pose.of(robot, q)
    seen: set[int] = set()
    for body in collision.geometry.geometryObjects:
        joint = int(body.parentJoint) - 1
        name = str(robot.model.frames[body.parentFrame].name)
        if joint >= 0:
            seen.add(joint)
            down, origin = pose.rotation[:, joint].transpose(0, 2, 1) @ up, pose.position[:, joint]
        elif fixed:
            down, origin = np.tile(up, (len(q), 1)), np.zeros((len(q), 3))
        else:
            continue
        # the vertical in the frame of the body, and the height of its origin
        direction = down @ body.placement.rotation
        height = origin @ up + down @ body.placement.translation
        yield (
            name,
            height - _support(body.geometry, -direction),
            height + _support(body.geometry, direction),
        )
    for joint, link in enumerate(robot.links):
        if joint not in seen:
            height = pose.position[:, joint] @ up
            yield link, height, height


def vertical(gravity: FloatArray) -> FloatArray:
    """Return the unit vector against gravity; z of the base where there is none."""
    size = float(np.linalg.norm(gravity))
    return np.asarray(-gravity / size) if size > 0.0 else np.array([0.0, 0.0, 1.0])


def _support(shape: coal.CollisionGeometry, direction: FloatArray) -> FloatArray:
    """How far a shape reaches along unit vectors in its own frame, shape (N, 3) to (N,) [m]."""
    if isinstance(shape, coal.Cylinder):
        along = np.abs(direction[:, 2])
        across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
        return np.asarray(shape.halfLength * along + shape.radius * across)
    points, skin = outline(shape)
    if not len(points):
        return np.full(len(direction), np.inf)
    return np.asarray((direction @ points.T).max(axis=1) + skin)
