# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory worth running."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.cli import options
from armid_ros.cli.excite.files import (
    CollisionScene,
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
    Speeds,
)
from armid_ros.cli.excite.springs import COURSES, refuse_other_options, write_course
from armid_ros.cli.groups import gathered, RobotChoice
from armid_ros.cli.terminal import progress, say, Tick
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    ClearanceModel,
    CRITERIA,
    Design,
    design_speeds,
    DesignProblem,
    DesignProgress,
    DesignSettings,
    SPEED_CLASSES,
    TARGETS,
    transfer_limits,
    TransferPlanner,
)
from armid_ros.excitation.fitness import FIT
from armid_ros.excitation.search.parallel import INTERRUPTED
from armid_ros.files import json_text
from armid_ros.identification.rows.signals import conditioning, segments, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import click
import numpy as np

#: The kind of trajectory that is designed.
FOURIER = 'fourier'


@click.command(epilog='Example: armid excite --robot ur5.urdf --duration 40 --out plan')
@options.robot
@options.folder
@click.option(
    '--kind',
    type=click.Choice([FOURIER, *COURSES]),
    default=FOURIER,
    show_default=True,
    help='Designed; or for elastic joints, a bag alone: multisines of torque on the move, steps.',
)
@click.option(
    '--share',
    type=click.FloatRange(0.0, 1.0, min_open=True),
    default=0.1,
    show_default=True,
    help='Of the torque limits (multisine, rms) or of the velocity limits (steps).',
)
@click.option('--duration', default=44.0, show_default=True, help='From rest to rest [s].')
@click.option(
    '--periods',
    type=click.IntRange(min=2),
    default=2,
    show_default=True,
    help='Identical periods in it; their difference is the noise.',
)
@click.option('--harmonics', default=5, show_default=True, help='Per joint.')
@click.option(
    '--speed',
    'speeds',
    type=Speeds(),
    metavar='S,...',
    default='fast',
    show_default=True,
    help=f'{", ".join(SPEED_CLASSES)}, or a share of the limits; several: a folder for each.',
)
@click.option(
    '--criterion',
    type=click.Choice(list(CRITERIA)),
    default='D',
    show_default=True,
    help='; '.join(f'{name}: {what}' for name, what in CRITERIA.items()),
)
@click.option(
    '--target',
    type=click.Choice(list(TARGETS)),
    default='all',
    show_default=True,
    help='; '.join(f'{name}: {what}' for name, what in TARGETS.items()),
)
@click.option(
    '--focus',
    default='',
    metavar='E,...',
    help='Effects to see best, everything else being fitted too.',
)
@options.effects
@click.option(
    '--effect',
    'texts',
    multiple=True,
    metavar='NAME:k=v',
    help='An effect of known size, which counts against the torque limits.',
)
@click.option(
    '--rival',
    metavar='E,...|none',
    help='With --criterion T: what may be there in place of --effect.',
)
@click.option(
    '--model', type=click.Path(path_type=Path), help='model.yaml with what is known of the arm.'
)
@click.option(
    '--start',
    metavar='Q,...',
    help='Pose that the trajectory leaves and returns to [rad or m]; zero by default.',
)
@click.option(
    '--acceleration',
    metavar='A[,...]',
    help='Limit of each joint [rad/s^2 or m/s^2]; top speed in 0.25 s by default.',
)
@click.option(
    '--torque-noise',
    metavar='N[,...]',
    help='Standard deviation at each joint [N m or N]; 1 % of the torque limit by default.',
)
@click.option('--clearance', default=0.01, show_default=True, help='Between links [m].')
@click.option(
    '--environment',
    type=click.Path(path_type=Path),
    help='YAML with what stands around the arm, or a planning scene of MoveIt.',
)
@click.option(
    '--floor',
    metavar='Z|none',
    help='Height of the floor above the origin of the base [m]; without it and without '
    '--environment, the base plane of an arm that stands.',
)
@click.option(
    '--after',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag recorded already: add most to what it tells. May be given several times.',
)
@click.option('--starts', default=4, show_default=True, help='Searches from other beginnings.')
@click.option('--iterations', default=150, show_default=True, help='Of each search.')
@click.option(
    '--time-budget', default=120.0, show_default=True, help='At most so long for a design [s].'
)
@options.gravity
@options.joints
@options.seed
@options.reading
@options.as_json
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
    space = limits.workspace(loaded)
    if motion.kind in COURSES:
        write_course(motion, space, search.seed, out)
        return
    arm, rival = model.arms(loaded)
    settings = design_settings(loaded, motion, model, limits, search)
    planners = {
        speed: _planner(arm, settings, speed, space) for speed in dict.fromkeys(motion.speeds)
    }
    given = options.per_joint(limits.start, loaded, '--start')
    start, zero_fault = _start(given, planners[motion.speeds[0]])
    files = tuple(filter(None, (model.model, limits.environment)))
    plan = ExcitationPlan(arm, robot.robot_source, space, start, search.after, files, search.seed)
    folders = {s: out if len(motion.speeds) == 1 else out / f'{s}' for s in motion.speeds}
    for folder in folders.values():
        require_free(folder)
        options.hold(folder, SCHEMA, robot.robot_source)
    known = _known(arm, settings, search.after, search.seed) if search.after else None
    task = _Task(plan, settings, rival, known)
    missing = list(folders)
    for number, (speed, folder) in enumerate(folders.items()):
        with progress('designing') as tick:
            result = task.design(speed, _share(tick, number, len(folders)))
            tick((number + 1.0) / len(folders), 'writing')
            written = write_plan(folder, plan, result, planners[speed])
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
        if value != 0.0
    ]
    if not moved:
        return 'zero'
    return ', '.join(moved) + (', the others at zero' if len(moved) < len(q) else '')
