# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Visual and collision shapes of a URDF, and the pairs of bodies whose distance is checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Literal, NamedTuple
from xml.etree import ElementTree

from armid_ros.errors import RobotError
from armid_ros.files import read_text, reading
from armid_ros.motion import FloatArray
from armid_ros.robots.description import parse_xml
from armid_ros.robots.meshes import convex_bodies, find_mesh
from armid_ros.robots.robot import description_name, Robot
from armid_ros.robots.xacro_expansion import package_folders
import coal
import numpy as np
import pinocchio as pin

Tag = Literal['visual', 'collision']
Progress = Callable[[float], None]
_Meshes = dict[tuple[Path, tuple[float, ...]], tuple[coal.CollisionGeometry, ...]]
#: Attributes of each kind of shape, with a default if there is one.
_SHAPE_ATTRIBUTES = {
    'box': ('size',),
    'sphere': ('radius',),
    'cylinder': ('radius', 'length'),
    'capsule': ('radius', 'length'),
    'mesh': ('scale',),
}
_BODIES = {
    'box': coal.Box,
    'sphere': coal.Sphere,
    'cylinder': coal.Cylinder,
    'capsule': coal.Capsule,
}


class LinkShape(NamedTuple):
    """
    Geometric shape in a <visual> or <collision> element of a link.

    Attributes
    ----------
    link : str
        The link.
    frame : int
        Frame of the link in the model.
    number : int
        Number of the shape within the link.
    placement : pinocchio.SE3
        Placement in the frame of the joint that carries the shape.
    kind : {'box', 'sphere', 'cylinder', 'capsule', 'mesh'}
        Kind of the shape.
    size : tuple of float
        Edges of a box [m], radius and length of a sphere, cylinder or capsule [m], or scale of a
        mesh.
    mesh : str
        File name of the mesh as written in the URDF; empty for other kinds.
    path : Path or None
        Path of the mesh file; None if the file is not found.

    """

    link: str
    frame: int
    number: int
    placement: pin.SE3
    kind: str
    size: tuple[float, ...]
    mesh: str = ''
    path: Path | None = None


def shapes_of(
    robot: Robot, tag: Tag, other: Tag | None = None, progress: Progress | None = None
) -> Iterator[LinkShape]:
    """
    Yield the visual or the collision shapes of all links of a robot.

    Parameters
    ----------
    robot : Robot
        The robot.
    tag : {'visual', 'collision'}
        Kind of the shapes.
    other : {'visual', 'collision'}, optional
        Kind of the shapes of links that have no shape of the kind `tag`.
    progress : callable, optional
        Called with the share of the links done, 0 to 1.

    Raises
    ------
    RobotError
        If a shape has no geometry, or a value is not a number.

    """
    frames = {
        frame.name: index
        for index, frame in enumerate(robot.model.frames)
        if frame.type == pin.FrameType.BODY
    }
    links = parse_xml(robot.urdf).findall('link')
    folders = cache(lambda name, urdf: tuple(package_folders(name, urdf)))
    for done, link in enumerate(links):
        if progress is not None:
            progress(done / len(links))
        name = link.get('name', '')
        frame = robot.model.frames[frames[name]]
        for number, element in enumerate(link.findall(tag) or link.findall(other or tag)):
            try:
                origin = getattr(element.find('origin'), 'attrib', {})
                rotation = pin.rpy.rpyToMatrix(*_numbers(origin.get('rpy', '0 0 0')))
                place = pin.SE3(rotation, np.array(_numbers(origin.get('xyz', '0 0 0'))))
                placement = frame.placement * place
                kind, size, mesh = _geometry(element)
            except (TypeError, ValueError):
                raise RobotError(
                    f"{robot.name}: <{element.tag}> {number + 1} of link '{name}' has to be a "
                    'box, sphere, cylinder, capsule or mesh with numbers as dimensions'
                ) from None
            path = find_mesh(mesh, robot.path, folders) if kind == 'mesh' else None
            yield LinkShape(name, frames[name], number, placement, kind, size, mesh, path)


def collision_geometry(
    robot: Robot, progress: Progress | None = None, other: Tag = 'collision'
) -> tuple[pin.GeometryModel, dict[str, str]]:
    """
    Return the collision bodies of a robot, with notes on links whose mesh file is missing.

    Boxes, spheres, cylinders and capsules are exact. A mesh is replaced by convex bodies that
    contain the mesh. A mesh that is not found is left out and noted.

    Returns
    -------
    geometry : pinocchio.GeometryModel
        The bodies, without collision pairs.
    notes : dict of str to str
        Links whose mesh was not found, each with a note on it.

    Raises
    ------
    RobotError
        If a <collision> has no geometry, a value is not a number, or a mesh cannot be read.

    """
    geometry = pin.GeometryModel()
    notes: dict[str, str] = {}
    meshes: _Meshes = {}
    for shape in shapes_of(robot, 'collision', other, progress):
        if shape.kind == 'mesh' and shape.path is None:
            notes[shape.link] = (
                f"link '{shape.link}': collision mesh {shape.mesh} not found; left out"
            )
        joint = robot.model.frames[shape.frame].parentJoint
        for piece, body in enumerate(_bodies(shape, meshes)):
            name, place = f'{shape.link}_{shape.number}_{piece}', shape.placement
            geometry.addGeometryObject(pin.GeometryObject(name, joint, shape.frame, place, body))
    return geometry, notes


