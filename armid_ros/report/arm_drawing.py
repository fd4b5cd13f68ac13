# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Drawings of an arm as SVG: outlines of its collision bodies, with gravity downwards.

A link without a body is drawn as bars from its joint to the next joints. The last bar ends
beyond its centre of mass.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.excitation.geometry.floor import outline
from armid_ros.motion import FloatArray
from armid_ros.report.page import Templated
from armid_ros.robots import CollisionModel, Robot
from armid_ros.robots.geometry import collision_geometry, sticks
import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

#: Corners of the outline of a circle.
_CIRCLE_CORNERS = 16
#: Colour of obstacles.
OBSTACLE = 'var(--line)'
#: Smallest size of a body that is drawn; links without a body have smaller ones [m].
_MIN_SIZE = 1e-3
#: Axes of the drawing, (3, 3): right, up, and towards the viewer, who is at an azimuth of -55 and
#: an elevation of 18 degrees.
_VIEW = pin.rpy.rpyToMatrix(np.radians(72.0), 0.0, np.radians(35.0)).T


@dataclass(frozen=True)
class ArmDrawing(Templated):
    """
    Drawing of an arm as SVG elements, in one pose or in several poses side by side.

    Attributes
    ----------
    width, height : float
        Size of the drawing [px].
    bodies : tuple of (str, str)
        Outline of each body as coordinates of SVG, far ones first, and its colour.
    dots : tuple of (float, float, str, str)
        Position [px], colour and name of joints, or of the last body in each pose.
    paths : tuple of str
        Path of the last body, for each pose.
    captions : tuple of (float, str)
        Position [px] and text of each caption.
    labels : tuple of (float, float, float, float, str)
        Ends of a line from a joint to its name [px], and the name.
    gravity : bool
        Whether an arrow shows gravity.
    label : str
        Description of the drawing, for screen readers.

    """

    template: ClassVar[str] = 'arm_drawing.html'

    width: float
    height: float
    bodies: tuple[tuple[str, str], ...]
    dots: tuple[tuple[float, float, str, str], ...]
    paths: tuple[str, ...] = ()
    captions: tuple[tuple[float, str], ...] = ()
    labels: tuple[tuple[float, float, float, float, str], ...] = ()
    gravity: bool = False
    label: str = 'Poses of the arm'


def draw_poses(
    collision: CollisionModel, poses: FloatArray, captions: Sequence[str], path: FloatArray
) -> ArmDrawing:
    """
    Draw an arm and its obstacles in several poses, with the path of its last body.

    Parameters
    ----------
    collision : CollisionModel
        Bodies of the arm, and obstacles; half spaces are not drawn.
    poses : ndarray, shape (K, n)
        Poses to draw [rad or m].
    captions : sequence of str, length K
        Text below each pose.
    path : ndarray, shape (N, n)
        Poses along the path of the last body [rad or m].

    """
    robot, solids = collision.robot, _solids(collision.robot, collision.geometry)
    last = max(solids, key=lambda solid: solid.joint)
    frames, along = (
        [_frames(robot.model, q) for q in robot.positions(some)] for some in (poses, path)
    )
    tips, track = (
        np.array([_flat(frame[last.joint].act(last.points.mean(axis=0))) for frame in some])
        for some in (frames, along)
    )
    strip = _Strip.of(solids, frames, (190.0, 230.0), track)

    def colour(solid: _Solid) -> str:
        share = round(100.0 * solid.joint / len(robot.links))
        along_arm = f'color-mix(in srgb, var(--residual) {share}%, var(--measured))'
        return along_arm if solid.of_arm else OBSTACLE

    return ArmDrawing(
        round(strip.pitch * len(poses), 1),
        round(strip.height + 30.0, 1),  # with a line of captions
        strip.bodies(colour),
        tuple(
            (*strip.place(tip, k).tolist(), 'var(--predicted)', '') for k, tip in enumerate(tips)
        ),
        tuple(svg_points(strip.place(track, pose)) for pose in range(len(poses))),
        tuple((round((k + 0.5) * strip.pitch, 1), text) for k, text in enumerate(captions)),
    )


def draw_arm(
    robot: Robot, marked: Sequence[str], q: FloatArray | None = None, label: str = ''
) -> ArmDrawing:
    """
    Draw an arm in one pose, by default the one with the largest visible area.

    Parameters
    ----------
    robot : Robot
        The arm.
    marked : sequence of str
        Joints that are coloured, with their bodies, and named.
    q : ndarray, shape (N, n), optional
        Recorded poses [rad or m]; by default the middle of the range.
    label : str
        Description of the drawing, for screen readers.

    """
    poses = [robot.positions(robot.middle_pose)]
    if q is not None and len(q):
        # candidate poses of a single drawing
        kept = np.linspace(0, len(q) - 1, min(12, len(q))).astype(np.intp)
        poses = list(robot.positions(q[kept]))
    tried = [_frames(robot.model, pose) for pose in poses]
    seen = [np.array([_flat(one.translation) for one in frames]) for frames in tried]
    frames = tried[int(np.argmax([np.prod(np.ptp(one, axis=0) + _MIN_SIZE) for one in seen]))]
    solids = _solids(robot, collision_geometry(robot)[0])
    strip = _Strip.of(solids, [frames], (300.0, 240.0))

    def colour(joint: int, other: str) -> str:
        chosen = joint > 0 and robot.moving[joint - 1] in marked
        return 'var(--predicted)' if chosen else other

    dots = [
        (*strip.place(_flat(frames[k].translation), 0).tolist(), dot, name)
        for k, name in enumerate(robot.moving, start=1)
        for dot in [colour(k, 'var(--measured)')]
    ]
    labels, y, line = [], 0.0, 16.0  # height of a line of text [px]
    for x, top, _, name in sorted(
        (one for one in dots if one[3] in marked), key=lambda one: one[1]
    ):
        y = max(top, y + line)
        labels.append((x, top, round(strip.pitch, 1), round(y, 1), name))
    letters = max((len(name) for *_, name in labels), default=0)
    return ArmDrawing(
        round(strip.pitch + 9.5 * letters, 1),  # a letter is 9.5 px wide
        round(max(strip.height, y + line), 1),
        strip.bodies(lambda solid: colour(solid.joint, 'var(--faint)')),
        tuple(sorted(dots, key=lambda one: one[3] in marked)),  # on top of the others
        labels=tuple(labels),
        gravity=bool(np.any(robot.gravity)),
        label=label,
    )


