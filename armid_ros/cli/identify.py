# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From bags to a model with uncertainties."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from armid_ros.arm import ArmModel, save_model
from armid_ros.arm.export import arm_mjcf, arm_urdf
from armid_ros.cli import options
from armid_ros.cli.terminal import print_parameters, progress, say
from armid_ros.identification import (
    identification_document,
    IdentificationSettings,
    PhysicalSettings,
    SignalSettings,
)
from armid_ros.identification import (
    identify as run,
)
from armid_ros.report import hash_files, identification_report, Provenance, versions
import click
import numpy as np


@click.command(epilog='Example: armid identify run.mcap --robot ur10.urdf --out result')
@click.argument('bags', nargs=-1, required=True, type=click.Path(path_type=Path))
@options.robot
@options.folder
@click.option(
    '--validate',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag to predict and not to fit; may be given several times.',
)
@options.effects
@click.option(
    '--method',
    type=click.Choice(['ols', 'wls', 'irls']),
    default='wls',
    show_default=True,
    help='All joints alike, weighted by their noise, or robust against outliers as well.',
)
@click.option(
    '--cutoff', type=float, help='Of the position filter [Hz]; from the noise by default.'
)
@click.option('--decimation', type=int, help='Keep one sample of this many.')
@click.option('--quasi-static', is_flag=True, help='Weight and effects only, for slow motions.')
@click.option(
    '--physical',
    is_flag=True,
    help='Fit links that can be bodies; writes identified.urdf and identified.mjcf.xml too.',
)
@click.option('--total-mass', type=float, help='Of all moving links [kg], with --physical.')
@click.option('--topic', help='JointState topic, where a bag has several.')
@options.gravity
@options.joints
@options.seed
@options.as_json
def identify(
    bags: tuple[Path, ...],
    robot_source: str,
    out: Path,
    validate: tuple[Path, ...],
    effects: str,
    method: Any,
    cutoff: float | None,
    decimation: int | None,
    quasi_static: bool,
    physical: bool,
    total_mass: float | None,
    topic: str | None,
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """Fit a model with uncertainties to recordings."""
    robot = options.open_robot(robot_source, gravity, joints, bags)
    arm = options.with_effects(ArmModel(robot, quasi_static=quasi_static), effects)
    if total_mass is not None and not physical:
        raise click.UsageError('--total-mass goes with --physical')
    settings = IdentificationSettings(
        method,
        SignalSettings(cutoff, decimation),
        PhysicalSettings(total_mass=total_mass) if physical else None,
    )
    with progress('reading') as tick:
        recordings = options.read(bags, robot, topic)
        held_out = options.read(validate, robot, topic)
        tick(0.0, 'identifying')
        result = run(arm, recordings, settings, rng=np.random.default_rng(seed), progress=tick)
        validation = {r.source: result.predict([r]) for r in held_out}
    document = identification_document(result, robot_source, validation)
    out.mkdir(parents=True, exist_ok=True)
    source = options.kept_source(robot_source, robot, out)
    save_model(out / 'model.yaml', result.arm, source, result.estimate)
    page = identification_report(
        result,
        description=arm,
        robot=robot_source,
        recordings=recordings,
        validation=validation,
        validation_recordings=held_out,
        provenance=Provenance(
            files=hash_files([*bags, *validate]),
            versions=versions(),
            settings={name: str(value) for name, value in document['settings'].items()},
            seed=seed,
        ),
    )
    (out / 'report.html').write_text(page, encoding='utf-8')
    files = ['model.yaml', 'identification.json', 'report.html']
    if physical:
        for name, made in (
            ('identified.urdf', arm_urdf(result.arm)),
            ('identified.mjcf.xml', arm_mjcf(result.arm)),
        ):
            (out / name).write_text(made.text, encoding='utf-8')
            files.append(name)
    (out / 'identification.json').write_text(json.dumps(document, indent=1), encoding='utf-8')
    if as_json:
        click.echo(json.dumps(document))
        return
    print_parameters(document['parameters'])
    for recording in (*recordings, *held_out):
        say(f'{recording.source}: {recording.report.describe()}')
    for note in (*robot.notes, *result.notes):
        say(f'note: {note}')
    fitted = document['training']['relative_error_percent']
    say(f'relative error {fitted:.2f} % on the data it was fitted to')
    for entry in document['validation']:
        say(f'relative error {entry["relative_error_percent"]:.2f} % on {entry["bag"]}, held out')
    say(f'{out}: {", ".join(files)}')
