# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Obstacles around the arm, also from files: boxes, spheres, cylinders, meshes and planes.

A file is a list of obstacles or a planning scene of MoveIt, as printed by `ros2 topic echo --once
--full-length` (moveit_msgs/PlanningScene, PlanningSceneWorld or CollisionObject). A cone becomes
its enclosing cylinder, and a mesh its enclosing box in the frame of its object. Objects attached
to the arm are ignored.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
import re
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.robots import CollisionModel, Robot
import coal
import numpy as np
import pinocchio as pin

#: Kinds of obstacles, each with the names of its dimensions.
KINDS: Mapping[str, tuple[str, ...]] = {
    'box': ('x', 'y', 'z'),
    'sphere': ('radius',),
    'cylinder': ('radius', 'length'),
    'mesh': ('scale',),
    'plane': (),
}


@dataclass(frozen=True)
class Obstacle:
    """
    A fixed obstacle near the arm: box, sphere, cylinder, mesh or plane.

    Attributes
    ----------
    name : str
        Name in messages.
    kind : str
        'box', 'sphere', 'cylinder' (along z), 'mesh' (its convex hull) or 'plane' (the half
        space below z = 0 of its own frame).
    size : tuple of float
        Full edges of the box, radius, radius and length [m], or the scale of the mesh.
    position : tuple of float
        Origin in the robot's base frame [m].
    rpy : tuple of float
        Roll, pitch and yaw, as in a URDF [rad].
    mesh : Path or None
        File of the mesh; None for other kinds.
    ignore : tuple of str
        Links that may touch the obstacle, such as the link that stands on it.

    """

    name: str
    kind: str
    size: tuple[float, ...] = ()
    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0)
    mesh: Path | None = None
    ignore: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        """Check names, kind, size, position and orientation of the obstacle."""
        if not all(isinstance(name, str) for name in (self.name, self.kind, *self.ignore)):
            raise TrajectoryError(
                f"obstacle '{self.name}': names and kind have to be strings; quote them"
            )
        if self.kind not in KINDS:
            raise TrajectoryError(
                f"obstacle '{self.name}': there is no kind '{self.kind}'; kinds are "
                f'{", ".join(KINDS)}'
            )
        wanted = KINDS[self.kind]
        size = self.size or ((1.0,) if self.kind == 'mesh' else ())
        object.__setattr__(self, 'size', tuple(float(value) for value in size))
        if len(self.size) != len(wanted) or not all(0.0 < v < np.inf for v in self.size):
            raise TrajectoryError(
                f"obstacle '{self.name}': the size of a {self.kind} has to be "
                f'{", ".join(wanted) or "nothing"}, in positive numbers; got {self.size}'
            )
        for name in ('position', 'rpy'):
            values = tuple(float(value) for value in getattr(self, name))
            object.__setattr__(self, name, values)
            if len(values) != 3 or not np.isfinite(values).all():
                raise TrajectoryError(
                    f"obstacle '{self.name}': {name} has to be 3 finite numbers, not {values}"
                )
        if (self.kind == 'mesh') != (self.mesh is not None):
            raise TrajectoryError(f"obstacle '{self.name}': kind 'mesh' needs a file, others none")

    def geometry(self) -> coal.CollisionGeometry:
        """Return the collision shape of the obstacle, in the frame of the obstacle."""
        if self.kind == 'box':
            return coal.Box(*self.size)
        if self.kind == 'sphere':
            return coal.Sphere(self.size[0])
        if self.kind == 'cylinder':
            return coal.Cylinder(*self.size)
        if self.kind == 'plane':
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        try:
            mesh = coal.MeshLoader().load(str(self.mesh), np.full(3, self.size[0]))
            mesh.buildConvexHull(True, 'Qt')
        except (RuntimeError, ValueError) as error:
            raise TrajectoryError(
                f"obstacle '{self.name}': {self.mesh} cannot be read as a mesh: {error}"
            ) from error
        return mesh.convex


#: Suffix of the name of the sphere that stands for a link without a body.
_ORIGIN = '_frame'


def with_obstacles(collision: CollisionModel, obstacles: Sequence[Obstacle]) -> CollisionModel:
    """
    Return the collision model of a robot, extended by the obstacles around the robot.

    Every moving body is checked against every obstacle, except the links that the obstacle
    ignores. A link without a body gets a small sphere at the frame of its joint. The size of
    such a link is unknown, but the link must not pass through the floor.

    Raises
    ------
    TrajectoryError
        If an obstacle ignores a link that the robot does not have, or two obstacles have the same
        name.

    """
    if not obstacles:
        return collision
    geometry = collision.geometry.copy()
    robot = collision.robot
    seen = {int(body.parentJoint) for body in geometry.geometryObjects}
    for joint, link in enumerate(robot.links, start=1):
        if joint not in seen:
            frame = robot.model.getFrameId(link, pin.FrameType.BODY)
            point, here = coal.Sphere(1e-4), pin.SE3.Identity()  # radius [m]
            added = pin.GeometryObject(link + _ORIGIN, joint, frame, here, point)
            geometry.addGeometryObject(added)
    # copied, because adding an object invalidates the Python references
    bodies = [(int(body.parentJoint), int(body.parentFrame)) for body in geometry.geometryObjects]
    links = [str(collision.robot.model.frames[frame].name) for _, frame in bodies]
    names = [obstacle.name for obstacle in obstacles]
    for obstacle in obstacles:
        if names.count(obstacle.name) > 1:
            raise TrajectoryError(f"two obstacles are named '{obstacle.name}'; rename one")
        unknown = [link for link in obstacle.ignore if link not in links]
        if unknown:
            raise TrajectoryError(
                f"obstacle '{obstacle.name}' ignores link '{unknown[0]}', which has no collision "
                f'geometry; links with collision geometry are {", ".join(dict.fromkeys(links))}'
            )
        rotation = pin.rpy.rpyToMatrix(*obstacle.rpy)
        placement = pin.SE3(rotation, np.array(obstacle.position))
        number = geometry.addGeometryObject(
            pin.GeometryObject(obstacle.name, 0, 0, placement, obstacle.geometry())
        )
        for other, ((joint, _), link) in enumerate(zip(bodies, links, strict=True)):
            if joint > 0 and link not in obstacle.ignore:
                geometry.addCollisionPair(pin.CollisionPair(other, number))
    return replace(collision, geometry=geometry)


