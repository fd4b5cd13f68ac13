# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options for a machine or a person that was recorded beside the arm, and what they stand for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TYPE_CHECKING, TypeVar

from armid_ros.errors import ModelError
from armid_ros.files.cells import listed, parted
import click

if TYPE_CHECKING:
    from armid_ros.effects.tied import Partner
    from armid_ros.model.spring_ties import Tie
    from armid_ros.recording import Recording
    from armid_ros.robots import Robot

_Command = TypeVar('_Command', bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        '--partner',
        metavar='R',
        help='Shipped name, URDF or xacro of a machine or person in the same bags that the arm '
        'may be tied to.',
    ),
    click.option('--partner-topic', help="The partner's JointState topic, where several name it."),
    click.option(
        '--tie',
        'ties',
        multiple=True,
        metavar='JOINT=JOINT',
        help='Where they may be tied: a joint of the arm and one of the partner. JOINT@X,Y,Z sets '
        'a point of the link [m]; the centroid by default. By default links of equal number.',
    ),
)


def options(command: _Command) -> _Command:
    """Give a command the options --partner, --partner-topic and --tie."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def open_partner(
    source: str | None, ties: Sequence[str], robot: Robot, gravity: str
) -> Partner | None:
    """
    Load the partner of --partner and --tie; None without partner.

    Raises
    ------
    ModelError
        If it is not clear where the two may be tied, or a tie names no joint.

    """
    from armid_ros.effects.tied import Partner
    from armid_ros.robots import load_robot

    if source is None:
        if ties:
            raise ModelError('give both --tie, where the arm is tied, and --partner, to what')
        return None
    other = load_robot(source, gravity=gravity)
    kept = str(Path(source).resolve()) if Path(source).is_file() else source
    found = [_tie(text, robot, other) for text in ties] or _equal_links(robot, other)
    return Partner(other, tuple(found), kept)


def read_together(
    bags: Sequence[Path],
    recordings: Sequence[Recording],
    partner: Partner,
    topic: str | None,
) -> list[Recording]:
    """Add the motion of the partner, from the same bags, to recordings of the arm."""
    from armid_ros.cli import options
    from armid_ros.recording import read_recording, recorded_together

    joints, how = partner.robot.joints, options.read_settings()
    others = [read_recording(bag, joints=joints, topic=topic, settings=how) for bag in bags]
    options.tell_damage(*others)
    return [
        recorded_together(recording, other, partner.robot, partner.ties)
        for recording, other in zip(recordings, others, strict=True)
    ]


def _equal_links(robot: Robot, other: Robot) -> list[Tie]:
    from armid_ros.model.spring_ties import centroid_ties, leg_ties

    if (robot.name, other.name) == ('exoskeleton_legs', 'human_legs'):
        return list(leg_ties(robot, other))
    if robot.n_joints != other.n_joints:
        raise ModelError(
            f'{robot.name} has {robot.n_joints} joints and {other.name} {other.n_joints}: say '
            f'where they may be tied with --tie JOINT=JOINT; joints of {robot.name} are '
            f'{", ".join(robot.joints)}, of {other.name} {", ".join(other.joints)}'
        )
    return centroid_ties(robot, other, list(zip(robot.joints, other.joints, strict=True)))


def _tie(text: str, robot: Robot, other: Robot) -> Tie:
    from armid_ros.model.spring_ties import centroid_ties

    ends = [[*listed(end, '@'), ''] for end in parted(text, '=')]
    if len(ends) != 2:
        raise ModelError(f"--tie '{text}' has to be JOINT=JOINT, of the arm and of its partner")
    (joint, point, *_), (far, far_point, *_) = ends
    (tie,) = centroid_ties(robot, other, [(joint, far)])
    return replace(
        tie,
        point=_point(text, point) if point else tie.point,
        other_point=_point(text, far_point) if far_point else tie.other_point,
    )


def _point(text: str, numbers: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(number) for number in numbers.split(','))
    except ValueError:
        raise ModelError(f"--tie '{text}': a point is X,Y,Z in the joint's frame [m]") from None
    return x, y, z
