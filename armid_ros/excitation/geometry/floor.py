# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Floor of an arm, which a URDF does not contain, and heights of bodies above it.

The user, or a file next to the description, gives the height of the floor. By default, the
floor is the base plane of a standing arm. For an arm that hangs or reaches below its base, the
height must be given.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
import math

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.environment import Obstacle
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, freeze, Motion
from armid_ros.robots import CollisionModel, read_mounting
import coal
import numpy as np


@dataclass(frozen=True)
class LowestPoint:
    """
    Lowest point of all links during a motion: height, link and time.

    Attributes
    ----------
    height : float
        Height of the point above the origin of the base, along the vertical [m].
    link : str
        Link of the point.
    time : float
        Time of the point [s].

    """

    height: float
    link: str
    time: float


def lowest_point(
    collision: CollisionModel, up: FloatArray, motion: Motion, exempt: Sequence[str] = ()
) -> LowestPoint:
    """
    Return the lowest point of the moving links over all samples of a motion.

    A link without a collision body is represented by the frame of its joint.

    Parameters
    ----------
    collision : CollisionModel
        Bodies of the arm.
    up : ndarray, shape (3,)
        Unit vector of the vertical, in the base frame.
    motion : Motion
        N samples.
    exempt : sequence of str
        Links that are ignored, because they stand on the floor.

    """
    lowest = LowestPoint(np.inf, '', 0.0)
    for link, below, _ in link_heights(collision, up, motion.q):
        if link in exempt:
            continue
        sample = int(np.argmin(below))
        if below[sample] < lowest.height:
            lowest = LowestPoint(float(below[sample]), link, float(motion.t[sample]))
    return lowest