def sticks(model: pin.Model) -> list[tuple[int, FloatArray]]:
    """
    Return the lines of a stick figure: joint index, and end point in the joint frame [m].

    A line ends at the next joint; the line of the last body ends beyond its centre of mass.
    Index 0 is the base.

    """
    lines = []
    for joint in range(model.njoints):
        carried = [k for k in range(1, model.njoints) if int(model.parents[k]) == joint]
        ends = [np.array(model.jointPlacements[k].translation) for k in carried]
        if joint and not ends:
            # the last link is drawn to twice the distance of its centre of mass
            ends = [2.0 * np.array(model.inertias[joint].lever)]
        lines += [(joint, end) for end in ends]
    return lines


def combined_mesh_note(notes: Sequence[str]) -> tuple[str, ...]:
    """Replace several notes on missing meshes by one note with the number of meshes."""
    if len(notes) < 2:
        return tuple(notes)
    return (f'{len(notes)} meshes not found, such as that of {notes[0]}',)


def _bodies(shape: LinkShape, meshes: _Meshes) -> tuple[coal.CollisionGeometry, ...]:
    """Return the collision bodies of a shape; bodies of meshes are cached in `meshes`."""
    if shape.kind != 'mesh':
        return (_BODIES[shape.kind](*shape.size),)
    if shape.path is None:
        return ()
    if (shape.path, shape.size) not in meshes:
        meshes[shape.path, shape.size] = convex_bodies(shape.path, np.array(shape.size))
    return meshes[shape.path, shape.size]


def _geometry(element: ElementTree.Element) -> tuple[str, tuple[float, ...], str]:
    """Return kind, dimensions and mesh file of the shape in a <visual> or <collision> element."""
    for shape in element.findall('geometry/*'):
        if shape.tag in _SHAPE_ATTRIBUTES:
            texts = [shape.get(name, '') for name in _SHAPE_ATTRIBUTES[shape.tag]]
            if shape.tag == 'mesh':
                return 'mesh', _numbers(texts[0] or '1 1 1'), shape.get('filename', '')
            size = _numbers(texts[0]) if shape.tag == 'box' else tuple(map(float, texts))
            return shape.tag, size, ''
    raise ValueError


def _numbers(text: str) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in text.split())
    return x, y, z


@dataclass(frozen=True, eq=False)
class CollisionModel:
    """
    Collision bodies of a robot, and the pairs of bodies whose distance is checked.

    Attributes
    ----------
    robot : Robot
        The robot.
    geometry : pinocchio.GeometryModel
        Collision bodies and pairs; never changed.
    notes : tuple of str
        Notes on missing bodies, and on pairs of links that are not checked.
    left_out : tuple of str
        Links with a body that was left out, because its mesh was not found.
    touching : tuple of (str, str)
        Pairs of links that are not checked, because they touch in the zero pose.
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
        """Return the pairs of links whose distance is checked, each in alphabetical order."""
        numbers = range(len(self.geometry.collisionPairs))
        return tuple(sorted({_links(self.robot, self.geometry, number) for number in numbers}))


def collision_model(robot: Robot, *, progress: Progress | None = None) -> CollisionModel:
    """
    Build the collision model of a robot: bodies, and pairs whose distance is checked.

    Four kinds of pairs are not checked: links that cannot move against each other, links joined by
    a joint, pairs that one joint moves and that touch nowhere in its range, and pairs that the
    SRDF disables. The SRDF is searched in the folder of the URDF and in ../srdf: the file with the
    name of the URDF or of the robot, or the only file. Without an SRDF, pairs that touch at zero
    (or at the limits nearest to zero) are left out and noted, because their collision bodies are
    probably too large.

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
    """Remove collision pairs of links that touch in the zero pose; return these pairs, sorted."""
    data, placed = robot.model.createData(), geometry.createData()
    pin.computeDistances(robot.model, data, geometry, placed, robot.positions(robot.zero_pose))
    touching = {
        _links(robot, geometry, number)
        for number, result in enumerate(placed.distanceResults)
        if result.min_distance <= 0.0
    }
    for number in reversed(range(len(geometry.collisionPairs))):
        if _links(robot, geometry, number) in touching:
            geometry.removeCollisionPair(geometry.collisionPairs[number])
    return tuple(sorted(touching))


def _leave_out_separate(robot: Robot, geometry: pin.GeometryModel) -> None:
    """Remove collision pairs across one joint that never touch within the range of the joint."""
    robot = robot.tree
    data, placed = robot.model.createData(), geometry.createData()
    by_joint: dict[int, list[int]] = {}
    for number, pair in enumerate(geometry.collisionPairs):
        bodies = (geometry.geometryObjects[pair.first], geometry.geometryObjects[pair.second])
        inner, outer = sorted(body.parentJoint for body in bodies)
        if robot.model.parents[outer] == inner:
            by_joint.setdefault(outer, []).append(number)
    separate = set[int]()
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
    for number in sorted(separate, reverse=True):
        geometry.removeCollisionPair(geometry.collisionPairs[number])


def _links(robot: Robot, geometry: pin.GeometryModel, pair: int) -> tuple[str, str]:
    """Return the names of the two links of a collision pair, in alphabetical order."""
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
    names = (description_name(robot.path), robot.name)
    for directory in (robot.path.parent, robot.path.parent.parent / 'srdf'):
        present = sorted(directory.glob('*.srdf'))
        for path in present:
            if path.stem in names:
                return path
        if len(present) == 1:
            return present[0]
    return None
