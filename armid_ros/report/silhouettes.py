# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Poses of an arm as a strip of silhouettes of its collision bodies, far ones first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.excitation.geometry.capsules import outline
from armid_ros.motion import FloatArray
from armid_ros.report.strip import CORNER, Strip, svg_points
from armid_ros.robots import CollisionModel
from armid_ros.robots.sticks import sticks
import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

_WIDTH, _HEIGHT, _MARGIN = 190.0, 230.0, 0.03
_ROUND = 16
#: An arm without bodies is drawn as its joints, connected by bars this thick [m].
_BAR = 0.02
#: What is smaller stands for a link without a body and cannot be seen [m].
_POINT = 1e-3


@dataclass(frozen=True)
class Silhouettes:
    """
    A strip of poses.

    Attributes
    ----------
    width, height : float
        [px].
    bodies : tuple of (str, int)
        Outline of a body as coordinates of SVG, and which share of the chain it is along [%];
        -1 for what is not part of the arm.
    paths : tuple of str
        Way of the last body in each frame.
    tips : tuple of (float, float)
        Where on it the last body is.
    captions : tuple of (float, str)
        Where each pose is, and when.

    """

    width: float
    height: float
    bodies: tuple[tuple[str, int], ...]
    paths: tuple[str, ...]
    tips: tuple[tuple[float, float], ...]
    captions: tuple[tuple[float, str], ...]


def draw_silhouettes(
    collision: CollisionModel, poses: FloatArray, captions: Sequence[str], way: FloatArray
) -> Silhouettes:
    """
    Draw an arm and what stands around it.

    Parameters
    ----------
    collision : CollisionModel
        Bodies of the arm, and obstacles; half spaces are not drawn.
    poses : ndarray, shape (K, n)
        Poses to draw [rad or m].
    captions : sequence of str, length K
        What is written below.
    way : ndarray, shape (N, n)
        Poses between which the last body moves.

    """
    solids = _solids(collision)
    n = collision.robot.n_joints
    frames = _frames(collision, poses)
    flat = [[(solid, solid.seen(frame[solid.joint])) for solid in solids] for frame in frames]
    last = max(solids, key=lambda solid: solid.joint)
    track = np.array(
        [CORNER.flat(frame[last.joint].act(last.middle)) for frame in _frames(collision, way)]
    )
    every = np.concatenate([track, *(hull for pose in flat for _, (hull, _) in pose)])
    size = np.ptp(every, axis=0) + 2.0 * _MARGIN
    strip = Strip.around(
        every, len(poses), _MARGIN, float(min(_WIDTH / size[0], _HEIGHT / size[1]))
    )
    bodies = []
    for pose, seen in enumerate(flat):
        for solid, (hull, _) in sorted(seen, key=lambda one: one[1][1]):
            share = round(100.0 * solid.joint / n) if solid.of_arm else -1
            bodies.append((svg_points(strip.place(hull, pose)), share))
    tips = [CORNER.flat(frame[last.joint].act(last.middle)) for frame in frames]
    return Silhouettes(
        *strip.size,
        tuple(bodies),
        tuple(svg_points(strip.place(track, pose)) for pose in range(len(poses))),
        tuple(
            (round(float(x), 1), round(float(y), 1))
            for x, y in (strip.place(tip, pose) for pose, tip in enumerate(tips))
        ),
        strip.captions(captions),
    )


@dataclass(frozen=True)
class _Solid:
    """A body: all points within a radius of some, in the frame of a joint of the model."""

    joint: int
    of_arm: bool
    points: FloatArray
    radius: float

    @property
    def middle(self) -> FloatArray:
        return np.asarray(self.points.mean(axis=0))

    def seen(self, placement: pin.SE3) -> tuple[FloatArray, float]:
        """Return the outline as seen, shape (K, 2) [m], and how near it is to the eye."""
        points = self.points @ placement.rotation.T + placement.translation
        turn = np.linspace(0.0, 2.0 * np.pi, _ROUND, endpoint=False)
        ring = max(self.radius, 1e-4) * np.column_stack([np.cos(turn), np.sin(turn)])
        flat = CORNER.flat(points)
        flat = flat[ConvexHull(flat).vertices] if len(flat) > 16 else flat
        cloud = (flat[:, np.newaxis] + ring).reshape(-1, 2)
        return cloud[ConvexHull(cloud).vertices], float(CORNER.near(points).mean())


def _solids(collision: CollisionModel) -> list[_Solid]:
    solids = []
    for body in collision.geometry.geometryObjects:
        points, radius = _surface(body.geometry)
        if len(points) and (radius > _POINT or np.ptp(points, axis=0).max() > _POINT):
            placed = points @ body.placement.rotation.T + body.placement.translation
            solids.append(_Solid(int(body.parentJoint), body.parentFrame > 0, placed, radius))
    if any(solid.joint > 0 for solid in solids):
        return solids
    bars = sticks(collision.robot.model)
    return solids + [_Solid(k, True, np.stack([np.zeros(3), end]), _BAR) for k, end in bars]


def _surface(shape: coal.CollisionGeometry) -> tuple[FloatArray, float]:
    """Return points and a radius about their hull that are a shape; no points if endless."""
    if isinstance(shape, coal.Cylinder):
        turn = np.linspace(0.0, 2.0 * np.pi, _ROUND, endpoint=False)
        rim = shape.radius * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
        up = np.array([0.0, 0.0, shape.halfLength])
        return np.concatenate([rim + up, rim - up]), 0.0
    return outline(shape)


def _frames(collision: CollisionModel, poses: FloatArray) -> list[list[pin.SE3]]:
    """Return where the joints of the model are in every pose."""
    model, data = collision.robot.model, collision.robot.model.createData()
    frames = []
    for q in poses:
        pin.forwardKinematics(model, data, q)
        frames.append([pin.SE3(placement) for placement in data.oMi])
    return frames
