# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The robot whose motion is planned: its arm joints, with limits that people give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

#: Position limits of a revolute joint beyond two turns, rounded, may be degrees [rad].
_TWO_TURNS = 1.01 * 4.0 * math.pi


def require_radians(robot: Robot) -> None:
    """Raise a TrajectoryError where a revolute joint has limits beyond two turns."""
    for joint, lower, upper, slides in zip(
        robot.joints, robot.lower, robot.upper, robot.prismatic, strict=True
    ):
        ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
        if not slides and max(ends, default=0.0) > _TWO_TURNS:
            raise TrajectoryError(
                f'{robot.name}: joint {joint} has position limits {lower:g} and {upper:g} rad, '
                'beyond two turns; are these degrees? Write them in radians, or make the joint '
                'continuous'
            )


def with_joint_limits(
    robot: Robot, path: str | Path | None = None, velocity: Sequence[str] = ()
) -> tuple[Robot, FloatArray | None]:
    """
    Return a robot with velocity limits that are given, and the acceleration limits.

    Parameters
    ----------
    robot : Robot
        The arm.
    path : str or Path, optional
        ``joint_limits.yaml`` of MoveIt; limits apply where its ``has_..._limits`` says so. A
        velocity limit above that of the description is not taken.
    velocity : sequence of str
        'joint:=value' [rad/s or m/s]; these replace all others.

    Returns
    -------
    robot : Robot
        With these velocity limits.
    acceleration : ndarray, shape (n,), or None
        Limits [rad/s^2 or m/s^2], NaN where none is given; None without a file.

    Raises
    ------
    TrajectoryError
        If the file has no limits of joints, a limit is not positive, or a joint is unknown.

    """
    top = np.array(robot.velocity_limit)
    acceleration = None
    if path:
        acceleration = np.full(robot.n_joints, np.nan)
        with reading(path, TrajectoryError):
            document = load_yaml(read_text(Path(path), TrajectoryError))
        entries = document.get('joint_limits') if isinstance(document, dict) else None
        if not isinstance(entries, dict):
            raise TrajectoryError(f'{path}: no mapping joint_limits, as MoveIt has it')
        for j, joint in enumerate(robot.joints):
            entry = entries.get(joint)
            if entry is None:
                continue
            if not isinstance(entry, dict):
                raise TrajectoryError(f'{path}: joint {joint}: no mapping of limits')
            if entry.get('has_velocity_limits'):
                given = _positive(entry.get('max_velocity'), f'{path}: {joint}: max_velocity')
                top[j] = min(top[j], given) if top[j] > 0.0 else given
            if entry.get('has_acceleration_limits'):
                acceleration[j] = _positive(
                    entry.get('max_acceleration'), f'{path}: {joint}: max_acceleration'
                )
    for text in velocity:
        joint, assigned, number = text.partition(':=')
        if not assigned or joint not in robot.joints:
            raise TrajectoryError(
                f"velocity '{text}': write joint:=value for one of {', '.join(robot.joints)}"
            )
        top[robot.joints.index(joint)] = _positive(number, f'velocity of joint {joint}')
    return replace(robot, velocity_limit=top), acceleration


def _positive(value: Any, where: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise TrajectoryError(f"{where} has to be a positive number, not '{value}'")
    return number
