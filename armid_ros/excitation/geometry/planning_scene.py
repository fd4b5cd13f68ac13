# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What stands around an arm, from files: obstacles, or what MoveIt knows.

Two forms of MoveIt are read: what `ros2 topic echo --once --full-length` prints of a scene
(moveit_msgs/PlanningScene, PlanningSceneWorld or CollisionObject), and the text file (.scene) that
RViz exports. Cones become the cylinder around them and meshes the box around them in the frame of
their object, which takes more room, never less. What is attached to the arm is not read.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import re
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.environment import Obstacle, parse_obstacles
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

#: Names of the frame that the world has where a description has no frame of that name.
_WORLD = ('', 'world')
#: Thinnest box around a mesh that is flat [m].
_FLAT = 1e-4
#: shape_msgs/SolidPrimitive: kind by number.
_PRIMITIVES = {1: 'box', 2: 'sphere', 3: 'cylinder', 4: 'cone'}


@dataclass(frozen=True)
class _Shape:
    """A body by kind, with size and placement as obstacles have them."""

    kind: str
    size: tuple[float, ...]
    placement: pin.SE3


def load_environment(path: str | Path, robot: Robot | None = None) -> tuple[Obstacle, ...]:
    """
    Read obstacles from a file.

    Parameters
    ----------
    path : str or Path
        A YAML list of mappings with the attributes of `Obstacle`; what `ros2 topic echo --once
        --full-length /monitored_planning_scene` prints, the world or a collision object of it, in
        YAML or JSON; or a .scene file of MoveIt.
    robot : Robot, optional
        Whose frames a planning scene may name; without it all is taken to be in the base frame.

    Raises
    ------
    TrajectoryError
        If the file cannot be read or an entry is not an obstacle.

    """
    path = Path(path)
    text = read_text(path, TrajectoryError)
    with reading(path, TrajectoryError):
        if path.suffix == '.scene':
            return _read_scene_file(text)
        document = load_yaml(re.split(r'^---$', text.removeprefix('---\n'), flags=re.M)[0])
        if _is_scene(document):
            return _scene_obstacles(document, robot)
        return parse_obstacles(path, document)


def _is_scene(document: Any) -> bool:
    """Return whether a YAML document is a planning scene, its world or a collision object."""
    return isinstance(document, dict) and bool(
        {'world', 'collision_objects', 'primitives'} & document.keys()
    )


def _scene_obstacles(document: Mapping[str, Any], robot: Robot | None) -> tuple[Obstacle, ...]:
    """
    Return the collision objects of a planning scene.

    Parameters
    ----------
    document : mapping
        Of moveit_msgs/PlanningScene, PlanningSceneWorld or CollisionObject.
    robot : Robot, optional
        In whose base frame the obstacles are; without it objects are taken to be in that frame.

    Raises
    ------
    TrajectoryError
        If an object is in a frame that moves or is not known, or lacks a number.

    """
    world = document.get('world', document)
    objects = world.get('collision_objects', [world] if 'primitives' in world else [])
    if not isinstance(objects, list):
        raise TrajectoryError('collision_objects has to be a list')
    found: list[Obstacle] = []
    for number, entry in enumerate(objects, 1):
        name = str(entry.get('id') or f'object {number}') if isinstance(entry, dict) else ''
        try:
            found += _named(name, list(_object(entry, robot)))
        except (KeyError, TypeError, IndexError, ValueError, AttributeError) as error:
            whole = '; print it with --full-length' if "'...'" in str(entry) else ''
            raise TrajectoryError(
                f"collision object '{name or number}' lacks or has something else: "
                f'{type(error).__name__} {error}{whole}'
            ) from error
    return tuple(found)


def _object(entry: Mapping[str, Any], robot: Robot | None) -> Iterator[_Shape]:
    frame = str(entry['header']['frame_id'])
    base = _frame(frame, robot) * _pose(entry.get('pose'))
    for primitive, pose in zip(entry['primitives'], entry['primitive_poses'], strict=True):
        kind = _PRIMITIVES.get(int(primitive['type']), f'primitive {primitive["type"]}')
        size = [float(value) for value in primitive['dimensions']]
        if kind in ('cylinder', 'cone'):
            size = size[1::-1]  # height comes first
        yield _Shape(*_solid(kind, size), base * _pose(pose))
    for mesh, pose in zip(entry.get('meshes', ()), entry.get('mesh_poses', ()), strict=True):
        points = np.array([[p['x'], p['y'], p['z']] for p in mesh['vertices']], dtype=float)
        yield _around(points, base * _pose(pose))
    for plane, pose in zip(entry.get('planes', ()), entry.get('plane_poses', ()), strict=True):
        yield _plane([float(value) for value in plane['coef']], base * _pose(pose))


