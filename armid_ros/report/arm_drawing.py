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
    Drawing of an arm in one pose, as SVG elements.

    Attributes
    ----------
    width, height : float
        Size of the drawing [px].
    bodies : tuple of (str, str)
        Outline of each body as coordinates of SVG, far ones first, and its colour.
    dots : tuple of (float, float, str, str)
        Position [px], colour and name of joints, or of the last body without a name.
    path : str
        Path of the last body, as coordinates of SVG; empty for none.
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
    path: str = ''
    labels: tuple[tuple[float, float, float, float, str], ...] = ()
    gravity: bool = False
    label: str = 'Pose of the arm'


def draw_poses(collision: CollisionModel, poses: FloatArray, path: FloatArray) -> list[ArmDrawing]:
    """
    Draw an arm and its obstacles, once for each of K poses, with the path of its last body.

    Parameters
    ----------
    collision : CollisionModel
        Bodies of the arm, and obstacles; half spaces are not drawn.
    poses : ndarray, shape (K, n)
        Poses to draw [rad or m].
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
    pictures = [_picture(solids, frame) for frame in frames]
    hulls = [hull for picture in pictures for hull, _ in picture]
    canvas = _Canvas.around([track, *hulls], (190.0, 230.0))

    def colour(solid: _Solid) -> str:
        share = round(100.0 * solid.joint / len(robot.links))
        along_arm = f'color-mix(in srgb, var(--residual) {share}%, var(--measured))'
        return along_arm if solid.of_arm else OBSTACLE

    return [
        ArmDrawing(
            round(canvas.width, 1),
            round(canvas.height, 1),
            canvas.bodies(picture, colour),
            ((*canvas.place(tip).tolist(), 'var(--predicted)', ''),),
            canvas.svg(track),
        )
        for picture, tip in zip(pictures, tips, strict=True)
    ]


def draw_arm(
    robot: Robot, marked: Sequence[str], q: FloatArray | None = None, label: str = ''
) -> ArmDrawing:
    """
    Draw an arm in the pose of `q` with the largest visible area; without `q`, in mid-range.

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
    best = int(np.argmax([np.prod(np.ptp(one, axis=0) + _MIN_SIZE) for one in seen]))
    picture = _picture(_solids(robot, collision_geometry(robot)[0]), tried[best])
    canvas = _Canvas.around([hull for hull, _ in picture], (300.0, 240.0))

    def colour(joint: int, other: str) -> str:
        chosen = joint > 0 and robot.moving[joint - 1] in marked
        return 'var(--predicted)' if chosen else other

    dots = [
        (*canvas.place(seen[best][k]).tolist(), colour(k, 'var(--measured)'), name)
        for k, name in enumerate(robot.moving, start=1)
    ]
    labels, y, line = [], 0.0, 16.0  # height of a line of text [px]
    for x, top, _, name in sorted(
        (one for one in dots if one[3] in marked), key=lambda one: one[1]
    ):
        y = max(top, y + line)
        labels.append((x, top, round(canvas.width, 1), round(y, 1), name))
    letters = max((len(name) for *_, name in labels), default=0)
    return ArmDrawing(
        round(canvas.width + 9.5 * letters, 1),  # a letter is 9.5 px wide
        round(max(canvas.height, y + line), 1),
        canvas.bodies(picture, lambda solid: colour(solid.joint, 'var(--faint)')),
        tuple(sorted(dots, key=lambda one: one[3] in marked)),  # on top of the others
        labels=tuple(labels),
        gravity=bool(np.any(robot.gravity)),
        label=label,
    )


@dataclass(frozen=True)
class _Solid:
    """Body to draw: convex hull of equal spheres around points in the frame of a joint."""

    joint: int
    of_arm: bool
    points: FloatArray
    radius: float

    def seen(self, frame: pin.SE3) -> tuple[FloatArray, float]:
        """Return the outline in the drawing plane (K, 2), and the depth towards the viewer [m]."""
        points = self.points @ frame.rotation.T + frame.translation
        turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
        ring = max(self.radius, 1e-4) * np.column_stack([np.cos(turn), np.sin(turn)])
        seen = _flat(points)
        seen = seen[ConvexHull(seen).vertices] if len(seen) > _CIRCLE_CORNERS else seen
        cloud = (seen[:, np.newaxis] + ring).reshape(-1, 2)
        return cloud[ConvexHull(cloud).vertices], float((points @ _VIEW[2]).mean())


def _solids(robot: Robot, geometry: pin.GeometryModel) -> list[_Solid]:
    """Return the bodies to draw: collision bodies, and bars for links without such a body."""
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


#: Outline of each body in the drawing plane, and the body; far ones first.
_Picture = list[tuple[FloatArray, _Solid]]


def _picture(solids: Sequence[_Solid], frames: Sequence[pin.SE3]) -> _Picture:
    """Return the outlines of all bodies, the farthest first, given the frames of all joints."""
    seen = [(*solid.seen(frames[solid.joint]), solid) for solid in solids]
    return [(hull, solid) for hull, _, solid in sorted(seen, key=lambda one: one[1])]


@dataclass(frozen=True)
class _Canvas:
    """Map from the drawing plane [m] to pixels."""

    left: float  # [m]
    top: float  # [m]
    width: float  # [px]
    height: float  # [px]
    scale: float  # [px/m]

    @classmethod
    def around(cls, shapes: Sequence[FloatArray], room: tuple[float, float]) -> _Canvas:
        """Return a canvas of at most the size `room` [px] that contains all points of shapes."""
        points, margin = np.concatenate(shapes), 0.03  # around a drawing [m]
        left, low = (points.min(axis=0) - margin).tolist()
        right, high = (points.max(axis=0) + margin).tolist()
        width, height = right - left, high - low
        scale = min(room[0] / width, room[1] / height)
        return cls(left, high, width * scale, height * scale, scale)

    def place(self, points: FloatArray) -> FloatArray:
        """Convert points of the drawing plane, (..., 2) [m], to pixels."""
        from_corner = np.stack([points[..., 0] - self.left, self.top - points[..., 1]], axis=-1)
        return np.asarray(np.round(self.scale * from_corner, 1))

    def svg(self, points: FloatArray) -> str:
        """Format points of the drawing plane, (K, 2) [m], as an SVG list of points."""
        return ' '.join(f'{x:.1f},{y:.1f}' for x, y in self.place(points))

    def bodies(
        self, picture: _Picture, colour: Callable[[_Solid], str]
    ) -> tuple[tuple[str, str], ...]:
        """Return SVG outline and colour of each body of a picture."""
        return tuple((self.svg(hull), colour(solid)) for hull, solid in picture)
