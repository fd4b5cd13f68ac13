# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A design as files: the trajectory three times, numbers, and a page about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import os
from pathlib import Path
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import RecordingError, TrajectoryError
from armid_ros.excitation import (
    CollisionScene,
    Design,
    Excitation,
    Fitness,
    fitness,
    plan_run,
    Run,
    save_excitation,
    TransferPlanner,
)
from armid_ros.files import json_text, settled, Staged, write_file
from armid_ros.files.own import is_plan
from armid_ros.motion import FloatArray
from armid_ros.recording import write_joint_trajectory
from armid_ros.report.excitation_report import CheckedRun, excitation_report
from armid_ros.report.provenance import hash_files, Provenance, versions
import click
import numpy as np

#: Waypoints per second of the JointTrajectory; controllers interpolate between them.
WAYPOINT_RATE = 50.0
SCHEMA = 'armid/excitation/1'
#: Name of the bag.
BAG = 'trajectory'


@dataclass(frozen=True)
class ExcitationPlan:
    """
    What a design was made for.

    Attributes
    ----------
    arm : ArmModel
        Prior model.
    robot : str
        Shipped name or path.
    workspace : CollisionScene
        What it must not touch.
    start : ndarray, shape (n,)
        Pose to leave from and to return to [rad or m].
    after : sequence of Path
        Bags that it adds to.
    files : sequence of Path
        What else was read beside the robot.
    seed : int
        Of the search.

    """

    arm: ArmModel
    robot: str
    workspace: CollisionScene
    start: FloatArray
    after: Sequence[Path]
    files: Sequence[Path]
    seed: int


@dataclass(frozen=True)
class Written:
    """
    What was written.

    Attributes
    ----------
    document : dict
        What is in excitation.json.
    run : Run
        What is in the bag.
    fitness : Fitness
        What was checked of it.

    """

    document: dict[str, Any]
    run: Run
    fitness: Fitness


def require_free(folder: Path) -> None:
    """Raise a RecordingError where a recording is already, before a design takes its time."""
    if any(folder.glob('*.mcap')) or (folder / 'metadata.yaml').exists():
        raise RecordingError(f'{folder} is a recording; name another --out')
    if os.path.lexists(folder / BAG) and not is_plan(folder / BAG):
        raise RecordingError(
            f'{folder / BAG}: is no trajectory of armid excite; name another --out, or move it '
            'away'
        )


def write_plan(
    staged: Staged, plan: ExcitationPlan, result: Design, planner: TransferPlanner
) -> Written:
    """
    Fill a folder with a design; what took longest to find is written first.

    Raises
    ------
    TrajectoryError
        If no way leads from the start to the trajectory; its coefficients are written then, where
        that does not take the place of an earlier design.

    """
    folder = staged.folder
    _save_coefficients(folder, result.excitation)
    try:
        run = plan_run(result.excitation, planner, plan.start, WAYPOINT_RATE, seed=plan.seed)
    except TrajectoryError as error:
        held = f'{staged.out}: stays as it was'
        if staged.alone:
            staged.keep()
            held = f'{staged.out / "excitation.yaml"} holds the design'
        raise TrajectoryError(
            f'{held}, but there is no {BAG}: {error}; take another --start, or another --seed'
        ) from error
    result = replace(result, excitation=run.excitation)
    _save_coefficients(folder, result.excitation)
    write_joint_trajectory(folder / BAG, run.motion(), robot_description=plan.arm.robot.urdf)
    space = plan.workspace
    checked = fitness(run, result.limits, space.collision, space.floor, space.obstacles)
    document = _document(plan, result, run, checked)
    write_file(folder / 'excitation.json', json_text(document, indent=1))
    _write_page(folder / 'report.html', plan, result, run, checked)
    staged.keep()
    return Written(document, run, checked)


def _save_coefficients(folder: Path, excitation: Excitation) -> None:
    for name in ('excitation.yaml', 'excitation.csv'):
        save_excitation(excitation, folder / name)


def _write_page(
    path: Path, plan: ExcitationPlan, result: Design, run: Run, checked: Fitness
) -> None:
    """Write the report; what goes wrong there is said, and costs nothing else."""
    try:
        page = excitation_report(
            result,
            plan.arm,
            robot=plan.robot,
            scene=plan.workspace,
            after=[str(bag) for bag in plan.after],
            provenance=Provenance(
                files=hash_files([plan.robot, *plan.after, *plan.files]),
                versions=versions(),
                seed=plan.seed,
            ),
            planned=CheckedRun(run, checked),
        )
        write_file(path, page)
    except Exception as error:  # whatever it is, the trajectory is written and good
        click.echo(f'{settled(path)}: not written: {type(error).__name__}: {error}', err=True)


def _document(plan: ExcitationPlan, result: Design, run: Run, checked: Fitness) -> dict[str, Any]:
    information, settings = result.information, result.settings
    used = result.limits_used(plan.arm)
    nearest, floor = checked.nearest, plan.workspace.floor
    return {
        'schema': SCHEMA,
        'robot': plan.robot,
        'verdict': checked.word,
        'summary': str(checked),
        'not_checked': list(checked.unchecked),
        'joints': list(result.excitation.joints),
        'duration': result.excitation.duration,
        'period': settings.period,
        'start': plan.start.tolist(),
        'approach': run.approach.duration,
        'trajectory_duration': run.duration,
        'floor': {'height': floor.height, 'source': floor.source},
        'lowest_point': {
            'height': _finite(checked.lowest.height),
            'link': checked.lowest.link,
            'time': checked.lowest.time,
        },
        'speed': settings.speed,
        'criterion': settings.criterion,
        'cost': result.cost,
        'stopped': result.stopped,
        'seed': plan.seed,
        'condition_number': _finite(information.condition),
        'log_det': _finite(information.log_det),
        'rank': int(np.count_nonzero(np.isfinite(information.std))),
        'clearance': None if nearest is None else nearest.distance,
        'limits_used': {name: share.tolist() for name, share in used.items()},
        'parameters': [
            {'name': name.name, 'joint': name.joint, 'std': _finite(std), 'unit': name.unit}
            for name, std in zip(information.parameters, information.std, strict=True)
        ],
    }


def _finite(value: float) -> float | None:
    """Return a number, or None where JSON has none for it."""
    return float(value) if np.isfinite(value) else None
