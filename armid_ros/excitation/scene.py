# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bodies of an arm, floor and obstacles around it, and a summary of the checks of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from armid_ros.excitation.geometry.clearance import Approach, ClearanceModel
from armid_ros.excitation.geometry.environment import load_environment, Obstacle, with_obstacles
from armid_ros.excitation.geometry.floor import (
    find_floor,
    Floor,
    floor_obstacles,
    lowest_point,
    LowestPoint,
)
from armid_ros.excitation.limits import has_velocity_limit, require_radians, SLOW_VELOCITY
from armid_ros.motion import Motion
from armid_ros.robots import collision_model, CollisionModel, Robot
import numpy as np
import pinocchio as pin


@dataclass(frozen=True)
class CollisionScene:
    """
    Robot bodies, floor and obstacles that must not touch each other in a motion.

    Attributes
    ----------
    collision : CollisionModel
        Bodies of the robot.
    floor : Floor
        The floor.
    obstacles : sequence of Obstacle
        Obstacles around the arm, including the floor.
    clearance : float
        Distance to keep between bodies [m].

    """

    collision: CollisionModel
    floor: Floor
    obstacles: Sequence[Obstacle]
    clearance: float

    @classmethod
    def of(
        cls,
        robot: Robot,
        clearance: float,
        floor: str | None = None,
        environment: str | Path | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> CollisionScene:
        """
        Return the collision scene: robot bodies, floor, and obstacles from a file.

        Parameters
        ----------
        robot : Robot
            The arm.
        clearance : float
            Distance to keep between bodies [m].
        floor : str, optional
            Height above the origin of the base [m], or 'none'; see `find_floor` for the default.
        environment : str or Path, optional
            File with the obstacles around the arm; by default no obstacles.
        progress : callable, optional
            Called with the share of the meshes that is read.

        Raises
        ------
        ArmidError
            If the file cannot be read, the height of the floor is unknown, or position limits
            are beyond two turns.

        """
        require_radians(robot)
        collision = collision_model(robot, progress=progress)
        obstacles = load_environment(environment, robot) if environment else ()
        found = find_floor(collision, floor, obstacles)
        obstacles = (*obstacles, *floor_obstacles(collision, found, clearance))
        return cls(collision, found, obstacles, clearance)

    @property
    def bodies(self) -> CollisionModel:
        """Return the collision model of the robot together with the obstacles."""
        return with_obstacles(self.collision, self.obstacles)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Return the items that the safety checks leave out, such as an unknown floor."""
        robot = self.collision.robot
        found: list[str] = []
        if self.floor.height is None and not any(o.kind == 'plane' for o in self.obstacles):
            if self.floor.source == 'given':
                found.append('the floor (none is given)')
            elif self.floor.source == 'environment':
                found.append('the floor (the environment has no plane)')
        found += self._bodies_not_checked()
        by_name = robot.description.by_name
        endless = np.array([by_name[joint].kind == 'continuous' for joint in robot.joints])
        slow = f'no limit is given; {SLOW_VELOCITY:g} rad/s or m/s is taken'
        for name, reason, where in (
            ('position', 'no limit', np.isinf(robot.upper - robot.lower) & ~endless),
            ('torque', 'no limit', np.isinf(robot.torque_limit)),
            ('velocity', slow, ~has_velocity_limit(robot)),
        ):
            joints = [joint for joint, one in zip(robot.joints, where, strict=True) if one]
            if joints:
                found.append(f'the {name} of {_listed(joints)} ({reason})')
        mass = robot.rigid_parameters.reshape(len(robot.links), -1)[:, 0]
        massless = [link for link, m in zip(robot.links, mass, strict=True) if not m > 0.0]
        if massless:
            found.append(f'the weight of {_listed(massless)} (no inertia)')
        return tuple(found)

    def _bodies_not_checked(self) -> list[str]:
        found = []
        if self.collision.left_out:
            found.append(f'bodies of {_listed(self.collision.left_out)} (mesh not found)')
        robot = self.collision.robot
        model, links = robot.model, robot.description.links
        with_body = {
            model.frames[body.parentFrame].name for body in self.collision.geometry.geometryObjects
        }
        heavy = (link for link, inertial in links.items() if inertial and inertial.mass > 0.0)
        bare = [
            link
            for link in dict.fromkeys([*robot.links, *heavy])
            if model.frames[model.getFrameId(link, pin.FrameType.BODY)].parentJoint > 0
            and link not in (*with_body, *self.collision.left_out)
        ]
        if bare:
            found.append(f'bodies of {_listed(bare)} (no collision body; joint origins only)')
        if self.collision.touching:
            pairs = [f'{first} - {second}' for first, second in self.collision.touching]
            listed = _listed(pairs, '; ')
            found.append(
                f'collision of {listed} (they touch in the zero pose, and there is no SRDF)'
            )
        return found


def _listed(names: Sequence[str], separator: str = ', ') -> str:
    most = 4
    more = len(names) - most
    text = separator.join(names[:most])
    return f'{text} and {more} more' if more > 0 else text


FIT, PARTLY, UNFIT = 'fit to run', 'partly checked', 'not to be run'
#: Remedy for each kind of unchecked item.
_REMEDIES = {
    'the floor': 'the height of the floor (--floor Z)',
    'mesh not found': 'the folder of the meshes (--package PACKAGE=FOLDER)',
    'no collision body': '<collision> in the description',
    'no SRDF': 'an SRDF next to the description',
    'no limit': 'limits (--joint-limits, --velocity or <limit>)',
    'no inertia': '<inertial> in the description',
}


@dataclass(frozen=True)
class Fitness:
    """
    Result of the safety checks of a run: verdict, reasons and advice.

    Attributes
    ----------
    lowest : LowestPoint
        The lowest point of the motion.
    floor : Floor
        The assumed floor.
    nearest : Approach or None
        The closest approach of two bodies; None if no pair is checked.
    unchecked : tuple of str
        Items that could not be checked.

    """

    lowest: LowestPoint
    floor: Floor
    nearest: Approach | None
    unchecked: tuple[str, ...]

    @property
    def word(self) -> str:
        """Return the verdict in words: fit to run, partly checked, or not to be run."""
        if self.nearest is not None and self.nearest.distance < 0.0:
            return UNFIT
        if self.floor.height is not None and self.lowest.height < self.floor.height:
            return UNFIT
        return PARTLY if self.unchecked else FIT

    @property
    def remedy(self) -> str:
        """Return the advice to the user before the run; empty if no action is needed."""
        if self.word == UNFIT:
            return 'Do not run it. Design it with another --start or --seed, or more --clearance.'
        items = ' '.join(self.unchecked)
        needed = ', '.join(remedy for words, remedy in _REMEDIES.items() if words in items)
        return f'Give {needed}, or check these items yourself before the run.' if needed else ''

    def __str__(self) -> str:
        """Return the verdict with the reasons in one line."""
        return f'{self.word}: {" ".join(self.sentences())}'

    def sentences(self) -> list[str]:
        """Return sentences on unchecked items, on limits and on distances."""
        unchecked = f'not checked: {"; ".join(self.unchecked)}' if self.unchecked else ''
        parts = []
        if self.nearest is not None:
            parts.append(
                f'smallest clearance {1e3 * self.nearest.distance:.0f} mm '
                f'({self.nearest.first} and {self.nearest.second})'
            )
        if self.lowest.link:
            height, what = self.lowest.height, 'base'
            if self.floor.height is not None:
                height, what = height - self.floor.height, 'floor'
            side = 'above' if height >= 0.0 else 'below'
            parts.append(
                f'lowest checked point {abs(height):.3f} m {side} the {what} ({self.lowest.link})'
            )
        near = ', '.join(parts)
        texts = unchecked, 'the motion keeps all limits', near
        found = [f'{text[0].upper()}{text[1:]}.' for text in texts if text]
        return found[::-1] if self.word == UNFIT else found


def fitness(motion: Motion, scene: CollisionScene) -> Fitness:
    """
    Summarise the safety checks of a run that is within all limits and the clearance.

    Parameters
    ----------
    motion : Motion
        The whole run.
    scene : CollisionScene
        Bodies, floor and obstacles of the clearance check.

    """
    exempt = [link for o in scene.obstacles if o.kind == 'plane' for link in o.ignore]
    return Fitness(
        lowest_point(scene.collision, scene.floor.up, motion, exempt),
        scene.floor,
        ClearanceModel.of(scene.bodies).closest(motion),
        scene.unchecked,
    )
