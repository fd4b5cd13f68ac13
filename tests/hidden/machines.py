# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The robots in which effects are hidden, and what their drives are like."""

from __future__ import annotations

from functools import cache
from importlib.metadata import files

from armid_ros.robots import load_robot, Robot
import numpy as np

from tests.hidden.arrays import body_parts, body_vector, FloatArray

#: Name, where its description is, and the gravity it stands in.
MACHINES = {
    'humanoid_earth': ('humanoid_arm', 'earth'),
    'humanoid_moon': ('humanoid_arm', 'moon'),
    'ur10': ('ur_description/urdf/ur10_robot.urdf', 'earth'),
    'panda': ('panda_description/urdf/panda.urdf', 'earth'),
    'kinova': ('kinova_description/robots/kinova.urdf', 'earth'),
    'xarm7': ('xarm_description/urdf/xarm7.urdf', 'earth'),
}

#: Drives above this torque do not have more friction than one of it [N m].
LARGEST_DRIVE = 100.0


@cache
def load_machine(name: str) -> Robot:
    """Load a robot with the rigid parameters of its description."""
    source, gravity = MACHINES[name]
    return load_published(source, gravity)


def load_published(source: str, gravity: str) -> Robot:
    """Load a shipped robot, or a file of example-robot-data."""
    if source.endswith('.urdf'):
        found = (entry for entry in files('example-robot-data') or [])
        source = str(next(e for e in found if e.as_posix().endswith(source)).locate())
    return load_robot(source, gravity=gravity)


def drive_size(robot: Robot) -> FloatArray:
    """Return what friction and rotors of each joint go by, shape (n,) [N m]."""
    return np.minimum(robot.torque_limit, LARGEST_DRIVE)


def position_range(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the position limits; half a turn either way where there is more room than that."""
    return np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)


def with_rigid_errors(robot: Robot, rng: np.random.Generator) -> Robot:
    """
    Return the robot with every body off by 3 to 10 per cent, still physically possible.

    The mass, the distance of the centre of mass and the inertia about it are each scaled by
    numbers of their own, up or down.

    """
    parameters = robot.rigid_parameters.reshape(-1, 10).copy()
    for values in parameters:
        mass_scale, com_scale, inertia_scale = 1.0 + rng.choice([-1.0, 1.0], 3) * rng.uniform(
            0.03, 0.10, 3
        )
        mass, centre, central = body_parts(values)
        if mass > 0.0:
            values[:] = body_vector(
                mass * mass_scale, centre * com_scale, central * mass_scale * inertia_scale
            )
    return robot.with_inertias(parameters.ravel())
