# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ties: springs between links of two machines, such as an exoskeleton and its wearer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import ModelError
from armid_ros.robots.robot import Robot

#: Tied segments of the leg pair, in the order of the source, F1 to F4.
SEGMENTS = ('swing_shank', 'swing_thigh', 'stance_thigh', 'stance_shank')
#: Joint that moves each segment.
_MOVED_BY = ('swing_knee', 'swing_hip', 'stance_knee', 'stance_ankle')


@dataclass(frozen=True)
class Tie:
    """
    Spring between links of two machines, described by its end points.

    Attributes
    ----------
    name : str
        Name of the tied segment, such as 'swing_shank'.
    joint, other_joint : str
        The joints that move the two links.
    point, other_point : tuple of float, length 3
        The ends of the spring in the frames of these joints [m].

    """

    name: str
    joint: str
    other_joint: str
    point: tuple[float, float, float]
    other_point: tuple[float, float, float]


def centroid_ties(robot: Robot, other: Robot, joints: Sequence[tuple[str, str]]) -> list[Tie]:
    """
    Return springs between the centres of mass of pairs of links.

    Parameters
    ----------
    robot, other : Robot
        The machines; they have the same base frame.
    joints : sequence of (str, str)
        Joint of the machine and joint of the other one for every tie.

    Returns
    -------
    list of Tie
        The ties, named after the machine's links.

    """
    return [
        Tie(
            robot.links[robot.index(own)],
            own,
            far,
            tuple(robot.model.inertias[robot.index(own) + 1].lever.tolist()),
            tuple(other.model.inertias[other.index(far) + 1].lever.tolist()),
        )
        for own, far in joints
    ]


def leg_ties(exo: Robot, human: Robot, segments: Sequence[str] = SEGMENTS) -> tuple[Tie, ...]:
    """
    Return the springs between the shipped exoskeleton and its wearer.

    Raises
    ------
    ModelError
        If a segment does not exist.

    """
    unknown = [segment for segment in segments if segment not in SEGMENTS]
    if unknown:
        raise ModelError(f"unknown segment '{unknown[0]}'; segments are {', '.join(SEGMENTS)}")
    joints = [_MOVED_BY[SEGMENTS.index(segment)] for segment in segments]
    ties = centroid_ties(exo, human, [(f'exo_{j}', f'human_{j}') for j in joints])
    return tuple(replace(tie, name=s) for tie, s in zip(ties, segments, strict=True))
