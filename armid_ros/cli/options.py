# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options that several commands have, and what they stand for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.cli import columns
from armid_ros.effects import make_effect
from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray
from armid_ros.recording import read_robot_description, Recording
from armid_ros.recording.ros1 import is_ros1
from armid_ros.recording.tables import is_table
from armid_ros.robots import load_robot, Robot, robot_from_urdf
import click
import numpy as np

Corners = tuple[Sequence[float], Sequence[float]]

DEFAULT_EFFECTS = 'viscous_friction,coulomb_friction,torque_offset'

robot = click.option(
    '--robot',
    'robot_source',
    required=True,
    metavar='R',
    help='Shipped name, path of a URDF or xacro ("arm.xacro tool:=true" with '
    'arguments), or - for the /robot_description in the bag.',
)
gravity = click.option(
    '--gravity', default='earth', show_default=True, help='earth, moon, or a vector x,y,z [m/s^2].'
)
joints = click.option(
    '--joints', default=None, metavar='A,B,...', help='Driven joints; all but grippers by default.'
)
effects = click.option(
    '--effects',
    default=DEFAULT_EFFECTS,
    show_default=True,
    metavar='E,...',
    help="What acts beside the rigid body; 'E@joint+joint' for some joints only.",
)
folder = click.option(
    '--out',
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help='Folder to fill.',
)
bag = click.option(
    '--out', required=True, type=click.Path(path_type=Path), help='Bag to write; must not exist.'
)
seed = click.option('--seed', default=0, show_default=True, help='Of every random number.')
as_json = click.option('--json', 'as_json', is_flag=True, help='Print the result as JSON.')


def open_robot(source: str, gravity: str, joints: str | None, bags: Sequence[Path] = ()) -> Robot:
    """Load the robot that --robot, --gravity and --joints ask for."""
    chosen = tuple(joints.split(',')) if joints else None
    if source != '-':
        return load_robot(source, gravity=gravity, joints=chosen)
    for path in bags:
        text = None if is_table(path) or is_ros1(path) else read_robot_description(path)
        if text is not None:
            return robot_from_urdf(text, gravity=gravity, joints=chosen, source=str(path))
    raise RobotError(
        f'no /robot_description in {", ".join(map(str, bags)) or "any bag"}; '
        'name the URDF with --robot'
    )


def with_effects(arm: ArmModel, names: str) -> ArmModel:
    """Add the effects that --effects names, but for those that the arm has."""
    for name in filter(None, names.split(',')):
        effect = make_effect(name, arm.robot)
        if (effect.name, effect.joints) not in [(own.name, own.joints) for own in arm.effects]:
            arm = arm.with_effect(effect)
    return arm


def box(text: str, robot: Robot) -> tuple[str, Corners]:
    """Read --box: a joint of the robot, and two corners [m]."""
    joint, _, corners = text.partition('=')
    robot.index(joint)
    try:
        lower, upper = ([float(x) for x in corner.split(',')] for corner in corners.split(':'))
    except ValueError:
        lower = upper = []
    if len(lower) != 3 or len(upper) != 3:
        raise RobotError(f"--box '{text}' has to be JOINT=X,Y,Z:X,Y,Z, two corners in metres")
    return joint, (lower, upper)


def per_joint(text: str | None, robot: Robot, option: str) -> FloatArray | None:
    """Read one number for all joints, or one for each; None where there is no text."""
    if text is None:
        return None
    try:
        values = np.array([float(part) for part in text.split(',')])
    except ValueError:
        values = np.empty(0)
    if len(values) not in (1, robot.n_joints) or not np.all(np.isfinite(values)):
        raise RobotError(
            f'{option} takes a number, or {robot.n_joints} with commas for '
            f"{', '.join(robot.joints)}; not '{text}'"
        )
    return np.broadcast_to(values, robot.n_joints).copy()


def read(bags: Sequence[Path], robot: Robot, topic: str | None) -> list[Recording]:
    """Read what bags, or tables, hold of the robot's joints."""
    return columns.read(bags, robot, topic)


def kept_source(source: str, robot: Robot, out: Path) -> str:
    """Return how files in a folder refer to the robot; one from a bag is put beside them."""
    if source == '-':
        (out / 'robot.urdf').write_text(robot.urdf, encoding='utf-8')
        return 'robot.urdf'
    path, *arguments = source.split(' ') if ':=' in source else [source]
    kept = str(Path(path).resolve()) if Path(path).is_file() else path
    return ' '.join([kept, *arguments])
