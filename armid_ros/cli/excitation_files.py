# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A design as files: the trajectory three times, numbers, and a page about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import RecordingError
from armid_ros.excitation import (
    Design,
    Obstacle,
    obstacles_alone,
    save_excitation,
    used_shares,
)
from armid_ros.files import json_text, write_file
from armid_ros.motion import Motion
from armid_ros.recording import write_joint_trajectory
from armid_ros.report.excitation_report import excitation_report
from armid_ros.report.provenance import hash_files, Provenance, versions
from armid_ros.robots import CollisionModel
import numpy as np

#: Waypoints per second of the JointTrajectory; controllers interpolate between them.
WAYPOINT_RATE = 50.0
SCHEMA = 'armid/excitation/1'
#: Name of the bag.
BAG = 'trajectory'


@dataclass(frozen=True)
class Plan:
    """
    What a design was made for.

    Attributes
    ----------
    arm : ArmModel
        Prior model.
    robot : str
        Shipped name or path.
    collision : CollisionModel
        Bodies of the robot.
    obstacles : sequence of Obstacle
        What stands around it.
    after : sequence of Path
        Bags that it adds to.
    files : sequence of Path
        What else was read beside the robot.
    seed : int
        Of the search.

    """

    arm: ArmModel
    robot: str
    collision: CollisionModel
    obstacles: Sequence[Obstacle]
    after: Sequence[Path]
    files: Sequence[Path]
    seed: int


def require_free(folder: Path) -> None:
    """Raise a RecordingError where there is a bag already, before a design takes its time."""
    if (folder / BAG).exists():
        raise RecordingError(f'{folder / BAG} exists already; name another --out, or delete it')


def write_plan(folder: Path, plan: Plan, result: Design) -> dict[str, Any]:
    """Fill a folder with a design and return what is in excitation.json."""
    run = result.excitation
    save_excitation(run, folder / 'excitation.yaml')
    save_excitation(run, folder / 'excitation.csv')
    motion = run.motion(WAYPOINT_RATE)
    write_joint_trajectory(folder / BAG, motion, robot_description=plan.arm.robot.urdf)
    document = _document(plan, result, motion)
    page = excitation_report(
        result,
        plan.arm,
        robot=plan.robot,
        collision=plan.collision,
        obstacles=plan.obstacles,
        after=[str(bag) for bag in plan.after],
        provenance=Provenance(
            files=hash_files([plan.robot, *plan.after, *plan.files]),
            versions=versions(),
            seed=plan.seed,
        ),
    )
    write_file(folder / 'report.html', page)
    write_file(folder / 'excitation.json', json_text(document, indent=1))
    return document


def _document(plan: Plan, result: Design, motion: Motion) -> dict[str, Any]:
    information, settings = result.information, result.settings
    bodies = [plan.collision]
    if plan.obstacles:
        bodies.append(obstacles_alone(plan.collision, plan.obstacles))
    clearance = min(float(one.path_clearance(motion.q).min()) for one in bodies)
    shares = used_shares(result.limits, motion, plan.arm.joint_torque(motion))
    return {
        'schema': SCHEMA,
        'robot': plan.robot,
        'joints': list(result.excitation.joints),
        'duration': result.excitation.duration,
        'period': settings.period,
        'speed': settings.speed,
        'criterion': settings.criterion,
        'cost': result.cost,
        'stopped': result.stopped,
        'seed': plan.seed,
        'condition_number': _finite(information.condition),
        'log_det': _finite(information.log_det),
        'rank': int(np.count_nonzero(np.isfinite(information.std))),
        'clearance': _finite(clearance),
        'limits_used': {name: share.tolist() for name, share in shares.items()},
        'parameters': [
            {'name': name.name, 'joint': name.joint, 'std': _finite(std), 'unit': name.unit}
            for name, std in zip(information.parameters, information.std, strict=True)
        ],
    }


def _finite(value: float) -> float | None:
    """Return a number, or None where JSON has none for it."""
    return float(value) if np.isfinite(value) else None
