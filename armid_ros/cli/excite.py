# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid excite`: design of an excitation trajectory."""

from __future__ import annotations

from dataclasses import replace
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.cli import parameters
from armid_ros.cli.choices import CRITERIA, MAX_DURATION, SPEED_CLASSES, TARGETS
from armid_ros.cli.terminal import progress, say
from armid_ros.errors import RecordingError, TrajectoryError
import click

if TYPE_CHECKING:
    from armid_ros.excitation import CollisionScene
    from armid_ros.motion import FloatArray
    from armid_ros.robots import Robot

#: Kinds of trajectories for elastic joints.
COURSES = ('multisine', 'steps')
#: Options of every --kind of trajectory; trajectories for elastic joints also have --share.
_SHARED = {
    'robot_source', 'out', 'kind', 'duration', 'clearance', 'environment', 'floor', 'gravity',
    'joints', 'seed', 'force', 'crc', 'memory_limit',
}  # fmt: skip


def _speed(context: click.Context, parameter: click.Parameter, value: Any) -> str | float:
    """Return the value of --speed: a speed class, or a share of the limits of the joints."""
    try:
        return str(value) if value in SPEED_CLASSES else float(value)
    except ValueError:
        known = ', '.join(SPEED_CLASSES)
        text = f"'{value}' is neither one of {known} nor a number"
        raise click.BadParameter(text, context, parameter) from None


