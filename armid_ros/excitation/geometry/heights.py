# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Heights of the bodies of an arm: the lowest and the highest point of a motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import CollisionModel
import coal
import numpy as np


@dataclass(frozen=True)
class LowestPoint:
    """
    The lowest point of a motion.

    Attributes
    ----------
    height : float
        Height of the point above the origin of the base, along the vertical [m].
    link : str
        Link of the point.
    time : float
        Time of the point [s].

    """

    height: float
    link: str
    time: float


def lowest_point(
    collision: CollisionModel, up: FloatArray, motion: Motion, exempt: Sequence[str] = ()
) -> LowestPoint:
    """
    Return the lowest point of the moving links in the samples of a motion.

    The frame of its joint represents a link without a collision body.

    Parameters
    ----------
    collision : CollisionModel
        Bodies of the arm.
    up : ndarray, shape (3,)
        Unit vector of the vertical, in the base frame.
    motion : Motion
        N samples.
    exempt : sequence of str
        Links that are ignored, because they stand on the floor.

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
    Yield each link with its lowest and highest point in poses, q of shape (N, n).

    Yields
    ------
    link : str
        Its name.
    lowest, highest : ndarray, shape (N,)
        Heights above the origin of the base [m].

    """
    robot = collision.robot
    frames = LinkFrames.of(robot, q).frames
    seen: set[int] = set()
    for body in collision.geometry.geometryObjects:
        joint = int(body.parentJoint) - 1
        name = str(robot.model.frames[body.parentFrame].name)
        if joint >= 0:
            seen.add(joint)
            down, origin = (up @ frames[joint].rotation.transpose(2, 0, 1)), frames[joint].origin.T
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
            height = frames[joint].origin.T @ up
            yield link, height, height


def vertical(gravity: FloatArray) -> FloatArray:
    """Return the unit vector against gravity; z of the base without gravity."""
    size = float(np.linalg.norm(gravity))
    return np.asarray(-gravity / size) if size > 0.0 else np.array([0.0, 0.0, 1.0])


def outline(shape: coal.CollisionGeometry) -> tuple[FloatArray, float]:
    """Return points and a radius about their hull that contain a shape; None if unbounded."""
    if isinstance(shape, coal.Convex):
        return np.array(shape.points()), 0.0
    if isinstance(shape, coal.Sphere):
        return np.zeros((1, 3)), float(shape.radius)
    if isinstance(shape, coal.Cylinder | coal.Capsule):
        end = np.array([0.0, 0.0, shape.halfLength])
        return np.array([end, -end]), float(shape.radius)
    shape.computeLocalAABB()
    ends = np.array([shape.aabb_local.min_, shape.aabb_local.max_])
    # [m]; an unbounded shape, such as a half space
    if not np.all(np.abs(ends) < 1e6):
        return np.empty((0, 3)), 0.0
    return np.array(list(product(*ends.T))), 0.0


def _support(shape: coal.CollisionGeometry, direction: FloatArray) -> FloatArray:
    """Return the extent of a shape along unit vectors in its frame, shape (N, 3) to (N,) [m]."""
    if isinstance(shape, coal.Cylinder):
        along = np.abs(direction[:, 2])
        across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
        return np.asarray(shape.halfLength * along + shape.radius * across)
    points, skin = outline(shape)
    if not len(points):
        return np.full(len(direction), np.inf)
    return np.asarray((direction @ points.T).max(axis=1) + skin)
