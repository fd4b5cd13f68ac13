# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The collision bodies of a URDF, as geometry objects placed on the bodies of a robot's model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from armid_ros.errors import RobotError
from armid_ros.robots.description import parse_xml
from armid_ros.robots.meshes import convex_bodies, find_mesh
from armid_ros.robots.robot import Robot
import coal
import numpy as np
import pinocchio as pin

_Meshes = dict[tuple[Path, tuple[float, float, float]], tuple[coal.CollisionGeometry, ...]]


def collision_geometry(
    robot: Robot, progress: Callable[[float], None] | None = None
) -> tuple[pin.GeometryModel, dict[str, str]]:
    """
    Return the collision bodies of a robot, and notes on those that had to be left out.

    Boxes, spheres and cylinders are exact; a mesh becomes convex bodies that contain it; a mesh
    that is not found is left out and noted.

    Returns
    -------
    geometry : pinocchio.GeometryModel
        The bodies, without collision pairs.
    notes : dict of str to str
        Links whose mesh was not found, each with a note on it.

    Raises
    ------
    RobotError
        If a <collision> has no geometry or numbers that are none, or a mesh cannot be read.

    """
    geometry = pin.GeometryModel()
    notes: dict[str, str] = {}
    meshes: _Meshes = {}
    frames = {
        frame.name: index
        for index, frame in enumerate(robot.model.frames)
        if frame.type == pin.FrameType.BODY
    }
    links = parse_xml(robot.urdf, robot.name).findall('link')
    for done, link in enumerate(links):
        if progress is not None:
            progress(done / len(links))
        name = link.get('name', '')
        frame = robot.model.frames[frames[name]]
        for number, element in enumerate(link.findall('collision')):
            try:
                shapes, missing = _shapes(element, robot.path, meshes)
                placement = frame.placement * _placement(element)
            except (TypeError, ValueError):
                raise RobotError(
                    f"{robot.name}: <collision> {number + 1} of link '{name}' is not a box, "
                    f'sphere, cylinder or mesh with its numbers'
                ) from None
            if missing:
                notes[name] = f"link '{name}': collision mesh {missing} not found; left out"
            for piece, shape in enumerate(shapes):
                geometry.addGeometryObject(
                    pin.GeometryObject(
                        f'{name}_{number}_{piece}',
                        frame.parentJoint,
                        frames[name],
                        placement,
                        shape,
                    )
                )
    return geometry, notes


def _shapes(
    element: ElementTree.Element, urdf: Path | None, meshes: _Meshes
) -> tuple[tuple[coal.CollisionGeometry, ...], str]:
    """Bodies of a <collision>; and the name of its mesh when there is no such file."""
    for shape in element.findall('geometry/*'):
        if shape.tag == 'box':
            return (coal.Box(*_numbers(shape.get('size', ''))),), ''
        if shape.tag == 'sphere':
            return (coal.Sphere(float(shape.get('radius', ''))),), ''
        if shape.tag == 'cylinder':
            radius, length = float(shape.get('radius', '')), float(shape.get('length', ''))
            return (coal.Cylinder(radius, length),), ''
        if shape.tag == 'mesh':
            name = shape.get('filename', '')
            path = find_mesh(name, urdf)
            scale = _numbers(shape.get('scale', '1 1 1'))
            if path is None:
                return (), name
            if (path, scale) not in meshes:
                meshes[path, scale] = convex_bodies(path, np.array(scale))
            return meshes[path, scale], ''
    raise ValueError


def _placement(element: ElementTree.Element) -> pin.SE3:
    origin = element.find('origin')
    if origin is None:
        return pin.SE3.Identity()
    roll, pitch, yaw = _numbers(origin.get('rpy', '0 0 0'))
    rotation = pin.rpy.rpyToMatrix(roll, pitch, yaw)
    return pin.SE3(rotation, np.array(_numbers(origin.get('xyz', '0 0 0'))))


def _numbers(text: str) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in text.split())
    return x, y, z
