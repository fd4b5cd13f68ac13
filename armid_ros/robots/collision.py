# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Distances between the links of a robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from armid_ros.errors import RobotError
from armid_ros.files import read_text, reading
from armid_ros.robots.description import parse_xml
from armid_ros.robots.geometry import collision_geometry
from armid_ros.robots.robot import Robot
import numpy as np
import pinocchio as pin


@dataclass(frozen=True, eq=False)
class CollisionModel:
    """
    The collision bodies of a robot and the pairs of them that are checked.

    Attributes
    ----------
    robot : Robot
        The robot.
    geometry : pinocchio.GeometryModel
        Collision bodies and pairs; never changed.
    notes : tuple of str
        Sentences on bodies that are left out and pairs that are not checked.
    left_out : tuple of str
        Links with a body that was left out, because its mesh was not found.
    touching : tuple of (str, str)
        Pairs of links that are not checked, because they touch at zero.
    excluded : str
        Name of the SRDF and the number of pairs of links that it excludes; empty without an SRDF.

    """

    robot: Robot
    geometry: pin.GeometryModel = field(repr=False)
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    touching: tuple[tuple[str, str], ...] = ()
    excluded: str = ''

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Pairs of links that are checked, each once, in alphabetical order."""
        numbers = range(len(self.geometry.collisionPairs))
        return tuple(sorted({_links(self.robot, self.geometry, number) for number in numbers}))


def collision_model(
    robot: Robot, *, progress: Callable[[float], None] | None = None
) -> CollisionModel:
    """
    Return the collision bodies of a robot and the pairs of links that are checked.

    Four kinds of pairs are not checked: links that cannot move against each other, links joined by
    a joint, pairs that one joint moves and that touch nowhere in its range, and pairs that the
    SRDF disables. The SRDF is looked for beside the URDF and in ../srdf: the file with the name of
    the URDF or of the robot, or the only file. Without an SRDF, pairs that touch at zero (or at
    the limits nearest to zero) are left out and noted, because their collision bodies are drawn
    too large.

    Parameters
    ----------
    robot : Robot
        The robot.
    progress : callable, optional
        Called with the share of the work done, 0 to 1, while meshes are converted to convex
        bodies.

    Raises
    ------
    RobotError
        If a file cannot be read or a collision body is not valid.

    """
    geometry, missing = collision_geometry(robot, progress)
    path, disabled = _find_srdf(robot), set[frozenset[str]]()
    if path is not None:
        with reading(path, RobotError):
            elements = parse_xml(read_text(path, RobotError)).iter('disable_collisions')
            disabled = {frozenset((e.get('link1', ''), e.get('link2', ''))) for e in elements}
    description = robot.description
    joined = {frozenset((joint.parent, joint.child)) for joint in description.joints}
    bodies, excluded = list(geometry.geometryObjects), set[frozenset[str]]()
    for (i, first), (j, second) in combinations(enumerate(bodies), 2):
        links = frozenset((_link(robot, first), _link(robot, second)))
        if first.parentJoint == second.parentJoint or links in joined:
            continue
        if links in disabled:
            excluded.add(links)
        else:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
    touching = () if disabled else _leave_out_touching(robot, geometry)
    _leave_out_separate(robot, geometry)
    doubts = (
        f"links '{first}' and '{second}' touch at zero and there is no SRDF; not checked"
        for first, second in touching
    )
    notes = (*missing.values(), *doubts)
    by_file = '' if path is None else f'{path.name} excludes {len(excluded)} pairs of links'
    return CollisionModel(robot, geometry, notes, tuple(missing), touching, by_file)


def _leave_out_touching(robot: Robot, geometry: pin.GeometryModel) -> tuple[tuple[str, str], ...]:
    """Remove the pairs of links that touch at zero; return these pairs in alphabetical order."""
    data, placed = robot.model.createData(), geometry.createData()
    pin.computeDistances(robot.model, data, geometry, placed, robot.zero_pose)
    touching = {
        _links(robot, geometry, number)
        for number, result in enumerate(placed.distanceResults)
        if result.min_distance <= 0.0
    }
    numbers = range(len(geometry.collisionPairs))
    _keep(geometry, [n for n in numbers if _links(robot, geometry, n) not in touching])
    return tuple(sorted(touching))


def _leave_out_separate(robot: Robot, geometry: pin.GeometryModel) -> None:
    """Remove pairs that one joint moves and that never touch, such as flange and wrist."""
    data, placed = robot.model.createData(), geometry.createData()
    by_joint: dict[int, list[int]] = {}
    for number, pair in enumerate(geometry.collisionPairs):
        bodies = (geometry.geometryObjects[pair.first], geometry.geometryObjects[pair.second])
        inner, outer = sorted(body.parentJoint for body in bodies)
        if robot.model.parents[outer] == inner:
            by_joint.setdefault(outer, []).append(number)
    separate = set()
    for joint, numbers in by_joint.items():
        closest = np.full(len(numbers), np.inf)
        span = 1.0 if robot.prismatic[joint - 1] else np.pi
        first, last = np.clip((robot.lower[joint - 1], robot.upper[joint - 1]), -span, span)
        # every 5 deg of a full turn
        for position in np.linspace(first, last, 73):
            pose = robot.zero_pose
            pose[joint - 1] = position
            pin.updateGeometryPlacements(robot.model, data, geometry, placed, pose)
            distances = [pin.computeDistance(geometry, placed, n).min_distance for n in numbers]
            closest = np.minimum(closest, distances)
        separate |= {n for n, distance in zip(numbers, closest, strict=True) if distance > 0.0}
    _keep(geometry, [n for n in range(len(geometry.collisionPairs)) if n not in separate])


def _keep(geometry: pin.GeometryModel, numbers: list[int]) -> None:
    kept = [geometry.collisionPairs[number] for number in numbers]
    pairs = [pin.CollisionPair(pair.first, pair.second) for pair in kept]
    geometry.removeAllCollisionPairs()
    for pair in pairs:
        geometry.addCollisionPair(pair)


def _links(robot: Robot, geometry: pin.GeometryModel, pair: int) -> tuple[str, str]:
    """Links of a pair, in alphabetical order."""
    bodies = geometry.collisionPairs[pair]
    first, second = sorted(
        _link(robot, geometry.geometryObjects[number]) for number in (bodies.first, bodies.second)
    )
    return first, second


def _link(robot: Robot, body: pin.GeometryObject) -> str:
    return str(robot.model.frames[body.parentFrame].name)


def _find_srdf(robot: Robot) -> Path | None:
    if robot.path is None:
        return None
    stem = robot.path.name.removesuffix('.xacro').removesuffix('.urdf')
    for directory in (robot.path.parent, robot.path.parent.parent / 'srdf'):
        present = sorted(directory.glob('*.srdf'))
        for path in present:
            if path.stem in (stem, robot.name):
                return path
        if len(present) == 1:
            return present[0]
    return None
