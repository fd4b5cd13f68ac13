# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Drawings of an arm: outlines of its bodies from a corner, or bars from joint to joint.

A bar is drawn from a joint to the joints that it carries; the last one to beyond its centre of
mass. A joint that slides is drawn from where it is fixed to where it is.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from armid_ros.excitation.geometry.capsules import outline
from armid_ros.motion import FloatArray
from armid_ros.report.page import render
from armid_ros.report.strip import Camera, CORNER, Strip, svg_points
from armid_ros.robots import CollisionModel, Robot
from armid_ros.robots.sticks import sticks
import coal
from markupsafe import Markup
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

#: Size of one pose of a strip and of a single drawing [px], and space around it [m].
_POSE, _SINGLE, _MARGIN = (190.0, 230.0), (280.0, 220.0), 0.03
#: Corners of the outline of a ball.
_ROUND = 16
#: Radius of a bar in a strip [m], and as a share of the size of a single drawing.
_BAR, _BAR_SHARE = 0.02, 0.022
#: Colour of what stands around the arm.
OBSTACLE = 'var(--line)'
#: What is smaller stands for a link without a body and cannot be seen [m].
_POINT = 1e-3
#: Height of a line of text, width of a letter, length of the arrow of gravity [px].
_LINE, _LETTER, _ARROW = 16.0, 8.5, 26.0
#: Directions that a single drawing is tried from, and poses that are tried.
_VIEWS = tuple(Camera(float(azimuth), np.radians(14.0)) for azimuth in np.radians([-90, -55, -20]))
_POSES = 12
#: Joint range beyond which a joint counts as endless [rad or m].
_ENDLESS = 1e3


@dataclass(frozen=True)
class ArmDrawing:
    """
    A drawing of one pose or of several side by side.

    Attributes
    ----------
    width, height : float
        [px].
    bodies : tuple of (str, str)
        Outline of each body as coordinates of SVG, far ones first, and its colour.
    paths : tuple of str
        Way of the last body in each pose.
    dots : tuple of (float, float, str, str)
        Place, colour and name of joints, or of the last body in each pose [px].
    captions : tuple of (float, str)
        Where each pose is, and when.
    labels : tuple of (float, float, float, float, str)
        A line from a joint to its name, and the name [px].
    gravity : tuple of float
        Direction of gravity [px]; zero for none.
    label : str
        The drawing in words.

    """

    width: float
    height: float
    bodies: tuple[tuple[str, str], ...]
    dots: tuple[tuple[float, float, str, str], ...]
    paths: tuple[str, ...] = ()
    captions: tuple[tuple[float, str], ...] = ()
    labels: tuple[tuple[float, float, float, float, str], ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)
    label: str = 'Poses of the arm'

    def html(self) -> Markup:
        """Return the drawing as SVG."""
        return render('arm_drawing.html', {'drawing': self})


