# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The leg pair that is free to walk: the hips of both machines are floating joints.

The root of a description moves from the foot to the trunk, so that either foot can be on the
ground. Two slides and a hinge connect ground and trunk; hip, knee and ankle of each leg follow.
Bodies, inertias and anatomical angles do not change.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.model.spring_ties import centroid_ties
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.assumptions import read_assumptions
from armid_ros.papers.exo.plant.leg_pair import TiedPair
from armid_ros.papers.exo.plant.walkable import LegLength
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.load import robot_from_urdf
import numpy as np
import numpy.typing as npt
import pinocchio as pin

SIDES = ('right', 'left')
#: Joints of the trunk: forward and up [m], lean [rad].
FLOATING = ('forward', 'up', 'lean')
_LEG = ('hip', 'knee', 'ankle')
#: Links of a leg and their axes: flexion and dorsiflexion are positive.
_LINKS, _AXES = ('thigh', 'shank', 'foot'), ('0 -1 0', '0 1 0', '0 -1 0')
#: Springs of a walking pair, as many as there are thighs and shanks.
SEGMENTS = tuple(f'{side}_{link}' for side in SIDES for link in ('shank', 'thigh'))


def walker(robot: Robot) -> Robot:
    """
    Convert a body on one foot to a body with a floating trunk.

    Parameters
    ----------
    robot : Robot
        A shipped body, such as human_legs.

    Returns
    -------
    Robot
        With the joints forward, up and lean of the trunk, and hip, knee and ankle of both legs,
        each with the prefix of the body.

    """
    prefix = robot.joints[0].split('_')[0]
    trunk, parent = f'{prefix}_trunk', f'{prefix}_ground'
    parts = [f'<robot name="{robot.name.replace("legs", "walker")}"><link name="{parent}"/>']
    for joint, child, axis, of in (
        (FLOATING[0], f'{prefix}_forward_slide', '1 0 0', None),
        (FLOATING[1], f'{prefix}_up_slide', '0 0 1', None),
        (FLOATING[2], trunk, '0 1 0', 'stance_hip'),
    ):
        body = None if of is None else robot.model.inertias[robot.index(f'{prefix}_{of}') + 1]
        parts.append(_hung(f'{prefix}_{joint}', parent, child, axis, body))
        parent = child
    lengths = leg_length(robot)
    for side in SIDES:
        parent = trunk
        ends = (0.0, -lengths.thigh, -lengths.shank)
        for joint, link, axis, end in zip(_LEG, _LINKS, _AXES, ends, strict=True):
            child = f'{prefix}_{side}_{link}'
            body = robot.model.inertias[robot.index(f'{prefix}_swing_{joint}') + 1]
            parts.append(_hung(f'{prefix}_{side}_{joint}', parent, child, axis, body, end))
            parent = child
    return robot_from_urdf(''.join([*parts, '</robot>']), source=robot.name)


def leg_length(robot: Robot) -> LegLength:
    """Return the lengths of the legs of a shipped body, on one foot or free to walk."""
    assumed = read_assumptions()['segment_length'].value
    prefix = robot.joints[0].split('_')[0]
    side = 'right' if f'{prefix}_right_knee' in robot.joints else 'swing'
    knee, ankle = (
        robot.model.jointPlacements[robot.index(f'{prefix}_{side}_{joint}') + 1].translation
        for joint in ('knee', 'ankle')
    )
    return LegLength(float(-knee[2]), float(-ankle[2]), float(assumed['foot']))


def walking_pair(stiffness: npt.ArrayLike | None = None) -> TiedPair:
    """
    Return the shipped pair with springs at both shanks and thighs, free to walk.

    Parameters
    ----------
    stiffness : array_like, optional
        Stiffness of all springs or of each [N/m]; by default that of ``assumptions.yaml``.

    """
    exo, human = (walker(load_robot(name)) for name in ('exoskeleton_legs', 'human_legs'))
    moved = {'shank': 'knee', 'thigh': 'hip'}
    joints = [f'{s.split("_")[0]}_{moved[s.split("_")[1]]}' for s in SEGMENTS]
    ties = centroid_ties(exo, human, [(f'exo_{j}', f'human_{j}') for j in joints])
    named = tuple(replace(tie, name=s) for tie, s in zip(ties, SEGMENTS, strict=True))
    if stiffness is None:
        stiffness = read_assumptions()['interaction_stiffness'].value
    return TiedPair(exo, human, named, np.asarray(stiffness, dtype=float))


def columns(robot: Robot, side: str) -> list[int]:
    """Return the indices of hip, knee and ankle of a leg."""
    prefix = robot.joints[0].split('_')[0]
    return [robot.index(f'{prefix}_{side}_{joint}') for joint in _LEG]


def floating(robot: Robot) -> list[int]:
    """Return the indices of forward, up and lean of the trunk."""
    prefix = robot.joints[0].split('_')[0]
    return [robot.index(f'{prefix}_{name}') for name in FLOATING]


def contacts(robot: Robot) -> tuple[list[str], FloatArray]:
    """Return joints and points of right heel, right toe, left heel and left toe, (4, 3) [m]."""
    prefix = robot.joints[0].split('_')[0]
    ankles = [f'{prefix}_{side}_ankle' for side in SIDES for _ in range(2)]
    return ankles, np.tile([[0.0, 0.0, 0.0], [leg_length(robot).foot, 0.0, 0.0]], (2, 1))


def _hung(
    joint: str, parent: str, child: str, axis: str, body: pin.Inertia | None, up: float = 0.0
) -> str:
    """Return the URDF of a joint and the link that it moves; one without a body slides."""
    kind, far, inside = 'prismatic', '1000', ''
    if body is not None:
        kind, far = 'revolute', '3.2'
        lever = ' '.join(map(repr, body.lever.tolist()))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia.tolist()
        inside = (
            f'<inertial><origin xyz="{lever}"/><mass value="{body.mass!r}"/><inertia ixx="{xx!r}" '
            f'ixy="{xy!r}" ixz="{xz!r}" iyy="{yy!r}" iyz="{yz!r}" izz="{zz!r}"/></inertial>'
        )
    return (
        f'<joint name="{joint}" type="{kind}"><origin xyz="0 0 {up!r}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>'
        f'<limit lower="-{far}" upper="{far}" velocity="100" effort="1e6"/></joint>'
        f'<link name="{child}">{inside}</link>'
    )
