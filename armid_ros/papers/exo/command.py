# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid exo`: stiffness of the straps between exoskeleton and wearer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armid_ros.cli import parameters
import click

#: Names of `armid_ros.papers.exo.plant.leg_pair.EXERCISES`, repeated for a fast start.
EXERCISES = ('step', 'quick_step', 'swing', 'lift', 'squat', 'rock')


@click.command(
    epilog='Example: armid exo --out result; with a recording: armid exo run.mcap --out result'
)
@click.argument('bag', required=False, type=click.Path(path_type=Path))
@parameters.folder
@click.option(
    '--topics',
    default='/exo/joint_states,/human/joint_states',
    show_default=True,
    help='JointState topics of the exoskeleton and of the wearer.',
)
@click.option(
    '--inertias',
    type=click.Choice(['known', 'free']),
    default='known',
    show_default=True,
    help='Inertias of the exoskeleton: known from its description, or free (estimated).',
)
@click.option(
    '--stiffness', type=float, help='Stiffness of the simulated straps [N/m]; default: 10000.'
)
@click.option(
    '--motion',
    type=click.Choice(list(EXERCISES)),
    default='step',
    show_default=True,
    help='Simulated motion on one foot.',
)
@click.option(
    '--duration', default=10.0, show_default=True, help='Length of the simulated recording [s].'
)
@click.option(
    '--torque-noise', default=0.5, show_default=True, help='Simulated torque noise (std) [N m].'
)
@click.option(
    '--angle-noise', default=0.05, show_default=True, help='Simulated angle noise (std) [deg].'
)
@parameters.seed
@parameters.reading
@parameters.as_json
def exo(
    bag: Path | None,
    out: Path,
    topics: str,
    inertias: str,
    stiffness: float | None,
    motion: str,
    duration: float,
    torque_noise: float,
    angle_noise: float,
    seed: int,
    as_json: bool,
) -> None:
    """
    Identify the stiffness of the straps between an exoskeleton and its wearer.

    Without a BAG, a motion of the shipped exoskeleton and wearer is simulated, recorded with noise
    and identified.

    """
    from armid_ros.cli import options
    from armid_ros.cli.options import provenance
    from armid_ros.cli.terminal import progress
    from armid_ros.errors import ModelError
    from armid_ros.files import final_path
    from armid_ros.papers.exo import work
    from armid_ros.papers.exo.plant.leg_pair import exercise, leg_pair
    from armid_ros.papers.exo.report.page import exo_report, verdict
    from armid_ros.recording import read_recording
    from armid_ros.recording.writer import require_new
    import numpy as np

    pair, names = leg_pair(stiffness), topics.split(',')
    if len(names) != 2:
        raise ModelError(
            f'--topics {topics}: name two topics, of exoskeleton and wearer, separated by a comma'
        )
    if bag is None:
        require_new(out / 'recording')
    staged = options.stage(out, work.SCHEMA)
    with progress('recording') as tick:
        path = staged.folder / 'recording' if bag is None else bag
        if bag is None:
            motions = exercise(pair, motion, np.arange(0.0, duration, 1e-3))
            noise, rng = (angle_noise, torque_noise), np.random.default_rng(seed)
            work.record(path, names, pair, motions, noise, rng)
        settings, source = options.read_settings(), str(final_path(path))
        both = [
            read_recording(path, joints=one.joints, topic=topic, settings=settings)
            for one, topic in zip((pair.robot, pair.other), names, strict=True)
        ]
        options.tell_damage(*both)
        machine, wearer = (replace(one, source=source) for one in both)
        found = work.identify_ties(pair, machine, wearer, inertias, tick)
        walked = work.walk(pair, stiffness, tick) if bag is None else None
    used = {'inertias': inertias, 'topics': topics}
    origin = provenance([path], used, seed if bag is None else None)
    shown = motions if bag is None else work.recorded_motions(pair, machine, wearer)
    stiff = pair.with_stiffness(found[0].stiffness[0].clip(0.0))
    page = exo_report(stiff, shown, found, walked, origin)
    document = work.exo_document(found, walked, source)
    rows = [
        (row['segment'], f'{row["value"]:.1f}', f'{row["std"]:.1f}')
        for row in document['stiffness']
    ]
    table = None if as_json else (('strap', 'stiffness [N/m]', 'std'), rows)
    options.deliver_page(staged, page, 'exo', document, verdict(found, walked), table)
