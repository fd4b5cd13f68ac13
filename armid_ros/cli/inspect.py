# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands `armid inspect` (a recording) and `armid check` (a robot description)."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli import columns, parameters
from armid_ros.cli.terminal import progress
import click


@click.command(epilog='Example: armid inspect run.mcap --robot ur10.urdf --out look')
@click.argument('bag', type=click.Path(path_type=Path))
@parameters.robot_described(
    help='Shipped name, path of a URDF, or - for the description in the bag. With a robot, '
    'limits and units are checked, and an identification is tried.',
)
@click.option(
    '--out',
    type=parameters.OutPath(file_okay=False, path_type=Path),
    help='Folder for inspection.html, with all curves, and inspection.json.',
)
@parameters.force
@columns.recordings
def inspect(
    bag: Path,
    robot_source: str | None,
    out: Path | None,
    topic: str | None,
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """
    Inspect a recording: a bag, or a table.

    Topics, joints, rate, gaps, ranges, doubtful units, and repetition of the motion; with a robot,
    a trial identification. Without --out, the result is printed only.

    """
    from armid_ros.api.arguments import topics_of
    from armid_ros.api.inspection import inspect as run
    from armid_ros.api.inspection import InspectionResult
    from armid_ros.cli import options
    from armid_ros.files.cells import listed

    staged = (
        None if out is None else options.stage(out, InspectionResult.schema, robot_source or '')
    )
    robot = None
    if robot_source is not None:
        robot = options.open_robot(robot_source, gravity, joints, [bag], tell=False)
    topics = topics_of(bag, options.read_settings())
    with progress('reading') as tick:
        named = listed(joints) if joints else None
        (recording,) = options.read([bag], robot, topic, joints=named)
        tick(0.5, 'trying to identify' if robot else 'looking')
        found = run(robot, recording, topics=topics, rng=seed)
    origin = options.origin(robot_source or '', [bag], seed)
    options.deliver(found, staged, origin, as_json)


@click.command(epilog='Example: armid check ur10.urdf run.mcap')
@click.argument('arguments', metavar='[R] [BAG]...', nargs=-1)
@click.option(
    '--robot',
    'robot_source',
    metavar='R',
    shell_complete=parameters.completed,
    help='The robot description, in place of the argument R.',
)
@parameters.packages
@click.option(
    '--out',
    type=parameters.OutPath(file_okay=False, path_type=Path),
    help='Folder for report.html and check.json.',
)
@parameters.force
@click.option('--strict', is_flag=True, help='End with code 3 if a value is wrong.')
@parameters.effects
@columns.recordings
def check(
    arguments: tuple[str, ...],
    robot_source: str | None,
    out: Path | None,
    strict: bool,
    effects: str,
    topic: str | None,
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """
    Check a URDF: alone, or against recordings.

    R is a URDF, MJCF or xacro ('arm.xacro tool:=true' with arguments), a shipped name, or - for
    the description in the bag. R may be left out if --robot or armid.toml names the robot.

    Without recordings: impossible inertias, densities of links with shapes, units of limits. With
    recordings: described and measured mass and centre of each link.

    """
    from armid_ros.api.inspection import check as run
    from armid_ros.api.inspection import CheckResult
    from armid_ros.cli import options
    from armid_ros.robots import shipped_robots

    context, first = click.get_current_context(), ''.join(arguments[:1])
    suffix = Path(first.partition(' ')[0]).suffix
    described = suffix in ('.urdf', '.xacro', '.xml') or first in ('-', *shipped_robots())
    if first and (described or robot_source is None):
        if robot_source is not None:
            click.echo(f'{first} is used instead of --robot {robot_source}', err=True)
        robot_source, arguments = first, arguments[1:]
    robot_source = parameters.with_packages(context, robot_source)
    if robot_source is None:
        raise click.UsageError("Missing argument 'R', the robot description.")
    bags = tuple(map(Path, arguments))
    context.params |= {'robot_source': robot_source, 'bags': bags}
    staged = None if out is None else options.stage(out, CheckResult.schema, robot_source)
    robot = options.open_robot(robot_source, gravity, joints, bags, tell=False)
    with progress('checking'):
        found = run(robot, options.read(bags, robot, topic), effects=effects, rng=seed)
    source = [path for path in (Path(robot_source), *bags) if path.exists()]
    origin = options.origin(robot_source, source, seed)
    options.deliver(found, staged, origin, as_json)
    if strict and found.wrong:
        context.exit(3)
