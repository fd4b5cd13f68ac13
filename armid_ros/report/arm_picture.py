# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An arm as sticks, from the side that shows most of it.

A body is drawn from its joint to the joints that it carries; the last one to beyond its centre of
mass. A joint that slides is drawn as the way from where it is fixed to where it is. Of some poses
and directions the one is taken in which the arm covers the largest area.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from armid_ros.motion import FloatArray
from armid_ros.report.strip import Camera
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

_HEIGHT, _WIDTH, _EDGE = 250.0, 340.0, 30.0
#: Names are so far above their joints, a line is so high, a letter about so wide [px].
_ABOVE, _LINE, _LETTER = 14.0, 14.0, 8.5
#: Half of the width of a line [px], and points of it that are held against a name.
_HALF, _SAMPLES = 4.5, 100
_VIEWS = tuple(Camera(float(azimuth), np.radians(14.0)) for azimuth in np.radians([-90, -55, -20]))
#: Poses that are tried, and how far the last body is drawn beyond its centre of mass.
_POSES, _BEYOND = 12, 2.0
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
        Where [px].
    name : str
        The joint.
    marked : bool
        Whether it is to be pointed out.
    label_x, label_y : float
        Where its name is written [px].
    anchor : str
        What of the name is there: 'start', 'middle' or 'end'.

    """

    x: float
    y: float
    name: str
    marked: bool
    label_x: float
    label_y: float
    anchor: str


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
    above : float
        How far names reach beyond the upper edge [px].

    """

    width: float
    height: float
    sticks: tuple[Stick, ...]
    dots: tuple[Dot, ...]
    base: tuple[float, float]
    above: float = 0.0


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
    seen = [_flat(robot, pose, view) for pose, view in product(poses, _VIEWS)]
    lines = max(seen, key=_area)
    points = lines.reshape(-1, 2)
    low, size = points.min(axis=0), np.maximum(np.ptp(points, axis=0), _SAME)
    scale = min((_WIDTH - 2 * _EDGE) / size[0], (_HEIGHT - 2 * _EDGE) / size[1])
    width = max(float(scale * size[0]), 0.6 * _WIDTH) + 2 * _EDGE
    left = (width - scale * size[0]) / 2.0

    def place(point: FloatArray) -> tuple[float, float]:
        x, y = scale * (point - low)
        return round(left + float(x), 1), round(_EDGE + float(scale * size[1] - y), 1)

    owners = [*_slides(robot), *(owner for owner, _, _ in _bodies(robot.model))]
    ways = [
        Stick(*place(line[0]), *place(line[1]), owner > 0 and robot.joints[owner - 1] in marked)
        for owner, line in zip(owners, lines, strict=True)
        if np.ptp(line, axis=0).max() > _SAME
    ]
    origins = {owner: line[0] for owner, line in zip(owners, lines, strict=True)}
    dots = _apart(
        [
            _dot(place(origins[k + 1]), name, name in marked, width)
            for k, name in enumerate(robot.joints)
        ],
        ways,
        width,
    )
    return ArmPicture(
        round(width, 1),
        round(float(scale * size[1]) + 2 * _EDGE, 1),
        tuple(sorted(ways, key=lambda way: way.marked)),
        tuple(sorted(dots, key=lambda dot: dot.marked)),
        place(origins[0]),
        round(
            max(0.0, _LINE - min((dot.label_y for dot in dots if dot.marked), default=_LINE)), 1
        ),
    )


def _middle(robot: Robot) -> FloatArray:
    """Return the pose in the middle of the range, zero where there is no end."""
    lower, upper = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
    ended = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 1e3)
    middle = np.zeros(len(lower))
    middle[ended] = (lower[ended] + upper[ended]) / 2.0
    return middle


def _bodies(model: pin.Model) -> list[tuple[int, FloatArray, FloatArray]]:
    """Return lines in the frames of the joints that carry them: joint, beginning and end."""
    nothing, lines = np.zeros(3), []
    for joint in range(model.njoints):
        carried = [k for k in range(1, model.njoints) if int(model.parents[k]) == joint]
        ends = [np.array(model.jointPlacements[k].translation) for k in carried]
        if joint and not ends:
            ends = [_BEYOND * np.array(model.inertias[joint].lever)]
        lines += [(joint, nothing, end) for end in ends]
    return lines


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
        [data.oMi[joint].act(start), data.oMi[joint].act(end)]
        for joint, start, end in _bodies(robot.model)
    ]
    return view.flat(np.array([*ways, *bodies]))


def _area(lines: FloatArray) -> float:
    return float(np.prod(np.ptp(lines.reshape(-1, 2), axis=0) + 1e-3))


def _dot(at: tuple[float, float], name: str, marked: bool, width: float) -> Dot:
    """Return a joint with its name above it, inside the drawing."""
    x, y = at
    side = 'start' if x < width / 4.0 else 'end' if x > 3.0 * width / 4.0 else 'middle'
    shift = {'start': -8.0, 'end': 8.0, 'middle': 0.0}[side]
    return Dot(x, y, name, marked, round(x + shift, 1), round(y - _ABOVE, 1), side)


def _apart(dots: Sequence[Dot], sticks: Sequence[Stick], width: float) -> list[Dot]:
    """Return joints with names where nothing else is; else above each other."""
    result: list[Dot] = []
    for dot in dots:
        free = next((one for one in _places(dot) if _free(one, result, sticks, width)), None)
        if free is not None:
            result.append(free)
            continue
        y = dot.label_y
        near = [other for other in result if other.marked and _one_above_other(other, dot)]
        while dot.marked and (over := [o.label_y for o in near if abs(o.label_y - y) < _LINE]):
            y = min(over) - _LINE
        result.append(replace(dot, label_y=round(y, 1)))
    return result


def _places(dot: Dot) -> Iterator[Dot]:
    """Yield where the name of a joint that is pointed out may be: above, beside or below it."""
    if not dot.marked:
        return
    yield dot
    level, below = round(dot.y + _LINE / 3.0, 1), round(dot.y + _ABOVE + _LINE, 1)
    yield replace(dot, label_x=round(dot.x + _ABOVE, 1), label_y=level, anchor='start')
    yield replace(dot, label_x=round(dot.x - _ABOVE, 1), label_y=level, anchor='end')
    yield replace(dot, label_y=below)


def _free(dot: Dot, others: Sequence[Dot], sticks: Sequence[Stick], width: float) -> bool:
    """Return whether a name is within the drawing, and over no line and no other name."""
    start, end = _reach(dot)
    if start < 0.0 or end > width:
        return False
    if any(
        other.marked and _one_above_other(other, dot) and abs(other.label_y - dot.label_y) < _LINE
        for other in others
    ):
        return False
    share = np.linspace(0.0, 1.0, _SAMPLES)
    for stick in sticks:
        x = stick.x1 + share * (stick.x2 - stick.x1)
        y = stick.y1 + share * (stick.y2 - stick.y1)
        beside = (x > start - _HALF) & (x < end + _HALF)
        if np.any(beside & (y > dot.label_y - _LINE) & (y < dot.label_y + 2.0 * _HALF)):
            return False
    return True


def _one_above_other(one: Dot, other: Dot) -> bool:
    """Return whether two names would be printed over one another on one line."""
    (left, right), (start, end) = _reach(one), _reach(other)
    return left < end and start < right


def _reach(dot: Dot) -> tuple[float, float]:
    """Return from where to where a name is written [px]."""
    length = _LETTER * len(dot.name)
    start = dot.label_x - {'start': 0.0, 'middle': length / 2.0, 'end': length}[dot.anchor]
    return start, start + length