@dataclass(frozen=True)
class _Solid:
    """Body to draw: the hull of spheres around given points, in the frame of a joint."""

    joint: int
    of_arm: bool
    points: FloatArray
    radius: float

    def seen(self, frame: pin.SE3) -> tuple[FloatArray, float]:
        """Return the body's outline in the drawing plane, and its nearness to the viewer [m]."""
        points = self.points @ frame.rotation.T + frame.translation
        turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
        ring = max(self.radius, 1e-4) * np.column_stack([np.cos(turn), np.sin(turn)])
        seen = _flat(points)
        seen = seen[ConvexHull(seen).vertices] if len(seen) > _CIRCLE_CORNERS else seen
        cloud = (seen[:, np.newaxis] + ring).reshape(-1, 2)
        return cloud[ConvexHull(cloud).vertices], float((points @ _VIEW[2]).mean())


def _solids(robot: Robot, geometry: pin.GeometryModel) -> list[_Solid]:
    """Return collision bodies of an arm and its obstacles, and bars for links without a body."""
    solids = []
    for body in geometry.geometryObjects:
        shape = body.geometry
        if isinstance(shape, coal.Cylinder):
            turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
            rim = shape.radius * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
            up = np.array([0.0, 0.0, shape.halfLength])
            points, radius = np.concatenate([rim + up, rim - up]), 0.0
        else:
            points, radius = outline(shape)  # unbounded shapes have no points
        if len(points) and (radius > _MIN_SIZE or np.ptp(points, axis=0).max() > _MIN_SIZE):
            placed = points @ body.placement.rotation.T + body.placement.translation
            solids.append(_Solid(int(body.parentJoint), body.parentFrame > 0, placed, radius))
    drawn = {solid.joint for solid in solids}
    bars = [(k, end) for k, end in sticks(robot.model) if k not in drawn]
    # radius of a bar [m]
    return solids + [_Solid(k, True, np.stack([np.zeros(3), end]), 0.02) for k, end in bars]


def _frames(model: pin.Model, q: FloatArray) -> list[pin.SE3]:
    """Return all joint frames in a pose, rotated so that gravity points down."""
    data, upright = model.createData(), pin.SE3.Identity()
    pin.forwardKinematics(model, data, np.asarray(q, dtype=float))
    if np.any(model.gravity.linear):
        down = np.array([0.0, 0.0, -1.0])
        upright.rotation = pin.Quaternion.FromTwoVectors(model.gravity.linear, down).matrix()
    return [upright * placement for placement in data.oMi]


def _flat(points: FloatArray) -> FloatArray:
    """Project points, (..., 3), onto the drawing plane, (..., 2) [m]."""
    return np.asarray(points @ _VIEW[:2].T)


@dataclass(frozen=True)
class _Strip:
    """Picture frames of equal size side by side, one for each pose."""

    solids: Sequence[_Solid]
    frames: Sequence[list[pin.SE3]]
    left: float  # [m]
    top: float  # [m]
    pitch: float  # width of a picture frame [px]
    height: float  # [px]
    scale: float  # [px/m]

    @classmethod
    def of(
        cls,
        solids: Sequence[_Solid],
        frames: Sequence[list[pin.SE3]],
        room: tuple[float, float],
        *others: FloatArray,
    ) -> _Strip:
        """Return frames of at most a given size [px] that show all bodies and points."""
        hulls = [solid.seen(frame[solid.joint])[0] for frame in frames for solid in solids]
        points, margin = np.concatenate([*others, *hulls]), 0.03  # around a drawing [m]
        left, low = (points.min(axis=0) - margin).tolist()
        right, high = (points.max(axis=0) + margin).tolist()
        width, height = right - left, high - low
        scale = min(room[0] / width, room[1] / height)
        return cls(solids, frames, left, high, width * scale, height * scale, scale)

    def place(self, points: FloatArray, pose: int) -> FloatArray:
        """Convert points of the drawing plane, (..., 2) [m], to pixels in the frame of a pose."""
        right = pose * self.pitch + self.scale * (points[..., 0] - self.left)
        down = self.scale * (self.top - points[..., 1])
        return np.asarray(np.round(np.stack([right, down], axis=-1), 1))

    def bodies(self, colour: Callable[[_Solid], str]) -> tuple[tuple[str, str], ...]:
        """Return outline and colour of each body in each pose, sorted from far to near."""
        found = []
        for pose, frame in enumerate(self.frames):
            seen = [(solid, *solid.seen(frame[solid.joint])) for solid in self.solids]
            found += [
                (svg_points(self.place(hull, pose)), colour(solid))
                for solid, hull, _ in sorted(seen, key=lambda one: one[2])
            ]
        return tuple(found)


def svg_points(points: FloatArray) -> str:
    """Format points (K, 2) [px] as an SVG list of points."""
    return ' '.join(f'{x:.1f},{y:.1f}' for x, y in points)