def link_heights(
    collision: CollisionModel, up: FloatArray, q: FloatArray, *, fixed: bool = False
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """
    Yield each link with the heights of its lowest and highest point in poses q, (N, n).

    Yields
    ------
    link : str
        Its name.
    lowest, highest : ndarray, shape (N,)
        Heights above the origin of the base [m].

    """
    robot = collision.robot
    frames = LinkFrames.of(robot, q).frames
    seen: set[int] = set()
    for body in collision.geometry.geometryObjects:
        joint = int(body.parentJoint) - 1
        name = str(robot.model.frames[body.parentFrame].name)
        if joint >= 0:
            seen.add(joint)
            down, origin = (up @ frames[joint].rotation.transpose(2, 0, 1)), frames[joint].origin.T
        elif fixed:
            down, origin = np.tile(up, (len(q), 1)), np.zeros((len(q), 3))
        else:
            continue
        # the vertical in the frame of the body, and the height of its origin
        direction = down @ body.placement.rotation
        height = origin @ up + down @ body.placement.translation
        yield (
            name,
            height - _support(body.geometry, -direction),
            height + _support(body.geometry, direction),
        )
    for joint, link in enumerate(robot.links):
        if joint not in seen:
            height = frames[joint].origin.T @ up
            yield link, height, height


def vertical(gravity: FloatArray) -> FloatArray:
    """Return the unit vector opposite to gravity, or the z axis of the base without gravity."""
    size = float(np.linalg.norm(gravity))
    return np.asarray(-gravity / size) if size > 0.0 else np.array([0.0, 0.0, 1.0])


def outline(shape: coal.CollisionGeometry) -> tuple[FloatArray, float]:
    """Return centres (K, 3) and radius [m] of spheres whose convex hull encloses a body."""
    if isinstance(shape, coal.Convex):
        return np.array(shape.points()), 0.0
    if isinstance(shape, coal.Sphere):
        return np.zeros((1, 3)), float(shape.radius)
    if isinstance(shape, coal.Cylinder | coal.Capsule):
        end = np.array([0.0, 0.0, shape.halfLength])
        return np.array([end, -end]), float(shape.radius)
    shape.computeLocalAABB()
    ends = np.array([shape.aabb_local.min_, shape.aabb_local.max_])
    # an unbounded body, such as a half space, is larger [m]
    if not np.all(np.abs(ends) < 1e6):
        return np.empty((0, 3)), 0.0
    return np.array(list(product(*ends.T))), 0.0


def _support(shape: coal.CollisionGeometry, direction: FloatArray) -> FloatArray:
    """Return the extent of a body from its origin along N unit vectors, shape (N,) [m]."""
    if isinstance(shape, coal.Cylinder):
        axial = np.abs(direction[:, 2])
        radial = np.sqrt(np.maximum(1.0 - axial**2, 0.0))
        return np.asarray(shape.halfLength * axial + shape.radius * radial)
    points, skin = outline(shape)
    if not len(points):
        return np.full(len(direction), np.inf)
    return np.asarray((direction @ points.T).max(axis=1) + skin)


#: Name of the floor as an obstacle.
FLOOR = 'floor'
#: Value of --floor for an arm without a floor.
NO_FLOOR = 'none'


@dataclass(frozen=True)
class Floor:
    """
    Floor under an arm: height, normal, and source of the height.

    Attributes
    ----------
    height : float or None
        Height of the floor above the origin of the base, along ``up`` [m]; None: no floor is
        checked.
    up : ndarray, shape (3,)
        Normal of the floor in the base frame, a unit vector.
    source : str
        Source of the height: 'given', 'base plane', 'environment', or the name of a file.

    """

    height: float | None
    up: FloatArray
    source: str

    def __post_init__(self) -> None:
        """Freeze the normal vector of the floor."""
        freeze(self, 'up')

    def __str__(self) -> str:
        """Return the height of the floor and its source in one line."""
        if self.height is None:
            return f'none ({self.source})'
        return f'{self.height:g} m above the base ({self.source})'


def find_floor(
    collision: CollisionModel, given: str | None = None, surroundings: Sequence[Obstacle] = ()
) -> Floor:
    """
    Return the height and normal of the floor under an arm.

    Parameters
    ----------
    collision : CollisionModel
        The arm and its bodies.
    given : str, optional
        Height above the origin of the base along the vertical [m], or 'none'.
    surroundings : sequence of Obstacle
        Obstacles around the arm; if there are any, no floor is assumed.

    Raises
    ------
    TrajectoryError
        If ``given`` is neither a height nor 'none', or the arm does not stand on its base plane
        and no height is given.

    """
    robot = collision.robot
    up = vertical(robot.gravity)
    if given and given.strip().lower() == NO_FLOOR:
        return Floor(None, up, 'given')
    if given:
        try:
            height = float(given)
        except ValueError:
            height = math.nan
        if not math.isfinite(height):
            raise TrajectoryError(
                f'floor has to be a height above the origin of the base [m], or {NO_FLOOR}, not '
                f"'{given}'"
            )
        return Floor(height, up, 'given')
    if surroundings:
        return Floor(None, up, 'environment')
    mounting = read_mounting(robot)
    if mounting is not None:
        return Floor(mounting[0], up, mounting[1].name)
    reason = _why_not_standing(collision, up)
    if reason:
        raise TrajectoryError(
            f'{robot.name}: {reason}, so its base plane is not its floor. Give the height of the '
            f'floor above the origin of the base [m] with --floor Z, or give --floor {NO_FLOOR}'
        )
    return Floor(0.0, np.array([0.0, 0.0, 1.0]), 'base plane')


def floor_obstacles(
    collision: CollisionModel, floor: Floor, margin: float
) -> tuple[Obstacle, ...]:
    """
    Return the floor as an obstacle for the clearance check; empty if there is no floor.

    Links that are below the clearance in every pose, such as a turret on the base, are not
    checked against the floor.

    Parameters
    ----------
    collision : CollisionModel
        The arm and its bodies.
    floor : Floor
        The floor.
    margin : float
        Clearance to keep [m].

    Raises
    ------
    TrajectoryError
        If no link is above the floor in any pose.

    """
    if floor.height is None:
        return ()
    robot = collision.robot
    size = (400, robot.n_joints)
    q = np.random.default_rng(0).uniform(*robot.position_range(), size)
    highest: dict[str, FloatArray] = {}
    for link, lowest, _ in link_heights(collision, floor.up, q):
        highest[link] = np.minimum(highest.get(link, np.inf), lowest)
    if all(lowest.max() < floor.height for lowest in highest.values()):
        raise TrajectoryError(
            f'{robot.name}: all links are below the floor in all poses; the floor is {floor}. '
            'Give its height above the origin of the base [m] with --floor'
        )
    touching = tuple(k for k, lowest in highest.items() if lowest.max() < floor.height + margin)
    x, y, z = floor.up
    rpy = (-math.asin(float(np.clip(y, -1.0, 1.0))), math.atan2(x, z), 0.0)
    position = tuple(floor.height * floor.up)
    return (Obstacle(FLOOR, 'plane', (), position, rpy, ignore=touching),)


def _why_not_standing(collision: CollisionModel, up: FloatArray) -> str:
    """Return the reason why an arm cannot stand on its base plane; empty if there is none."""
    normal = np.array([0.0, 0.0, 1.0])
    if up[2] < np.cos(np.pi / 4.0):
        return 'gravity does not press the arm onto its base plane'
    model = collision.robot.model
    # the fixed link that carries the first joint
    carrier = model.frames[model.frames[model.getFrameId(model.names[1])].parentFrame]
    lean = float(np.arccos(np.clip(carrier.placement.rotation[:, 2] @ up, -1, 1)))
    if lean > np.pi / 4.0:
        return (
            f'{carrier.name} is mounted turned by {np.rad2deg(lean):.0f} degrees, as on a wall or '
            'a ceiling that the description does not have (give it with --environment)'
        )
    q = collision.robot.zero_pose[np.newaxis]
    heights = [
        (link, float(low[0]), float(high[0]))
        for link, low, high in link_heights(collision, normal, q, fixed=True)
    ]
    link, below, _ = min(heights, key=lambda entry: entry[1])
    above = max(high for _, _, high in heights)
    # With all joints at zero, a standing arm reaches at least this number of times as far above
    # its base plane as below. The wrist of a stretched small industrial arm is a third of its
    # shoulder's height below the base plane.
    if above > 0.0 and above >= -2.0 * below:
        return ''
    return (
        f'at zero positions the arm reaches {max(above, 0.0):.2f} m above its base plane and '
        f'{max(-below, 0.0):.2f} m below it ({link})'
    )
