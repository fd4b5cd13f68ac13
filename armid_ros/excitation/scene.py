# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The bodies of an arm, its floor and its surroundings: what a motion must not touch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from armid_ros.excitation.fitness import not_checked
from armid_ros.excitation.geometry.environment import Obstacle, with_obstacles
from armid_ros.excitation.geometry.floor import find_floor, Floor, floor_obstacles
from armid_ros.excitation.geometry.planning_scene import load_environment
from armid_ros.excitation.limits import Limits, require_radians
from armid_ros.robots import collision_model, CollisionModel, Robot


@dataclass(frozen=True)
class CollisionScene:
    """
    What a motion must not touch.

    Attributes
    ----------
    collision : CollisionModel
        Bodies of the robot.
    floor : Floor
        What it stands on.
    obstacles : sequence of Obstacle
        What stands around it, the floor among it.
    clearance : float
        Between bodies [m].

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
            File with what stands around the arm; by default nothing does.
        progress : callable, optional
            Receives the share of the meshes that is read.

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
        """Return the bodies of the robot together with what stands around it."""
        return with_obstacles(self.collision, self.obstacles)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Return what cannot be checked of any motion."""
        limits = Limits.of(self.collision.robot, speed=1.0)
        return not_checked(limits, self.collision, self.floor, self.obstacles)