def draw_poses(
    collision: CollisionModel, poses: FloatArray, captions: Sequence[str], way: FloatArray
) -> ArmDrawing:
    """
    Draw an arm and what stands around it in several poses.

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
    solids, model = _solids(collision), collision.robot.model
    frames = [_frames(model, q) for q in poses]
    seen = [
        [(_outline(frame[s.joint], s.points, s.radius, CORNER), s) for s in solids]
        for frame in frames
    ]
    last = max(solids, key=lambda solid: solid.joint)
    middle = last.points.mean(axis=0)
    track = np.array([CORNER.flat(_frames(model, q)[last.joint].act(middle)) for q in way])
    every = np.concatenate([track, *(hull for pose in seen for (hull, _), _ in pose)])
    size = np.ptp(every, axis=0) + 2.0 * _MARGIN
    scale = float(min(_POSE[0] / size[0], _POSE[1] / size[1]))
    strip = Strip.around(every, len(poses), _MARGIN, scale)
    bodies = []
    for pose, own in enumerate(seen):
        for (hull, _), solid in sorted(own, key=lambda one: one[0][1]):
            share = round(100.0 * solid.joint / collision.robot.n_joints)
            colour = f'color-mix(in srgb, var(--residual) {share}%, var(--measured))'
            bodies.append(
                (svg_points(strip.place(hull, pose)), colour if solid.of_arm else OBSTACLE)
            )
    tips = [CORNER.flat(frame[last.joint].act(middle)) for frame in frames]
    return ArmDrawing(
        *strip.size,
        tuple(bodies),
        tuple(
            (*_placed(strip, tip, pose), 'var(--predicted)', '') for pose, tip in enumerate(tips)
        ),
        tuple(svg_points(strip.place(track, pose)) for pose in range(len(poses))),
        strip.captions(captions),
    )


def draw_arm(
    robot: Robot, marked: Sequence[str], q: FloatArray | None = None, label: str = ''
) -> ArmDrawing:
    """
    Draw an arm as bars, in the pose and from the side that show most of it.

    Parameters
    ----------
    robot : Robot
        The arm.
    marked : sequence of str
        Joints to be coloured, each with its body, and to be named.
    q : ndarray, shape (N, n), optional
        Poses that it was in; the middle of its range by default [rad or m].
    label : str
        The drawing in words.

    """
    poses = [_middle(robot)]
    if q is not None and len(q):
        poses = list(q[np.linspace(0, len(q) - 1, min(_POSES, len(q))).astype(np.intp)])
    tried = [(_bars(robot, pose), view) for pose, view in product(poses, _VIEWS)]
    areas = [
        np.prod(np.ptp(view.flat(ends).reshape(-1, 2), axis=0) + _POINT)
        for (_, ends), view in tried
    ]
    (owners, ends), view = tried[int(np.argmax(areas))]
    flat = view.flat(ends).reshape(-1, 2)
    size = np.maximum(np.ptp(flat, axis=0), _POINT)
    scale = float(min(_SINGLE[0] / size[0], _SINGLE[1] / size[1]))
    strip = Strip.around(flat, 1, _LINE / scale, scale)
    origins = {owner: end[0] for owner, end in zip(owners, ends, strict=True)}
    colours = {True: 'var(--predicted)', False: 'var(--faint)'}
    bodies = []
    for owner, end in zip(owners, ends, strict=True):
        if np.ptp(end, axis=0).max() > _POINT:
            hull, near = _outline(pin.SE3.Identity(), end, _BAR_SHARE * float(size.max()), view)
            chosen = owner > 0 and robot.joints[owner - 1] in marked
            bodies.append((chosen, near, svg_points(strip.place(hull, 0)), colours[chosen]))
    dots = [
        (*_placed(strip, view.flat(origins[k + 1]), 0), name)
        for k, name in enumerate(robot.joints)
    ]
    width, height = strip.pitch, strip.height
    labels, y = [], 0.0
    for x, top, name in sorted((dot for dot in dots if dot[2] in marked), key=lambda dot: dot[1]):
        y = max(top, y + _LINE)
        labels.append((x, top, round(width, 1), round(y, 1), name))
    letters = max((len(name) for *_, name in labels), default=0)
    down = view.flat(robot.gravity / max(float(np.linalg.norm(robot.gravity)), _POINT))
    return ArmDrawing(
        round(width + _LETTER * letters, 1),
        round(max(height, y + _LINE), 1),
        tuple((points, colour) for *_, points, colour in sorted(bodies)),
        tuple(
            (x, top, 'var(--predicted)' if name in marked else 'var(--measured)', name)
            for x, top, name in sorted(dots, key=lambda dot: dot[2] in marked)
        ),
        labels=tuple(labels),
        gravity=(round(_ARROW * float(down[0]), 1), round(-_ARROW * float(down[1]), 1)),
        label=label,
    )


def _placed(strip: Strip, point: FloatArray, pose: int) -> tuple[float, float]:
    x, y = strip.place(point, pose)
    return round(float(x), 1), round(float(y), 1)


def _outline(
    frame: pin.SE3, points: FloatArray, radius: float, view: Camera
) -> tuple[FloatArray, float]:
    """Return the outline of all points within a radius of some, (K, 2) [m], and its nearness."""
    placed = points @ frame.rotation.T + frame.translation
    turn = np.linspace(0.0, 2.0 * np.pi, _ROUND, endpoint=False)
    ring = max(radius, 1e-4) * np.column_stack([np.cos(turn), np.sin(turn)])
    flat = view.flat(placed)
    flat = flat[ConvexHull(flat).vertices] if len(flat) > 16 else flat
    cloud = (flat[:, np.newaxis] + ring).reshape(-1, 2)
    return cloud[ConvexHull(cloud).vertices], float(view.near(placed).mean())


@dataclass(frozen=True)
class _Solid:
    """A body: all points within a radius of some, in the frame of a joint of the model."""

    joint: int
    of_arm: bool
    points: FloatArray
    radius: float


def _solids(collision: CollisionModel) -> list[_Solid]:
    """Return the bodies of an arm and of what is around it; bars for an arm without bodies."""
    solids = []
    for body in collision.geometry.geometryObjects:
        shape = body.geometry
        if isinstance(shape, coal.Cylinder):
            turn = np.linspace(0.0, 2.0 * np.pi, _ROUND, endpoint=False)
            rim = shape.radius * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
            up = np.array([0.0, 0.0, shape.halfLength])
            points, radius = np.concatenate([rim + up, rim - up]), 0.0
        else:
            points, radius = outline(shape)  # no points if it is endless
        if len(points) and (radius > _POINT or np.ptp(points, axis=0).max() > _POINT):
            placed = points @ body.placement.rotation.T + body.placement.translation
            solids.append(_Solid(int(body.parentJoint), body.parentFrame > 0, placed, radius))
    if any(solid.joint > 0 for solid in solids):
        return solids
    bars = sticks(collision.robot.model)
    return solids + [_Solid(k, True, np.stack([np.zeros(3), end]), _BAR) for k, end in bars]


def _frames(model: pin.Model, q: FloatArray) -> list[pin.SE3]:
    """Return where the joints of a model are in a pose."""
    data = model.createData()
    pin.forwardKinematics(model, data, np.asarray(q, dtype=float))
    return [pin.SE3(placement) for placement in data.oMi]


def _bars(robot: Robot, q: FloatArray) -> tuple[list[int], FloatArray]:
    """Return the joint of each bar, and its ends (L, 2, 3) [m]; those of sliding joints first."""
    model, frames = robot.model, _frames(robot.model, q)
    slides = [k for k, slides in enumerate(robot.prismatic, start=1) if slides]
    ways = [
        [frames[model.parents[k]].act(model.jointPlacements[k].translation), frames[k].translation]
        for k in slides
    ]
    bars = sticks(model)
    bodies = [[frames[joint].translation, frames[joint].act(end)] for joint, end in bars]
    return [*slides, *(joint for joint, _ in bars)], np.array([*ways, *bodies])


def _middle(robot: Robot) -> FloatArray:
    """Return the pose in the middle of the range, zero where there is no end."""
    lower, upper = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
    ended = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < _ENDLESS)
    return np.where(ended, (np.where(ended, lower, 0.0) + np.where(ended, upper, 0.0)) / 2.0, 0.0)
