# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Files that say what stands around an arm."""

from __future__ import annotations

from pathlib import Path
import re

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.environment import Obstacle, parse_obstacles
from armid_ros.excitation.geometry.planning_scene import is_scene, read_scene_file, scene_obstacles
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.robots import Robot


def load_environment(path: str | Path, robot: Robot | None = None) -> tuple[Obstacle, ...]:
    """
    Read obstacles from a file.

    Parameters
    ----------
    path : str or Path
        A YAML list of mappings with the attributes of `Obstacle`; what `ros2 topic echo --once
        --full-length /monitored_planning_scene` prints, the world or a collision object of it, in
        YAML or JSON; or a .scene file of MoveIt.
    robot : Robot, optional
        Whose frames a planning scene may name; without it all is taken to be in the base frame.

    Raises
    ------
    TrajectoryError
        If the file cannot be read or an entry is not an obstacle.

    """
    path = Path(path)
    text = read_text(path, TrajectoryError)
    with reading(path, TrajectoryError):
        if path.suffix == '.scene':
            return read_scene_file(text)
        document = load_yaml(re.split(r'^---$', text.removeprefix('---\n'), flags=re.M)[0])
        if is_scene(document):
            return scene_obstacles(document, robot)
        return parse_obstacles(path, document)