@click.command(epilog='Example: armid excite --robot ur5.urdf --duration 40 --out plan')
@parameters.robot
@parameters.folder
@click.option(
    '--kind',
    type=click.Choice(['fourier', *COURSES]),
    default='fourier',
    show_default=True,
    help='Kind of trajectory; multisine (of torque) and steps are for elastic joints.',
)
@click.option(
    '--share',
    type=click.FloatRange(0.0, 1.0, min_open=True),
    default=0.1,
    show_default=True,
    help='Share of the torque limits (multisine, rms) or of the velocity limits (steps) to use.',
)
@click.option(
    '--duration',
    type=click.FloatRange(0.0, MAX_DURATION, min_open=True),
    default=44.0,
    show_default=True,
    help='Duration of the excitation [s], without approach and return.',
)
@click.option(
    '--periods',
    type=click.IntRange(min=2),
    default=2,
    show_default=True,
    help='Number of equal periods, whose difference measures the noise.',
)
@click.option(
    '--harmonics', default=5, show_default=True, help='Number of Fourier harmonics per joint.'
)
@click.option(
    '--speed',
    shell_complete=parameters.completed,
    callback=_speed,
    metavar='S',
    default='fast',
    show_default=True,
    help=f'{", ".join(SPEED_CLASSES)}, or a share of the limits.',
)
@click.option(
    '--criterion',
    type=click.Choice(list(CRITERIA)),
    default='D',
    show_default=True,
    help='. '.join(f'{name}: {what}' for name, what in CRITERIA.items()),
)
@click.option(
    '--target',
    type=click.Choice(list(TARGETS)),
    default='all',
    show_default=True,
    help='. '.join(f'{name}: {what}' for name, what in TARGETS.items()),
)
@click.option(
    '--focus',
    shell_complete=parameters.completed,
    default='',
    metavar='E,...',
    help='Effects to identify best while all other parameters are fitted too; none by default.',
)
@parameters.effects
@click.option(
    '--effect',
    'texts',
    shell_complete=parameters.completed,
    multiple=True,
    metavar='NAME:k=v',
    help='Effect of known size, which uses torque limits. May be given several times.',
)
@click.option(
    '--rival',
    shell_complete=parameters.completed,
    metavar='E,...|none',
    help='With --criterion T: effects that may act instead of --effect.',
)
@click.option(
    '--model',
    type=parameters.ModelPath(path_type=Path),
    help='model.yaml of the arm with its effects.',
)
@click.option(
    '--start',
    metavar='Q,...',
    help='Pose at the start and end [rad or m]; by default the free pose nearest to zero.',
)
@click.option(
    '--acceleration',
    metavar='A[,...]',
    help='Acceleration limit of each joint [rad/s^2 or m/s^2]; default: top speed in 0.25 s.',
)
@click.option(
    '--joint-limits',
    type=click.Path(path_type=Path),
    help='joint_limits.yaml of MoveIt: position, velocity and acceleration limits.',
)
@click.option(
    '--velocity',
    multiple=True,
    metavar='JOINT:=V',
    help='Velocity limit of a joint [rad/s or m/s]. May be given several times.',
)
@click.option(
    '--torque-noise',
    metavar='N[,...]',
    help='Torque noise (std) of each joint [N m or N]; default 1 % of the torque limit.',
)
@click.option(
    '--clearance', default=0.01, show_default=True, help='Distance to keep between bodies [m].'
)
@click.option(
    '--environment',
    type=click.Path(path_type=Path),
    help='YAML file of obstacles around the arm, or a planning scene of MoveIt.',
)
@click.option(
    '--floor',
    metavar='Z|none',
    help='Height of the floor above the origin of the base [m]. By default, without '
    '--environment, the base plane of an upright arm.',
)
@click.option(
    '--after',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='An existing bag; the trajectory adds to the information of this bag. May be given '
    'several times.',
)
@click.option(
    '--starts',
    type=click.IntRange(min=1),
    help='Number of random trajectories to search from; default 4, 1 above 20 joints.',
)
@click.option(
    '--iterations', default=150, show_default=True, help='Number of iterations of each search.'
)
@click.option(
    '--time-budget',
    type=click.FloatRange(min=0.0),
    help='Limit of processor time for the search [s]; default 120, 25 above 20 joints.',
)
@click.option(
    '--show-isolability',
    is_flag=True,
    help='Add the isolability of effects to report.html and excitation.json: detectable sizes, '
    'and effects that the run cannot distinguish.',
)
@parameters.setting
@parameters.as_json
def excite(
    robot_source: str,
    gravity: str,
    joints: str | None,
    out: Path,
    kind: str,
    share: float,
    duration: float,
    focus: str,
    effects: str,
    texts: tuple[str, ...],
    rival: str | None,
    model: Path | None,
    start: str | None,
    acceleration: str | None,
    joint_limits: Path | None,
    velocity: tuple[str, ...],
    torque_noise: str | None,
    clearance: float,
    environment: Path | None,
    floor: str | None,
    after: tuple[Path, ...],
    show_isolability: bool,
    seed: int,
    as_json: bool,
    **settings: Any,
) -> None:
    """Design a trajectory that excites the parameters, inside all limits, free of collisions."""
    from armid_ros.api.arguments import with_effects
    from armid_ros.api.design import design_excitation
    from armid_ros.api.excitation import ExcitationResult
    from armid_ros.arm import ArmModel
    from armid_ros.cli import options
    from armid_ros.effects import parse_effect
    from armid_ros.excitation import CollisionScene, with_joint_limits
    from armid_ros.excitation.search.local import INTERRUPTED
    from armid_ros.files.cells import parted

    _refuse_other_options(click.get_current_context(), kind)
    robot = _driven(robot_source, gravity, joints, after)
    robot = with_joint_limits(robot, joint_limits, velocity)
    with progress('reading meshes') as tick:
        scene = CollisionScene.of(robot, clearance, floor, environment, progress=tick)
    if kind in COURSES:
        write_course(kind, scene, duration, share, seed, out)
        return
    arm = ArmModel(robot) if model is None else options.model_of(model, robot)
    arm = with_effects(arm, effects)
    other = None if rival is None else with_effects(arm, rival.removesuffix('none'))
    arm = with_effects(arm, focus)
    for text in texts:
        arm = arm.with_effect(*parse_effect(text, robot))
    require_free(out)
    staged = options.stage(out, ExcitationResult.schema, robot_source)
    files = [path for path in (model, environment, joint_limits) if path is not None]
    read = [Path(robot_source.split(' ')[0]), *after, *files]
    with progress('designing') as tick:
        result = design_excitation(
            arm,
            duration=duration,
            scene=scene,
            start=options.per_joint(start, robot, '--start'),
            after=options.read(after, robot, None),
            rival=other,
            focus=tuple(name.partition('@')[0] for name in parted(focus) if name),
            acceleration=options.per_joint(acceleration, robot, '--acceleration'),
            noise=options.per_joint(torque_noise, robot, '--torque-noise'),
            clearance=clearance,
            rng=seed,
            progress=lambda done, cost: tick(done, f'designing, cost {cost:.2f}'),
            **{name: value for name, value in settings.items() if value is not None},
        )
        result = replace(result, with_isolability=show_isolability)
        tick(1.0, 'writing')
        origin = options.origin(robot_source, read, seed)
        try:
            options.deliver(result, staged, origin, as_json)
        except TrajectoryError as error:  # a design without a path to it is kept in a new folder
            note = f'{staged.out} is unchanged'
            if staged.alone:
                staged.keep()
                note = f'{staged.out / "excitation.yaml"} contains the design'
            raise TrajectoryError(
                f'no path to the trajectory was found: {error}; try another --start or --seed '
                f'({note})'
            ) from error
    if result.core.stopped == INTERRUPTED:
        raise KeyboardInterrupt


