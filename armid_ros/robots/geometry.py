# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The collision bodies of a URDF, as geometry objects placed on the bodies of a robot's model."""

from __future__ import annotations

from collections.abc import Iterator
import os
from pathlib import Path
from xml.etree import ElementTree

from armid_ros.errors import RobotError
from armid_ros.robots.description import parse_xml
from armid_ros.robots.robot import Robot
import coal
import numpy as np
import pinocchio as pin


def collision_geometry(robot: Robot) -> tuple[pin.GeometryModel, tuple[str, ...]]:
    """
    Return the collision bodies of a robot, and notes on those that had to be left out.

    Boxes, spheres and cylinders are exact. A mesh is replaced by its convex hull, which never
    makes a clearance look larger than it is; a mesh that is not found is left out and noted.

    Returns
    -------
    geometry : pinocchio.GeometryModel
        One object for each <collision>, without collision pairs.
    notes : tuple of str
        What was left out.

    Raises
    ------
    RobotError
        If a <collision> has no geometry, or numbers that are none.

    """
    geometry, notes = pin.GeometryModel(), []
    frames = {
        frame.name: index
        for index, frame in enumerate(robot.model.frames)
        if frame.type == pin.FrameType.BODY
    }
    for link in parse_xml(robot.urdf, robot.name).findall('link'):
        name = link.get('name', '')
        for number, element in enumerate(link.findall('collision')):
            try:
                shape, missing = _shape(element, robot.path)
                placement = _placement(element)
            except (AttributeError, TypeError, ValueError):
                raise RobotError(
                    f"{robot.name}: <collision> {number + 1} of link '{name}' is not a box, "
                    f'sphere, cylinder or mesh with its numbers'
                ) from None
            if shape is None:
                notes.append(f"link '{name}': collision mesh {missing} not found; left out")
                continue
            frame = robot.model.frames[frames[name]]
            geometry.addGeometryObject(
                pin.GeometryObject(
                    f'{name}_{number}',
                    frame.parentJoint,
                    frames[name],
                    frame.placement * placement,
                    shape,
                )
            )
    return geometry, tuple(notes)


def _shape(
    element: ElementTree.Element, urdf: Path | None
) -> tuple[coal.CollisionGeometry | None, str]:
    """Shape of a <collision>, or None and the name of the mesh that does not exist."""
    geometry = element.find('geometry')
    if geometry is None:
        raise ValueError
    for shape in geometry:
        if shape.tag == 'box':
            return coal.Box(*_numbers(shape.get('size', ''))), ''
        if shape.tag == 'sphere':
            return coal.Sphere(float(shape.get('radius', ''))), ''
        if shape.tag == 'cylinder':
            return coal.Cylinder(
                float(shape.get('radius', '')), float(shape.get('length', ''))
            ), ''
        if shape.tag == 'mesh':
            name = shape.get('filename', '')
            path = find_mesh(name, urdf)
            scale = np.array(_numbers(shape.get('scale', '1 1 1')))
            return (None if path is None else _convex_hull(path, scale)), name
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


def _convex_hull(path: Path, scale: np.ndarray) -> coal.CollisionGeometry:
    try:
        mesh = coal.MeshLoader().load(str(path), scale)
        mesh.buildConvexHull(True, 'Qt')
    except (RuntimeError, ValueError) as error:
        raise RobotError(f'{path}: cannot be read as a mesh: {error}') from None
    return mesh.convex


def find_mesh(name: str, urdf: Path | None) -> Path | None:
    """
    Return the file a URDF's mesh name means, or None when it is nowhere.

    'package://NAME/...' is looked for in AMENT_PREFIX_PATH and ROS_PACKAGE_PATH, and beside the
    directories that hold the URDF; a relative path starts at the URDF.

    """
    if name.startswith('package://'):
        inside = name.removeprefix('package://').lstrip('/')
        candidates = [root / inside for root in _package_roots(urdf)]
    else:
        beside = Path() if urdf is None else urdf.resolve().parent
        candidates = [beside / name.removeprefix('file://')]
    return next((path for path in candidates if path.is_file()), None)


def _package_roots(urdf: Path | None) -> Iterator[Path]:
    """Directories that may hold a package."""
    for prefix in filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)):
        yield Path(prefix) / 'share'
    for directory in filter(None, os.environ.get('ROS_PACKAGE_PATH', '').split(os.pathsep)):
        yield Path(directory)
        yield Path(directory).parent
    if urdf is not None:
        yield from urdf.resolve().parents
