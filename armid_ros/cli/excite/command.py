# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory worth running."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.cli import options
from armid_ros.cli.excite.files import (
    ExcitationPlan,
    require_free,
    SCHEMA,
    write_plan,
    Written,
)
from armid_ros.cli.excite.options import (
    design_settings,
    LimitOptions,
    ModelOptions,
    MotionOptions,
    SearchOptions,
)
from armid_ros.cli.excite.springs import COURSES, refuse_other_options, write_course
from armid_ros.cli.groups import gathered, RobotChoice
from armid_ros.cli.terminal import progress, say, Tick
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    ClearanceModel,
    CollisionScene,
    Design,
    design_speeds,
    DesignProblem,
    DesignProgress,
    DesignSettings,
    transfer_limits,
    TransferPlanner,
    with_joint_limits,
)
from armid_ros.excitation.fitness import FIT
from armid_ros.excitation.search.parallel import INTERRUPTED
from armid_ros.files import json_text
from armid_ros.identification.rows.signals import conditioning, segments, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.robots import joints_beside_arms, Robot
import click
import numpy as np

#: The kind of trajectory that is designed.
FOURIER = 'fourier'


@gathered(
    robot=RobotChoice,
    motion=MotionOptions,
    model=ModelOptions,
    limits=LimitOptions,
    search=SearchOptions,
)
def excite(
    robot: RobotChoice,
    out: Path,
    motion: MotionOptions,
    model: ModelOptions,
    limits: LimitOptions,
    search: SearchOptions,
    as_json: bool,
) -> None:
    """Design a trajectory that shows the parameters, inside all limits and free of collisions."""
    refuse_other_options(click.get_current_context())
    loaded = robot.load(search.after)
    others = () if robot.joints else joints_beside_arms(loaded)
    if others:
        names = ','.join(joint for joint in loaded.joints if joint not in others)
        loaded = replace(robot, joints=names).load(search.after)
        drives = f'{", ".join(others)}; --joints A,B,... drives them'
        say(f'not driven, as they belong to no arm: {drives}', 'yellow')
    loaded, acceleration = with_joint_limits(loaded, limits.joint_limits, limits.velocity)
    space = limits.workspace(loaded)
    if motion.kind in COURSES:
        write_course(motion, space, search.seed, out)
        return
    arm, rival = model.arms(loaded)
    settings = design_settings(loaded, acceleration, motion, model, limits, search)
    planners = {
        speed: _planner(arm, settings, speed, space) for speed in dict.fromkeys(motion.speeds)
    }
    given = options.per_joint(limits.start, loaded, '--start')
    start, zero_fault = _start(given, planners[motion.speeds[0]])
    files = tuple(filter(None, (model.model, limits.environment, limits.joint_limits)))
    plan = ExcitationPlan(arm, robot.robot_source, space, start, search.after, files, search.seed)
    folders = {s: out if len(motion.speeds) == 1 else out / f'{s}' for s in motion.speeds}
    for folder in folders.values():
        require_free(folder)
    staged = {s: options.stage(f, SCHEMA, robot.robot_source) for s, f in folders.items()}
    known = _known(arm, settings, search.after, search.seed) if search.after else None
    task = _Task(plan, settings, rival, known)
    missing = list(folders)
    for number, (speed, folder) in enumerate(folders.items()):
        with progress('designing') as tick:
            result = task.design(speed, _share(tick, number, len(folders)))
            tick((number + 1.0) / len(folders), 'writing')
            written = write_plan(staged[speed], plan, result, planners[speed])
        missing.remove(speed)
        if as_json:
            click.echo(json_text(written.document))
        else:
            _tell(folder, result, written, plan, zero_fault, given is not None)
        if result.stopped == INTERRUPTED:
            break
    if missing:
        click.echo(f'interrupted before {", ".join(map(str, missing))}', err=True)


