# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What an arm looks like: triangles in the frames of its joints.

They are those of <visual>, or of <collision> where a link has none; an arm without either is drawn
as bars from joint to joint.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, read_only
from armid_ros.robots import Robot
from armid_ros.robots.geometry import LinkShape, shapes_of
from armid_ros.robots.sticks import sticks
import coal
import numpy as np
from scipy.spatial import ConvexHull

#: Corners of a circle, points of a sphere, and how thick a bar is [m].
_ROUND, _SPHERE, _BAR = 24, 200, 0.02


@dataclass(frozen=True, eq=False)
class Body:
    """
    One piece of a link.

    Attributes
    ----------
    link : str
        The link.
    joint : int
        Index among the driven joints of the one that carries it; -1 for the base.
    corners : ndarray, shape (T, 3, 3)
        Corners of T triangles in the frame of that joint [m].

    """

    link: str
    joint: int
    corners: FloatArray

    def __post_init__(self) -> None:
        """Freeze the triangles."""
        object.__setattr__(self, 'corners', read_only(self.corners))


def bodies(robot: Robot) -> tuple[tuple[Body, ...], tuple[str, ...]]:
    """
    Return the pieces of an arm, and notes on meshes that were not found.

    Raises
    ------
    RobotError
        If a shape has no numbers, or a mesh cannot be read.

    """
    found: list[Body] = []
    notes: list[str] = []
    for shape in shapes_of(robot, 'visual', 'collision'):
        if shape.kind == 'mesh' and shape.path is None:
            notes.append(f"link '{shape.link}': its mesh is not found; it is not drawn")
            continue
        place = shape.placement
        try:
            corners = _triangles(shape) @ np.array(place.rotation).T + np.array(place.translation)
        except ValueError as error:
            raise RobotError(f"{robot.name}: a shape of link '{shape.link}': {error}") from None
        joint = int(robot.model.frames[shape.frame].parentJoint) - 1
        found.append(Body(shape.link, joint, corners))
    return tuple(found) or _bars(robot), tuple(notes)


def _triangles(shape: LinkShape) -> FloatArray:
    """Return the triangles of a shape in its own frame."""
    if shape.path is not None:
        scale = np.array(shape.size)
        try:
            mesh = coal.MeshLoader().load(str(shape.path), scale)
        except (RuntimeError, ValueError) as error:
            raise ValueError(f'{shape.path} cannot be read as a mesh: {error}') from None
        faces = np.array(
            [[face[0], face[1], face[2]] for face in map(mesh.tri_indices, range(mesh.num_tris))]
        )
        return np.asarray(np.array(mesh.vertices())[faces])
    if shape.kind == 'box':
        return _hull(0.5 * np.array(shape.size) * _CUBE)
    if shape.kind == 'sphere':
        return _hull(shape.size[0] * _sphere())
    radius, length = shape.size
    ends = _RING if shape.kind == 'cylinder' else _sphere()
    shift = np.array([0.0, 0.0, 0.5 * length])
    return _hull(np.concatenate([radius * ends + shift, radius * ends - shift]))


def _bars(robot: Robot) -> tuple[Body, ...]:
    """Return a bar from each joint to those that it carries, and to the centre of the last."""
    ball, names = _BAR * _sphere(), ('base', *robot.links)
    return tuple(
        Body(names[joint], joint - 1, _hull(np.concatenate([ball, end + ball])))
        for joint, end in sticks(robot.model)
    )


def _hull(points: FloatArray) -> FloatArray:
    """Return the triangles around points, their corners counter-clockwise from outside."""
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.sum(normals * hull.equations[:, :3], axis=1) < 0.0
    corners[inwards] = corners[inwards][:, ::-1]
    return np.asarray(corners)


def _sphere() -> FloatArray:
    """Return points spread evenly over the unit sphere, shape (S, 3)."""
    k = np.arange(_SPHERE) + 0.5
    z, turn = 1.0 - 2.0 * k / _SPHERE, np.pi * (1.0 + np.sqrt(5.0)) * k
    wide = np.sqrt(1.0 - z**2)
    return np.column_stack([wide * np.cos(turn), wide * np.sin(turn), z])


_CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_ANGLES = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
_RING = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(_ROUND)])
