# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Bounding capsules: a quick bound on how far bodies are apart.

A capsule is all points within a radius of a segment. The distance of two capsules that contain
two bodies is never larger than that of the bodies.

"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from armid_ros.excitation.geometry.pose import Pose
from armid_ros.motion import FloatArray
import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

#: A shape with a coordinate beyond this has no bounds, such as a half space [m].
_ENDLESS = 1e6


@dataclass(frozen=True)
class Capsules:
    """
    Capsules of m bodies, in the frames of the joints that carry them.

    Attributes
    ----------
    joints : ndarray of int, shape (m,)
        Joint that carries each body, -1 for those that do not move.
    centres : ndarray, shape (m, 3)
        Middle of each segment [m].
    halves : ndarray, shape (m, 3)
        From the middle to an end [m].
    radii : ndarray, shape (m,)
        [m]; infinite for a body that has no bounds.
    normals, offsets : ndarray, shape (m, 3) and (m,)
        Of those bodies that are half spaces and do not move: the points x with normal x <= offset
        [m]; NaN for the others.

    """

    joints: npt.NDArray[np.intp]
    centres: FloatArray
    halves: FloatArray
    radii: FloatArray
    normals: FloatArray
    offsets: FloatArray

    @classmethod
    def of(cls, geometry: pin.GeometryModel) -> Capsules:
        """Bound every body of a geometry model."""
        bodies = list(geometry.geometryObjects)
        joints = np.array([int(body.parentJoint) - 1 for body in bodies], dtype=np.intp)
        centres, halves = np.zeros((len(bodies), 3)), np.zeros((len(bodies), 3))
        radii = np.full(len(bodies), np.inf)
        normals, offsets = np.full((len(bodies), 3), np.nan), np.full(len(bodies), np.nan)
        for number, body in enumerate(bodies):
            if isinstance(body.geometry, coal.Halfspace) and joints[number] < 0:
                normals[number] = body.placement.rotation @ body.geometry.n
                offsets[number] = body.geometry.d + normals[number] @ body.placement.translation
                continue
            points, skin = outline(body.geometry)
            if len(points):
                spread = np.linalg.svd(points - points.mean(axis=0))[2]
                middle, half, radius = min(
                    (_capsule_along(points, direction) for direction in (*np.eye(3), *spread)),
                    key=lambda c: c[2] ** 2 * (np.linalg.norm(c[1]) + 2.0 / 3.0 * c[2]),
                )
                centres[number] = body.placement.act(middle)
                halves[number] = body.placement.rotation @ half
                radii[number] = radius + skin
        return cls(joints, centres, halves, radii, normals, offsets)

    def reach(self) -> FloatArray:
        """Return the largest distance of any point from its joint's frame, shape (m,) [m]."""
        ends = (self.centres + self.halves, self.centres - self.halves)
        return np.asarray(
            np.max([np.linalg.norm(end, axis=1) for end in ends], axis=0) + self.radii
        )

    def distance(self, pose: Pose, pairs: npt.NDArray[np.intp]) -> FloatArray:
        """
        Bound the distances of pairs of bodies from below.

        Parameters
        ----------
        pose : Pose
            Where the joints are in N samples.
        pairs : ndarray of int, shape (p, 2)
            Bodies.

        Returns
        -------
        ndarray, shape (N, p)
            [m]; minus infinity with a body that has no bounds.

        """
        count = len(pose.position)
        centre = np.empty((count, len(self.joints), 3))
        half = np.empty_like(centre)
        for body, joint in enumerate(self.joints):
            if joint < 0:
                centre[:, body], half[:, body] = self.centres[body], self.halves[body]
            else:
                turned = pose.rotation[:, joint] @ self.centres[body]
                centre[:, body] = pose.position[:, joint] + turned
                half[:, body] = pose.rotation[:, joint] @ self.halves[body]
        first, second = pairs[:, 0], pairs[:, 1]
        apart = _segment_distance(
            centre[:, second] - centre[:, first], half[:, first], half[:, second]
        )
        bound = apart - self.radii[first] - self.radii[second]
        for pair in np.flatnonzero(np.isfinite(self.offsets[second])):
            body, normal = first[pair], self.normals[second[pair]]
            lowest = centre[:, body] @ normal - np.abs(half[:, body] @ normal)
            bound[:, pair] = lowest - self.offsets[second[pair]] - self.radii[body]
        return np.asarray(bound)


def _segment_distance(between: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """
    Distance of segments -first ... first and between - second ... between + second.

    Minimises |between + s second - r first| over r and s in [-1, 1].
    Source: Ericson 2005, Real-Time Collision Detection, section 5.1.9.

    """
    a, e = (first**2).sum(-1), (second**2).sum(-1)
    b, c, f = (first * second).sum(-1), (first * between).sum(-1), (second * between).sum(-1)
    tiny = np.finfo(float).tiny
    denominator = a * e - b * b
    parallel = denominator <= 1e-12 * a * e
    r = np.where(parallel, 0.0, (c * e - b * f) / np.where(parallel, 1.0, denominator))
    r = np.clip(r, -1.0, 1.0)
    s = np.clip((b * r - f) / np.maximum(e, tiny), -1.0, 1.0)
    r = np.clip((c + b * s) / np.maximum(a, tiny), -1.0, 1.0)
    gap = between + s[..., np.newaxis] * second - r[..., np.newaxis] * first
    return np.asarray(np.linalg.norm(gap, axis=-1))


def outline(shape: coal.CollisionGeometry) -> tuple[FloatArray, float]:
    """Return points and a radius about their convex hull that contain a shape; none if endless."""
    if isinstance(shape, coal.Convex):
        return np.array(shape.points()), 0.0
    if isinstance(shape, coal.Sphere):
        return np.zeros((1, 3)), float(shape.radius)
    if isinstance(shape, coal.Cylinder | coal.Capsule):
        end = np.array([0.0, 0.0, shape.halfLength])
        return np.array([end, -end]), float(shape.radius)
    shape.computeLocalAABB()
    ends = np.array([shape.aabb_local.min_, shape.aabb_local.max_])
    if not np.all(np.abs(ends) < _ENDLESS):
        return np.empty((0, 3)), 0.0
    return np.array(list(product(*ends.T))), 0.0


def _capsule_along(
    points: FloatArray, direction: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    along = points @ direction
    across = points - np.multiply.outer(along, direction)
    middle = 0.5 * (across.min(axis=0) + across.max(axis=0))
    middle = middle - (middle @ direction) * direction
    off = np.linalg.norm(across - middle, axis=1)
    radius = float(off.max())
    cap = np.sqrt(np.maximum(radius**2 - off**2, 0.0))
    high, low = float((along - cap).max()), float((along + cap).min())
    if high < low:
        high = low = 0.5 * (high + low)
    return middle + 0.5 * (high + low) * direction, 0.5 * (high - low) * direction, radius
