# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification of two links on springs in three steps, from bags to parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armid_ros.cli import parameters as options
import click


@click.command(epilog='Example: armid elastic run.mcap --steps steps.mcap --out result')
@click.argument('bags', nargs=-1, type=click.Path(path_type=Path))
@click.option(
    '--steps',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='Step responses to tune the parameters to.',
)
@click.option('--demo', is_flag=True, help='Simulate the shipped arm first, and identify that.')
@click.option(
    '--experiments', default=48, show_default=True, help='Number that --demo simulates, 4 s each.'
)
@options.robot_described(
    default='two_link_elastic', show_default=True, help='Robot: shipped name or path.'
)
@click.option(
    '--start',
    type=click.Choice(['found', 'before', 'after']),
    help='What the tuning begins with: what was found by then, or a printed set. By default '
    "the former, with --demo the set 'before', as in the source.",
)
@click.option('--accelerometers', metavar='R1,R2', help='Distances from the joints [m].')
@click.option('--gear', metavar='N1,N2', help='Turns of the motors per turn of the joints.')
@click.option(
    '--kp', metavar='K1,K2', help='Gains of the velocity loops, at the joints [N m s/rad].'
)
@click.option('--ki', metavar='K1,K2', help='Integral gains of the same [N m/rad].')
@click.option(
    '--model', type=click.Path(path_type=Path), help='model.yaml with inertias, for other arms.'
)
@options.folder
@options.reading
@options.seed
@options.every
@options.as_json
def elastic(
    out: Path, seed: int, every: bool, as_json: bool, robot_source: str, **given: Any
) -> None:
    """
    Identify elastic joints.

    A pair of links that move in a horizontal plane is identified in three steps, resonances and
    all. Other arms need encoders on both sides of their joints, and known inertias: their springs
    are found joint by joint.

    """
    from armid_ros.papers.elastic.work import ElasticOptions, identify_elastic

    identify_elastic(ElasticOptions(robot=robot_source, **given), out, seed, as_json, every)
