# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The bodies of an arm, its floor and the obstacles around it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from armid_ros.excitation.geometry.environment import Obstacle, with_obstacles
from armid_ros.excitation.geometry.floor import find_floor, Floor, floor_obstacles
from armid_ros.excitation.geometry.planning_scene import load_environment
from armid_ros.excitation.limits import (
    has_velocity_limit,
    Limits,
    require_radians,
    SLOW_VELOCITY,
)
from armid_ros.robots import collision_model, CollisionModel, Robot
import numpy as np


@dataclass(frozen=True)
class CollisionScene:
    """
    Bodies, floor and obstacles that a motion must not touch.

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
        Load the surroundings of a robot.

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
        around = load_environment(environment, robot) if environment else ()
        found = find_floor(collision, floor, around)
        around = (*around, *floor_obstacles(collision, found, clearance))
        return cls(collision, found, around, clearance)

    @property
    def bodies(self) -> CollisionModel:
        """Return the bodies of the robot together with the obstacles."""
        return with_obstacles(self.collision, self.obstacles)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Return the items that cannot be checked for any motion."""
        return self.not_checked(Limits.of(self.collision.robot, speed=1.0))

    def not_checked(self, limits: Limits) -> tuple[str, ...]:
        """Return the items that cannot be checked for a run within limits."""
        robot = self.collision.robot
        found: list[str] = []
        if self.floor.height is None and not any(o.kind == 'plane' for o in self.obstacles):
            if self.floor.source == 'given':
                found.append('the floor (none is given)')
            elif self.floor.source == 'environment':
                found.append('the floor (the environment has no plane)')
        found += self._bodies_not_checked()
        by_name = robot.description.by_name
        endless = np.array([by_name[joint].kind == 'continuous' for joint in limits.joints])
        slow = f'no limit is given; {SLOW_VELOCITY:g} rad/s or m/s is taken'
        for name, reason, where in (
            ('position', 'no limit', np.isinf(limits.upper - limits.lower) & ~endless),
            ('velocity', 'no limit', np.isinf(limits.velocity)),
            ('torque', 'no limit', np.isinf(limits.torque)),
            ('velocity', slow, ~has_velocity_limit(robot)),
        ):
            joints = [joint for joint, one in zip(limits.joints, where, strict=True) if one]
            if joints:
                found.append(f'the {name} of {_listed(joints)} ({reason})')
        mass = robot.rigid_parameters.reshape(robot.n_joints, -1)[:, 0]
        massless = [link for link, m in zip(robot.links, mass, strict=True) if not m > 0.0]
        if massless:
            found.append(f'the weight of {_listed(massless)} (no inertia)')
        return tuple(found)

    def _bodies_not_checked(self) -> list[str]:
        found = []
        if self.collision.left_out:
            found.append(f'bodies of {_listed(self.collision.left_out)} (mesh not found)')
        joints = {int(body.parentJoint) - 1 for body in self.collision.geometry.geometryObjects}
        bare = [
            link
            for j, link in enumerate(self.collision.robot.links)
            if j not in joints and link not in self.collision.left_out
        ]
        if bare:
            found.append(f'bodies of {_listed(bare)} (no collision body)')
        if self.collision.touching:
            pairs = [f'{first} and {second}' for first, second in self.collision.touching]
            found.append(f'the clearance of {_listed(pairs)} (touch at zero, no SRDF)')
        return found


def _listed(names: Sequence[str]) -> str:
    most = 4
    more = len(names) - most
    text = ', '.join(names[:most])
    return f'{text} and {more} more' if more > 0 else text
