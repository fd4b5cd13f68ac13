# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An arm as sticks, from the side that shows most of it.

A body is drawn from its joint to the joints that it carries; the last one to beyond its centre of
mass. A joint that slides is drawn from where it is fixed to where it is. Of some poses and
directions the one is taken in which the arm covers the largest area. Names stand in a column at
the right, with a line from each to its joint.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from armid_ros.motion import FloatArray
from armid_ros.report.strip import Camera
from armid_ros.robots import Robot
from armid_ros.robots.sticks import sticks
import numpy as np
import pinocchio as pin

_HEIGHT, _WIDTH, _EDGE = 250.0, 340.0, 30.0
#: Height of a line of text and width of a letter [px].
_LINE, _LETTER = 16.0, 8.5
_VIEWS = tuple(Camera(float(azimuth), np.radians(14.0)) for azimuth in np.radians([-90, -55, -20]))
#: Length of the arrow of gravity [px].
_ARROW = 26.0
#: Poses that are tried.
_POSES = 12
#: Points nearer to each other than this are one [m].
_SAME = 1e-4


@dataclass(frozen=True)
class Stick:
    """
    A line of the drawing.

    Attributes
    ----------
    x1, y1, x2, y2 : float
        Ends [px].
    marked : bool
        Whether it is of a body to be pointed out.

    """

    x1: float
    y1: float
    x2: float
    y2: float
    marked: bool


@dataclass(frozen=True)
class Dot:
    """
    A joint of the drawing.

    Attributes
    ----------
    x, y : float
        Position [px].
    name : str
        The joint.
    marked : bool
        Whether it is to be pointed out.

    """

    x: float
    y: float
    name: str
    marked: bool


@dataclass(frozen=True)
class ArmPicture:
    """
    The drawing.

    Attributes
    ----------
    width, height : float
        [px].
    sticks : tuple of Stick
        Bodies, those to be pointed out last.
    dots : tuple of Dot
        Joints, those to be pointed out last.
    base : tuple of float
        Where the arm is fixed [px].
    labels : tuple of (Dot, float, float)
        Joints to be pointed out, and where the name of each begins [px].
    gravity : tuple of float
        Direction of gravity in the picture [px]; zero without gravity.

    """

    width: float
    height: float
    sticks: tuple[Stick, ...]
    dots: tuple[Dot, ...]
    base: tuple[float, float]
    labels: tuple[tuple[Dot, float, float], ...]
    gravity: tuple[float, float]


def draw_arm(robot: Robot, marked: Sequence[str], q: FloatArray | None = None) -> ArmPicture:
    """
    Draw an arm.

    Parameters
    ----------
    robot : Robot
        The arm.
    marked : sequence of str
        Joints to be pointed out, each with its body.
    q : ndarray, shape (N, n), optional
        Poses that it was in; the middle of its range by default [rad or m].

    """
    poses = [_middle(robot)]
    if q is not None and len(q):
        chosen = np.linspace(0, len(q) - 1, min(_POSES, len(q))).astype(np.intp)
        poses = list(q[chosen])
    seen = [(_flat(robot, pose, view), view) for pose, view in product(poses, _VIEWS)]
    size_of = [np.prod(np.ptp(flat.reshape(-1, 2), axis=0) + 1e-3) for flat, _ in seen]
    lines, view = seen[int(np.argmax(size_of))]
    down = view.flat(robot.gravity / max(float(np.linalg.norm(robot.gravity)), _SAME))
    points = lines.reshape(-1, 2)
    low, size = points.min(axis=0), np.maximum(np.ptp(points, axis=0), _SAME)
    scale = min((_WIDTH - 2 * _EDGE) / size[0], (_HEIGHT - 2 * _EDGE) / size[1])
    width = max(float(scale * size[0]), 0.6 * _WIDTH) + 2 * _EDGE
    left = (width - scale * size[0]) / 2.0

    def place(point: FloatArray) -> tuple[float, float]:
        x, y = scale * (point - low)
        return round(left + float(x), 1), round(_EDGE + float(scale * size[1] - y), 1)

    owners = [*_slides(robot), *(owner for owner, _ in sticks(robot.model))]
    ways = [
        Stick(*place(line[0]), *place(line[1]), owner > 0 and robot.joints[owner - 1] in marked)
        for owner, line in zip(owners, lines, strict=True)
        if np.ptp(line, axis=0).max() > _SAME
    ]
    origins = {owner: line[0] for owner, line in zip(owners, lines, strict=True)}
    dots = [
        Dot(*place(origins[k + 1]), name, name in marked) for k, name in enumerate(robot.joints)
    ]
    height = float(scale * size[1]) + 2 * _EDGE
    named = sorted((dot for dot in dots if dot.marked), key=lambda dot: dot.y)
    lines_at = _spread([dot.y for dot in named])
    letters = max((len(dot.name) for dot in named), default=0)
    return ArmPicture(
        round(width + _LETTER * letters, 1),
        round(max([height, *(y + _LINE for y in lines_at)]), 1),
        tuple(sorted(ways, key=lambda way: way.marked)),
        tuple(sorted(dots, key=lambda dot: dot.marked)),
        place(origins[0]),
        tuple((dot, round(width, 1), y) for dot, y in zip(named, lines_at, strict=True)),
        (round(_ARROW * float(down[0]), 1), round(-_ARROW * float(down[1]), 1)),
    )


def _spread(heights: Sequence[float]) -> list[float]:
    """Return heights in order, at least a line of text apart."""
    apart: list[float] = []
    for y in heights:
        apart.append(max(y, apart[-1] + _LINE) if apart else y)
    return apart


def _middle(robot: Robot) -> FloatArray:
    """Return the pose in the middle of the range, zero where there is no end."""
    lower, upper = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
    ended = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 1e3)
    middle = np.zeros(len(lower))
    middle[ended] = (lower[ended] + upper[ended]) / 2.0
    return middle


def _slides(robot: Robot) -> list[int]:
    """Return the joints that slide, as the model counts them."""
    return [k for k, slides in enumerate(robot.prismatic, start=1) if slides]


def _flat(robot: Robot, q: FloatArray, view: Camera) -> FloatArray:
    """Return the ways of joints that slide and all bodies as they are seen, (L, 2, 2) [m]."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, np.asarray(q, dtype=float))
    model = robot.model
    ways = [
        [
            data.oMi[model.parents[k]].act(model.jointPlacements[k].translation),
            data.oMi[k].translation,
        ]
        for k in _slides(robot)
    ]
    bodies = [
        [data.oMi[joint].translation, data.oMi[joint].act(end)]
        for joint, end in sticks(robot.model)
    ]
    return view.flat(np.array([*ways, *bodies]))
