# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reading of obstacles from files: lists of obstacles, or planning scenes of MoveIt.

A planning scene is read as printed by `ros2 topic echo --once --full-length`
(moveit_msgs/PlanningScene, PlanningSceneWorld or CollisionObject). A cone is replaced by its
enclosing cylinder, and a mesh by its enclosing box in the frame of its object. Objects attached to
the arm are not read.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
import re
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.environment import Obstacle, parse_obstacles
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

#: Names of the world frame if a description has no frame of that name.
_WORLD = ('', 'world')
#: Keys of a planning scene, of its world, and of a collision object.
_SCENE = {'world', 'collision_objects', 'primitives'}

#: Kind, size and placement of an obstacle.
_Shape = tuple[str, tuple[float, ...], pin.SE3]


def load_environment(path: str | Path, robot: Robot | None = None) -> tuple[Obstacle, ...]:
    """
    Read obstacles from a file.

    Parameters
    ----------
    path : str or Path
        A YAML list of mappings with the attributes of `Obstacle`; or the output of `ros2 topic
        echo --once --full-length /monitored_planning_scene`, its world or one of its collision
        objects, in YAML or JSON.
    robot : Robot, optional
        Robot whose frames a planning scene may name; without a robot, the base frame is assumed.

    Raises
    ------
    TrajectoryError
        If the file cannot be read or an entry is not an obstacle.

    """
    path = Path(path)
    text = read_text(path, TrajectoryError)
    with reading(path, TrajectoryError):
        document = load_yaml(re.split(r'^---$', text.removeprefix('---\n'), flags=re.M)[0])
        if isinstance(document, dict) and _SCENE & document.keys():
            return _scene_obstacles(document, robot)
        return parse_obstacles(document, path.parent)


def _scene_obstacles(document: Mapping[str, Any], robot: Robot | None) -> tuple[Obstacle, ...]:
    """Return the obstacles of a planning scene; errors name the collision object."""
    world = document.get('world', document)
    objects = world.get('collision_objects', [world] if 'primitives' in world else [])
    if not isinstance(objects, list):
        raise TrajectoryError('collision_objects has to be a list')
    found: list[Obstacle] = []
    for number, entry in enumerate(objects, 1):
        name = str(entry.get('id') or f'object {number}') if isinstance(entry, dict) else ''
        try:
            shapes = list(_shapes(entry, robot))
            for position, (kind, size, place) in enumerate(shapes, 1):
                found.append(
                    Obstacle(
                        name if len(shapes) == 1 else f'{name} {position}',
                        kind,
                        size,
                        tuple(float(x) for x in place.translation),
                        tuple(float(x) for x in pin.rpy.matrixToRpy(place.rotation)),
                    )
                )
        except (KeyError, TypeError, IndexError, ValueError, AttributeError) as error:
            whole = '; print it with --full-length' if "'...'" in str(entry) else ''
            raise TrajectoryError(
                f"collision object '{name or number}' has a missing or wrong entry: "
                f'{type(error).__name__} {error}{whole}'
            ) from error
    return tuple(found)


def _shapes(entry: Mapping[str, Any], robot: Robot | None) -> Iterator[_Shape]:
    """Yield the bodies of a collision object."""
    base = _frame(str(entry['header']['frame_id']), robot) * _pose(entry.get('pose'))
    for primitive, pose in zip(entry['primitives'], entry['primitive_poses'], strict=True):
        # numbers of shape_msgs/SolidPrimitive; a cone becomes a cylinder
        kind = {1: 'box', 2: 'sphere', 3: 'cylinder', 4: 'cylinder'}.get(
            int(primitive['type']), ''
        )
        if not kind:
            raise TrajectoryError(
                f'primitive {primitive["type"]} cannot be an obstacle; put a box around it'
            )
        size = tuple(float(value) for value in primitive['dimensions'])
        if kind == 'cylinder':
            size = size[1::-1]  # the height is the first dimension
        yield kind, size, base * _pose(pose)
    for mesh, pose in zip(entry.get('meshes', ()), entry.get('mesh_poses', ()), strict=True):
        points = np.array([[p['x'], p['y'], p['z']] for p in mesh['vertices']], dtype=float)
        low, high = points.min(axis=0), points.max(axis=0)
        # a flat mesh gets a box of this thickness [m]
        box = tuple(float(x) for x in np.maximum(high - low, 1e-4))
        yield 'box', box, base * _pose(pose) * pin.SE3(np.eye(3), (low + high) / 2.0)
    for plane, pose in zip(entry.get('planes', ()), entry.get('plane_poses', ()), strict=True):
        *normal, d = (float(value) for value in plane['coef'])  # a x + b y + c z + d = 0
        length = float(np.linalg.norm(normal))
        z = np.array(normal) / length
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), z)
        yield 'plane', (), base * _pose(pose) * pin.SE3(turn.matrix(), -d / length * z)


def _frame(name: str, robot: Robot | None) -> pin.SE3:
    """Return the placement of a fixed frame."""
    if robot is None:
        return pin.SE3.Identity()
    model = robot.model
    fixed = {str(f.name): f.placement for f in model.frames if f.parentJoint == 0}
    name = name.removeprefix('/')
    if name in fixed:
        return fixed[name]
    if name in _WORLD:
        return pin.SE3.Identity()
    moves = model.existFrame(name)
    why = 'moves with the arm' if moves else 'is not in the description'
    raise TrajectoryError(
        f"a collision object is in the frame '{name}', which {why}; those that do not move are "
        f'{", ".join(frame for frame in fixed if frame != "universe") or "world"}'
    )


def _pose(pose: Mapping[str, Any] | None) -> pin.SE3:
    if pose is None:
        return pin.SE3.Identity()
    place, turn = pose['position'], pose['orientation']
    quaternion = np.array([float(turn[axis]) for axis in 'xyzw'])
    if not np.linalg.norm(quaternion) > 0.0:
        quaternion = np.array(
            [0.0, 0.0, 0.0, 1.0]
        )  # as in MoveIt for an orientation that is not set
    quaternion /= np.linalg.norm(quaternion)
    position = np.array([float(place[axis]) for axis in 'xyz'])
    return pin.SE3(pin.Quaternion(quaternion).matrix(), position)
