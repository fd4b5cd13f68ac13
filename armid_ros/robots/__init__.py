# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Loading of robots from URDF, xacro and MJCF files, and the robots shipped with the package.

`load_robot` returns a `Robot` from a shipped name, a URDF or xacro file, or the text of a URDF. A
`Robot` holds the rigid-body model of the driven joints, their limits and the gravity vector.
`collision_model` computes distances between the links.

"""

from armid_ros.robots.geometry import collision_model, CollisionModel
from armid_ros.robots.load import (
    described_at,
    load_robot,
    read_mounting,
    robot_from_urdf,
    shipped_robots,
)
from armid_ros.robots.robot import (
    GRAVITIES,
    NO_MASS,
    parse_gravity,
    Robot,
)
from armid_ros.robots.selection import (
    driven_in_words,
    held_joints,
    HeldJoint,
    joints_beside_arms,
    load_arms,
)

__all__ = [
    'load_robot',
    'robot_from_urdf',
    'shipped_robots',
    'driven_in_words',
    'joints_beside_arms',
    'load_arms',
    'held_joints',
    'HeldJoint',
    'described_at',
    'Robot',
    'NO_MASS',
    'parse_gravity',
    'GRAVITIES',
    'collision_model',
    'CollisionModel',
    'read_mounting',
]