def _frame(name: str, robot: Robot | None) -> pin.SE3:
    """Return where a frame is that does not move."""
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
    why = 'moves with the arm' if moves else 'is none of the description'
    raise TrajectoryError(
        f"a collision object is in the frame '{name}', which {why}; those that do not move are "
        f'{", ".join(frame for frame in fixed if frame != "universe") or "world"}'
    )


def _pose(pose: Mapping[str, Any] | None) -> pin.SE3:
    if pose is None:
        return pin.SE3.Identity()
    place, turn = pose['position'], pose['orientation']
    return _placed([float(place[axis]) for axis in 'xyz'], [float(turn[axis]) for axis in 'xyzw'])


def _placed(position: Sequence[float], xyzw: Sequence[float]) -> pin.SE3:
    quaternion = np.array(xyzw, dtype=float)
    if not np.linalg.norm(quaternion) > 0.0:
        quaternion = np.array([0.0, 0.0, 0.0, 1.0])  # as MoveIt takes what was not set
    quaternion /= np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(quaternion).matrix(), np.array(position, dtype=float))


def _solid(kind: str, size: Sequence[float]) -> tuple[str, tuple[float, ...]]:
    if kind not in ('box', 'sphere', 'cylinder', 'cone'):
        raise TrajectoryError(f"a '{kind}' cannot be an obstacle; put a box around it")
    return 'cylinder' if kind == 'cone' else kind, tuple(size)


def _around(points: FloatArray, placement: pin.SE3) -> _Shape:
    """Return the box around points, in the frame they are in."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, _FLAT)
    middle = pin.SE3(np.eye(3), (low + high) / 2.0)
    return _Shape('box', tuple(float(x) for x in size), placement * middle)


def _plane(coefficients: Sequence[float], placement: pin.SE3) -> _Shape:
    """Return the half space below the plane a x + b y + c z + d = 0."""
    *normal, d = coefficients
    length = float(np.linalg.norm(normal))
    z = np.array(normal) / length
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), z)
    return _Shape('plane', (), placement * pin.SE3(turn.matrix(), -d / length * z))


def _named(name: str, shapes: Sequence[_Shape]) -> Iterator[Obstacle]:
    for number, shape in enumerate(shapes, 1):
        yield Obstacle(
            name if len(shapes) == 1 else f'{name} {number}',
            shape.kind,
            shape.size,
            tuple(float(x) for x in shape.placement.translation),
            tuple(float(x) for x in pin.rpy.matrixToRpy(shape.placement.rotation)),
        )


def _read_scene_file(text: str) -> tuple[Obstacle, ...]:
    """
    Return the obstacles of a .scene file, as RViz exports and MoveIt imports them.

    Its objects are in the frame that the planning is done in, which is taken for the base.

    Raises
    ------
    TrajectoryError
        If it ends too early or a number is none; names the object.

    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if not lines:
        raise TrajectoryError('is empty')
    found: list[Obstacle] = []
    name, rest = '', iter(lines[1:])  # the first is the name of the scene
    for line in rest:
        if line == '.':
            return tuple(found)
        name = line.removeprefix('*').strip()
        try:
            found += _named(name, list(_listed(lambda: next(rest))))
        except (StopIteration, RuntimeError, ValueError, IndexError) as error:
            raise TrajectoryError(
                f"object '{name}' is not as a .scene file has it: {error or 'it ends too early'}"
            ) from error
    raise TrajectoryError(f"ends without '.' after object '{name}'")


def _listed(following: Callable[[], str]) -> Iterator[_Shape]:
    """Read the shapes of one object; newer files say where the object itself is."""

    def numbers() -> list[float]:
        return [float(word) for word in following().split()]

    first, base = numbers(), pin.SE3.Identity()
    newer = len(first) == 3
    if newer:
        base = _placed(first, numbers())
        first = numbers()
    for _ in range(int(first[0])):
        kind = following()
        if kind == 'mesh':
            vertices, triangles = (int(x) for x in numbers())
            points = np.array([numbers() for _ in range(vertices)])
            for _ in range(triangles):
                numbers()
            place, turn = numbers(), numbers()
            yield _around(points, base * _placed(place, turn))
        elif kind == 'plane':
            coefficients, place, turn = numbers(), numbers(), numbers()
            yield _plane(coefficients, base * _placed(place, turn))
        else:
            size, place, turn = numbers(), numbers(), numbers()
            yield _Shape(*_solid(kind, size), base * _placed(place, turn))
        numbers()  # the colour
    if newer:
        for _ in range(int(numbers()[0])):  # frames of the object, which are no bodies
            following(), numbers(), numbers()
