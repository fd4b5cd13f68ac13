# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reading of the floor height from a mounting file beside the description of a robot."""

from __future__ import annotations

import math
from pathlib import Path

from armid_ros.errors import RobotError
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.robots.robot import Robot

#: Suffix of the mounting file beside NAME.urdf or NAME.urdf.xacro.
SUFFIX = '.mounting.yaml'


def read_mounting(robot: Robot) -> tuple[float | None, Path] | None:
    """
    Read NAME.mounting.yaml beside the description of a robot; return None without a file.

    Returns
    -------
    floor : float or None
        Height of the floor above the origin of the base [m]; None: no floor is within reach.
    path : Path
        The mounting file.

    Raises
    ------
    RobotError
        If the file cannot be read, or does not contain `floor: HEIGHT` or `floor: none`.

    """
    if robot.path is None:
        return None
    stem = robot.path.name.removesuffix('.xacro').removesuffix('.urdf')
    path = robot.path.with_name(stem + SUFFIX)
    if not path.is_file():
        return None
    with reading(path, RobotError):
        content = load_yaml(read_text(path, RobotError))
    floor = content.get('floor') if isinstance(content, dict) else None
    if floor == 'none':
        return None, path
    if isinstance(floor, bool) or not isinstance(floor, int | float) or not math.isfinite(floor):
        raise RobotError(f'{path}: has to say floor: HEIGHT [m], or floor: none')
    return float(floor), path
