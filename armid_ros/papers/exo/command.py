# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification of the springs between a machine and its wearer, from torques and angles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armid_ros.cli import parameters as options
import click

#: Motions of a leg and its exoskeleton; `armid_ros.papers.exo.plant.leg_pair.EXERCISES`.
EXERCISES = ('step', 'quick_step', 'swing', 'lift', 'squat', 'rock')


@click.command(
    epilog='Example: armid exo --out result; with a recording: armid exo run.mcap --out result'
)
@click.argument('bag', required=False, type=click.Path(path_type=Path))
@options.folder
@click.option(
    '--topics',
    default='/exo/joint_states,/human/joint_states',
    show_default=True,
    help='JointState topics of the machine and of its wearer.',
)
@click.option(
    '--inertias',
    type=click.Choice(['known', 'free']),
    default='known',
    show_default=True,
    help="Whether the machine's inertias are those of its description, or estimated as well.",
)
@click.option(
    '--gait',
    'gait_file',
    type=click.Path(path_type=Path),
    help='Gait (CSV); default level walking.',
)
@click.option(
    '--stiffness', type=float, help='Stiffness of simulated springs [N/m]; default: as assumed.'
)
@click.option(
    '--motion',
    type=click.Choice(list(EXERCISES)),
    default='step',
    show_default=True,
    help='What the simulated pair does on one foot.',
)
@click.option('--duration', default=10.0, show_default=True, help='Length of the simulation [s].')
@click.option('--torque-noise', default=0.5, show_default=True, help='Torque noise (std) [N m].')
@click.option('--angle-noise', default=0.05, show_default=True, help='Angle noise (std) [deg].')
@options.seed
@options.reading
@options.as_json
def exo(
    bag: Path | None,
    out: Path,
    topics: str,
    inertias: str,
    seed: int,
    as_json: bool,
    **simulated: Any,
) -> None:
    """
    Find what ties an exoskeleton to its wearer.

    Without a BAG the shipped pair walks, is recorded with noise, and its springs are found again.

    """
    from armid_ros.papers.exo.work import identify_pair, SimulationOptions

    identify_pair(bag, out, topics, inertias, SimulationOptions(**simulated), seed, as_json)