def _refuse_other_options(context: click.Context, kind: str) -> None:
    """Raise a UsageError for a typed option that is not available with the --kind."""
    for option in context.command.params:
        name = str(option.name)
        fits = name in _SHARED or (name == 'share') == (kind in COURSES)
        given = context.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT
        if given and not fits:
            raise click.UsageError(f'{option.opts[0]} is not available with --kind {kind}')


def _driven(source: str, gravity: str, joints: str | None, bags: tuple[Path, ...]) -> Robot:
    """Load the robot; a joint that belongs to no arm is driven only if --joints names it."""
    from armid_ros.cli import options
    from armid_ros.files.cells import listed
    from armid_ros.robots import load_arms

    robot, others = load_arms(
        lambda names: options.open_robot(source, gravity, names, bags),
        listed(joints) if joints else None,
    )
    if others:
        drives = f'{", ".join(others)}; --joints A,B,... drives them'
        say(f'not driven, because they belong to no arm: {drives}', 'yellow')
    return robot


def require_free(folder: Path) -> None:
    """Raise a RecordingError if results would overwrite a recording in the output folder."""
    from armid_ros.api.excitation import BAG
    from armid_ros.files.output import is_plan

    if any(folder.glob('*.mcap')) or (folder / 'metadata.yaml').exists():
        raise RecordingError(f'{folder} is a recording; name another --out')
    if os.path.lexists(folder / BAG) and not is_plan(folder / BAG):
        raise RecordingError(
            f'{folder / BAG} was not written by armid excite; name another --out, or move it away'
        )


def write_course(
    kind: str, space: CollisionScene, duration: float, share: float, seed: int, out: Path
) -> None:
    """Design a trajectory for the identification of elastic joints, and write it as a bag."""
    from armid_ros.api.excitation import BAG, ExcitationResult
    from armid_ros.cli import options
    from armid_ros.excitation import ClearanceModel
    from armid_ros.recording import write_joint_trajectory
    from armid_ros.simulation.elastic import multisine_course, step_course
    import numpy as np

    robot = space.collision.robot
    require_free(out)
    staged = options.stage(out, ExcitationResult.schema, robot.name)
    bodies, margin = ClearanceModel.of(space.bodies), space.clearance

    def clear(q: FloatArray) -> bool:
        inside = np.all((q >= robot.lower) & (q <= robot.upper))
        return bool(inside) and float(bodies.smallest(q, margin).min()) >= margin

    rng = np.random.default_rng(seed)
    make = multisine_course if kind == 'multisine' else step_course
    course = make(robot, duration, share, rng, clear)
    write_joint_trajectory(staged.folder / BAG, course, robot_description=robot.urdf)
    staged.keep()
    say(f'{out / BAG}: {len(course.t)} waypoints, {course.duration:.1f} s')
    first = ', '.join(
        f'{joint} {q:.3g} {unit}'
        for joint, q, unit in zip(robot.joints, course.q[0], robot.position_units, strict=True)
    )
    say(f'starts at rest in the middle of the joint ranges: first move the arm to {first}')
    for missing in space.unchecked:
        say(f'not checked: {missing}', 'yellow')
