# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid elastic`: joint stiffness, inertia and friction from bags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.cli import parameters
import click


@click.command(epilog='Example: armid elastic run.mcap --steps steps.mcap --out result')
@click.argument('bags', nargs=-1, type=click.Path(path_type=Path))
@click.option(
    '--steps',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='Bag with step responses, for the tuning; may be given several times.',
)
@click.option('--demo', is_flag=True, help='Simulate the shipped two-link arm and identify it.')
@click.option(
    '--experiments',
    default=48,
    show_default=True,
    help='Number of experiments of 4 s that --demo simulates.',
)
@parameters.robot_described(
    default='two_link_elastic', show_default=True, help='Robot: shipped name or path.'
)
@click.option(
    '--start',
    type=click.Choice(['found', 'before', 'after']),
    help='Start values of the tuning: found (result of the earlier steps), or a published set of '
    'parameters. Default: found; with --demo: before.',
)
@click.option(
    '--accelerometers', metavar='R1,R2', help='Distances of accelerometers from the joints [m].'
)
@click.option(
    '--gear', metavar='N1,N2', help='Gear ratios: turns of the motor per turn of the joint.'
)
@click.option(
    '--kp', metavar='K1,K2', help='Gains of the velocity loops, at the joints [N m s/rad].'
)
@click.option('--ki', metavar='K1,K2', help='Integral gains of the velocity loops [N m/rad].')
@click.option(
    '--model',
    type=click.Path(path_type=Path),
    help='model.yaml with the link inertias of an arm other than a planar two-link arm.',
)
@parameters.folder
@parameters.reading
@parameters.seed
@parameters.every
@parameters.as_json
def elastic(
    bags: Sequence[Path],
    steps: Sequence[Path],
    demo: bool,
    experiments: int,
    robot_source: str,
    start: str | None,
    model: Path | None,
    out: Path,
    seed: int,
    every: bool,
    as_json: bool,
    **given: str | None,
) -> None:
    """
    Identify the stiffness of elastic joints.

    A two-link arm in a horizontal plane is identified in three steps, from its resonances. In
    other arms, the stiffness of each joint follows from encoders on both sides of the joint and
    from known link inertias.

    """
    from armid_ros.cli import options
    from armid_ros.cli.options import provenance
    from armid_ros.cli.terminal import progress
    from armid_ros.errors import RecordingError, RobotError
    from armid_ros.papers.elastic import report, work
    from armid_ros.papers.elastic.identification.files import read_runs
    from armid_ros.papers.elastic.identification.three_steps import identify_two_inertia
    from armid_ros.papers.elastic.springs import identify_springs
    from armid_ros.robots import load_robot
    from armid_ros.robots.two_link import planar_pair, ROBOT, two_link_set

    begin = start or ('before' if demo else 'found')
    printed = None if begin == 'found' else two_link_set(begin).parameters
    robot = load_robot(robot_source)
    if not planar_pair(robot):
        if demo or steps:
            raise RobotError(
                f'--demo and --steps need a two-link arm in a horizontal plane, not {robot.name}; '
                'leave them out to identify each joint of this arm'
            )
        identify_springs(bags, robot, robot_source, model, out, as_json)
        return
    if model is not None:
        raise RobotError(
            '--model is not available with a planar two-link arm, whose inertias are identified'
        )
    radius, drives, loop = work.machine(**given)
    staged = options.stage(out, report.SCHEMA, robot_source)
    with progress('reading') as tick:
        if demo:
            bags, steps = work.simulate(robot, radius, staged, experiments, seed, tick)
        elif not bags:
            raise RecordingError('no bag is named; name a bag, or use --demo to simulate an arm')
        how = options.read_settings(), options.tell_damage
        runs, responses = (
            [run for path in paths for run in read_runs(path, robot, radius, *how)]
            for paths in (bags, steps)
        )
        result = identify_two_inertia(
            runs, drives, loop, steps=responses, start=printed, progress=tick
        )
        tick(1.0, 'writing')
        shipped, known, table = two_link_set('after').parameters, printed, ''
        if robot.name == ROBOT:
            known, table = shipped, 'Table 1 of the source, after tuning'
        elif printed is not None:
            table = f"the parameter set '{begin}', the start of the tuning"
        seeds = seed if demo else None
        origin = provenance([*bags, *steps], {'start of the tuning': begin}, seeds)
        page = report.elastic_report(result, robot.name, known, table, origin)
    document, verdict = report.elastic_document(result, robot_source), report.verdict(result)
    if demo and result.tuning is not None:
        story = report.tuning_story(result.tuning, printed or result.untuned, shipped)
        document['story'] = story
        accuracy = (
            f'The tuning reduced the error against the true arm by a factor of '
            f'{story["factor"]:.0f}. The main parameters are within '
            f'{story["main_parameters_percent_after"]:.2g} % of the true ones.'
        )
        verdict = replace(verdict, sentences=[*verdict.sentences, accuracy])
    shown = work.values_table if every else work.resonances_table
    table_shown = None if as_json else shown(document)
    options.deliver_page(staged, page, 'elastic', document, verdict, table_shown)
