# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification of two links on springs in three steps, from bags to parameters."""

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
    help='Step responses, for the tuning of the parameters.',
)
@click.option('--demo', is_flag=True, help='Simulate the shipped arm, and identify it.')
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
    help='Start values of the tuning: the result of the earlier steps, or a published set of '
    'parameters. Default: found; with --demo: before, as in the source.',
)
@click.option('--accelerometers', metavar='R1,R2', help='Distances from the joints [m].')
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
    help='model.yaml with the inertias of an arm that is no planar pair of links.',
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
    Identify elastic joints.

    A pair of links that move in a horizontal plane is identified in three steps, with its
    resonances. The springs of any other arm are identified joint by joint, from encoders on both
    sides of each joint and known inertias.

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
                f'--demo and --steps need a pair of links that move in a horizontal plane, which '
                f'{robot.name} is not; without them its springs are identified joint by joint'
            )
        identify_springs(bags, robot, robot_source, model, out, as_json)
        return
    if model is not None:
        raise RobotError(
            '--model is not available here: this method identifies the inertias itself'
        )
    radius, drives, loop = work.machine(**given)
    staged = options.stage(out, report.SCHEMA, robot_source)
    with progress('reading') as tick:
        if demo:
            bags, steps = work.simulate(robot, radius, staged, experiments, seed, tick)
        elif not bags:
            raise RecordingError('no bag is given; give one, or --demo to simulate one')
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
            table = f"the set '{begin}', which the tuning began with"
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