def _share(tick: Tick, number: int, count: int) -> Callable[[str | float, DesignProgress], None]:
    """Return what shows the progress of one design of several."""

    def told(speed: str | float, now: DesignProgress) -> None:
        tick((number + now.done) / count, f'designing {speed}, cost {now.cost:.2f}')

    return told


@dataclass(frozen=True)
class _Task:
    """What is designed at every speed: the plan, the rival, and the prior information."""

    plan: ExcitationPlan
    settings: DesignSettings
    rival: ArmModel | None
    known: FloatArray | None

    def design(
        self, speed: str | float, told: Callable[[str | float, DesignProgress], None]
    ) -> Design:
        """Return the design for one speed."""
        return design_speeds(
            self.plan.arm,
            self.settings,
            np.random.default_rng(self.plan.seed),
            speeds=[speed],
            collision=self.plan.workspace.bodies,
            prior_information=self.known,
            rival=self.rival,
            progress=told,
        )[speed]


def _planner(
    arm: ArmModel,
    settings: DesignSettings,
    speed: str | float,
    space: CollisionScene,
) -> TransferPlanner:
    """Return what plans the ways to a run of some speed, and back."""
    return TransferPlanner(
        arm,
        transfer_limits(arm.robot, speed, settings.acceleration),
        ClearanceModel.of(space.bodies),
        settings.clearance,
    )


def _start(given: FloatArray | None, planner: TransferPlanner) -> tuple[FloatArray, str]:
    """Return the pose to start from, and what is wrong with zero where it is not zero."""
    if given is None:
        return planner.free_start()
    fault = planner.fault(given)
    if fault:
        raise TrajectoryError(f'--start: {fault}')
    return given, ''


def _known(arm: ArmModel, settings: DesignSettings, bags: Sequence[Path], seed: int) -> FloatArray:
    """Return the information that recordings hold already, shape (r, r)."""
    recordings = options.read(bags, arm.robot, None)
    used = conditioning(recordings, SignalSettings())
    problem = DesignProblem.of(arm, settings, np.random.default_rng(seed))
    size = len(problem.base.parameters)
    matrix = np.zeros((size, size))
    for recording in recordings:
        for motion in segments(recording, used):
            thinned = motion.select(slice(None, None, used.decimation))
            duration = float(motion.t[-1] - motion.t[0])
            matrix += problem.information(thinned, duration * settings.rate).matrix
    return matrix


def _tell(
    folder: Path,
    result: Design,
    written: Written,
    plan: ExcitationPlan,
    zero_fault: str,
    given: bool,
) -> None:
    document, run = written.document, written.run
    unseen = sum(row['std'] is None for row in document['parameters'])
    say(
        f'{result.settings.speed}: condition number {document["condition_number"] or np.inf:.1f}, '
        f'{len(document["parameters"])} parameters' + (f', {unseen} not seen' if unseen else '')
    )
    say(str(written.fitness), 'green' if written.fitness.word == FIT else 'yellow')
    whose = 'as given' if given else 'the zero of the description'
    if zero_fault:
        whose = f'the zero of the description is not free: {zero_fault}'
    say(
        f'starts at rest at {_pose(plan.arm.robot, run.approach.q[0])} ({whose}), is on the '
        f'trajectory after {run.approach.duration:.1f} s and back after {run.duration:.1f} s'
    )
    if result.stopped:
        say(f'stopped early ({result.stopped}): the best so far, not what the seed would give')
    say(f'{folder}: excitation.yaml, excitation.csv, trajectory (a bag), report.html')


def _pose(robot: Robot, q: FloatArray) -> str:
    """Name the joints that are not at zero."""
    moved = [
        f'{joint} {value:.3g} {unit}'
        for joint, value, unit in zip(robot.joints, q, robot.position_units, strict=True)
        if value != 0.0  # noqa: RUF069 - joints that stay are put to zero
    ]
    if not moved:
        return 'zero'
    return ', '.join(moved) + (', the others at zero' if len(moved) < len(q) else '')