def obstacles_alone(collision: CollisionModel, obstacles: Sequence[Obstacle]) -> CollisionModel:
    """Return a collision model that checks links against obstacles, not against each other."""
    geometry = collision.geometry.copy()
    geometry.removeAllCollisionPairs()
    return with_obstacles(replace(collision, geometry=geometry), obstacles)


def body_name(collision: CollisionModel, number: int) -> str:
    """Return the name of a collision body for messages: its link, joint or obstacle."""
    body = collision.geometry.geometryObjects[number]
    frame = int(body.parentFrame)
    link = str(collision.robot.model.frames[frame].name)
    if body.name == link + _ORIGIN:
        return f'joint of {link}'
    return str(body.name) if frame == 0 else link


#: Names of the world frame, for descriptions without a frame of that name.
_WORLD = ('', 'world')
#: Keys of a planning scene, of its world, and of a collision object.
_SCENE = {'world', 'collision_objects', 'primitives'}

#: Kind, size and placement of an obstacle.
_Shape = tuple[str, tuple[float, ...], pin.SE3]


def load_environment(path: str | Path, robot: Robot | None = None) -> tuple[Obstacle, ...]:
    """
    Read obstacles from a YAML list or from a planning scene of MoveIt.

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
        # the obstacles of a list of mappings with the attributes of `Obstacle`
        if not isinstance(document, list):
            raise TrajectoryError('expected a list of obstacles, or a planning scene of MoveIt')
        found: list[Obstacle] = []
        known = tuple(Obstacle.__dataclass_fields__)
        for number, entry in enumerate(document, 1):
            if not isinstance(entry, dict) or not {'name', 'kind'} <= entry.keys() <= set(known):
                raise TrajectoryError(
                    f'obstacle {number} needs name and kind; other keys are {", ".join(known[2:])}'
                )
            values: dict[str, Any] = {
                key: tuple(v) if isinstance(v, list) else v for key, v in entry.items()
            }
            if isinstance(values.get('size'), (int, float)):
                values['size'] = (values['size'],)
            if 'mesh' in values:
                values['mesh'] = path.parent / str(values['mesh'])
            try:
                found.append(Obstacle(**values))
            except (TypeError, ValueError) as error:
                raise TrajectoryError(f'obstacle {number}: {error}') from error
        return tuple(found)


def _scene_obstacles(document: Mapping[str, Any], robot: Robot | None) -> tuple[Obstacle, ...]:
    """Return the obstacles of a MoveIt planning scene; errors name the collision object."""
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
            hint = '; print it with --full-length' if "'...'" in str(entry) else ''
            raise TrajectoryError(
                f"collision object '{name or number}' has a missing or wrong entry: "
                f'{type(error).__name__} {error}{hint}'
            ) from error
    return tuple(found)


def _shapes(entry: Mapping[str, Any], robot: Robot | None) -> Iterator[_Shape]:
    """Yield kind, size and placement of each shape in a CollisionObject message of MoveIt."""
    base = _frame(str(entry['header']['frame_id']), robot) * _pose(entry.get('pose'))
    for primitive, pose in zip(entry['primitives'], entry['primitive_poses'], strict=True):
        # numbers of shape_msgs/SolidPrimitive; a cone becomes a cylinder
        kind = {1: 'box', 2: 'sphere', 3: 'cylinder', 4: 'cylinder'}.get(
            int(primitive['type']), ''
        )
        if not kind:
            raise TrajectoryError(
                f'a primitive of type {primitive["type"]} is not supported; replace it by a box'
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
    """Return the placement of a fixed frame in the base frame, given its name."""
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
    fault = 'moves with the arm' if moves else 'is not in the description'
    raise TrajectoryError(
        f"a collision object is in the frame '{name}', which {fault}; fixed frames are "
        f'{", ".join(frame for frame in fixed if frame != "universe") or "world"}'
    )


def _pose(pose: Mapping[str, Any] | None) -> pin.SE3:
    if pose is None:
        return pin.SE3.Identity()
    place, turn = pose['position'], pose['orientation']
    quaternion = np.array([float(turn[axis]) for axis in 'xyzw'])
    if not np.linalg.norm(quaternion) > 0.0:
        quaternion = np.array([0.0, 0.0, 0.0, 1.0])  # as in MoveIt for a missing orientation
    quaternion /= np.linalg.norm(quaternion)
    position = np.array([float(place[axis]) for axis in 'xyz'])
    return pin.SE3(pin.Quaternion(quaternion).matrix(), position)
