# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The visual and collision shapes of a URDF, placed on the bodies of the model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Literal, NamedTuple
from xml.etree import ElementTree

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray
from armid_ros.robots.description import parse_xml
from armid_ros.robots.meshes import convex_bodies, find_mesh
from armid_ros.robots.robot import Robot
import coal
import numpy as np
import pinocchio as pin

#: Without bodies, the last link is drawn to this many times the distance of its centre of mass.
_BEYOND = 2.0
_Meshes = dict[tuple[Path, tuple[float, ...]], tuple[coal.CollisionGeometry, ...]]
#: Attributes of each kind of shape, and the default of those that have one.
_SIZES = {
    'box': ('size',),
    'sphere': ('radius',),
    'cylinder': ('radius', 'length'),
    'capsule': ('radius', 'length'),
    'mesh': ('scale',),
}


class LinkShape(NamedTuple):
    """
    One <visual> or <collision> of a link.

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
    robot: Robot,
    tag: Literal['visual', 'collision'],
    other: Literal['visual', 'collision'] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[LinkShape]:
    """
    Yield the shapes of a robot.

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
                    f"{robot.name}: <{element.tag}> {number + 1} of link '{name}' is not a box, "
                    f'sphere, cylinder, capsule or mesh with its numbers'
                ) from None
            path = find_mesh(mesh, robot.path) if kind == 'mesh' else None
            yield LinkShape(name, frames[name], number, placement, kind, size, mesh, path)


def collision_geometry(
    robot: Robot,
    progress: Callable[[float], None] | None = None,
    other: Literal['visual', 'collision'] = 'collision',
) -> tuple[pin.GeometryModel, dict[str, str]]:
    """
    Return the collision bodies of a robot, and notes on bodies that are left out.

    Boxes, spheres and cylinders are exact. A mesh is replaced by convex bodies that contain the
    mesh. A mesh that is not found is left out and noted.

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
        for piece, (body, along) in enumerate(_bodies(shape, meshes)):
            name = f'{shape.link}_{shape.number}_{piece}'
            place = shape.placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, along]))
            geometry.addGeometryObject(pin.GeometryObject(name, joint, shape.frame, place, body))
    return geometry, notes


def sticks(model: pin.Model) -> list[tuple[int, FloatArray]]:
    """
    Return lines from joints, each as the joint index and the end point in the joint frame.

    A line ends at the next joint; the line of the last body ends beyond its centre of mass. Index
    0 is the base.

    """
    lines = []
    for joint in range(model.njoints):
        carried = [k for k in range(1, model.njoints) if int(model.parents[k]) == joint]
        ends = [np.array(model.jointPlacements[k].translation) for k in carried]
        if joint and not ends:
            ends = [_BEYOND * np.array(model.inertias[joint].lever)]
        lines += [(joint, end) for end in ends]
    return lines


def all_in_one(notes: Sequence[str]) -> tuple[str, ...]:
    """Return notes on meshes as one, with their count and the first; none for none."""
    if len(notes) < 2:
        return tuple(notes)
    return (f'{len(notes)} meshes not found, such as that of {notes[0]}',)


def _bodies(shape: LinkShape, meshes: _Meshes) -> list[tuple[coal.CollisionGeometry, float]]:
    """Return the bodies of a shape, each with its offset along the z axis of the shape."""
    if shape.kind == 'box':
        return [(coal.Box(*shape.size), 0.0)]
    if shape.kind == 'sphere':
        return [(coal.Sphere(*shape.size), 0.0)]
    if shape.kind == 'mesh':
        if shape.path is None:
            return []
        if (shape.path, shape.size) not in meshes:
            meshes[shape.path, shape.size] = convex_bodies(shape.path, np.array(shape.size))
        return [(body, 0.0) for body in meshes[shape.path, shape.size]]
    radius, length = shape.size
    ends = (0.5 * length, -0.5 * length) if shape.kind == 'capsule' else ()
    return [(coal.Cylinder(radius, length), 0.0), *((coal.Sphere(radius), end) for end in ends)]


def _geometry(element: ElementTree.Element) -> tuple[str, tuple[float, ...], str]:
    """Return the kind, the dimensions and the mesh name of a shape."""
    for shape in element.findall('geometry/*'):
        if shape.tag in _SIZES:
            texts = [shape.get(name, '') for name in _SIZES[shape.tag]]
            if shape.tag == 'mesh':
                return 'mesh', _numbers(texts[0] or '1 1 1'), shape.get('filename', '')
            size = _numbers(texts[0]) if shape.tag == 'box' else tuple(map(float, texts))
            return shape.tag, size, ''
    raise ValueError


def _numbers(text: str) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in text.split())
    return x, y, z
