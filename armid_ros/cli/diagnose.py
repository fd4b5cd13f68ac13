# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From bags and a model to what the model lacks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.cli import columns, options
from armid_ros.cli import partner as partner_options
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import print_parameters, print_rows, progress, say
from armid_ros.diagnosis import diagnose as run
from armid_ros.diagnosis import (
    Diagnosis,
    diagnosis_document,
    DiagnosisSettings,
    EXPERIMENT_FILE,
    next_run,
    NextRun,
)
from armid_ros.diagnosis.output import SCHEMA
from armid_ros.errors import ArmidError
from armid_ros.excitation import save_excitation
from armid_ros.files import json_text, write_file
from armid_ros.identification import SignalSettings
from armid_ros.identification.signals import conditioning
from armid_ros.identification.verification import ForwardValidation, simulate_held_out
from armid_ros.report.diagnosis_report import diagnosis_report
import click
import numpy as np


@click.command(epilog='Example: armid diagnose slow.mcap fast.mcap --robot ur10.urdf --out found')
@click.argument('bags', nargs=-1, required=True, type=click.Path(path_type=Path))
@options.robot
@options.folder
@click.option(
    '--validate',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag that is only predicted; may be given several times.',
)
@click.option(
    '--model',
    type=click.Path(path_type=Path),
    help='model.yaml with what is known of the arm; its effects are part of the model.',
)
@click.option(
    '--effects',
    default='',
    metavar='E,...',
    help="Effects that the model has already, fitted anew; 'E@joint+joint' for some joints only.",
)
@click.option('--cutoff', type=float, help='Of the position filter [Hz]; from the noise if none.')
@click.option('--decimation', type=int, help='Keep one sample of this many.')
@columns.options
@click.option('--topic', help='JointState topic, where a bag has several.')
@partner_options.options
@options.gravity
@options.joints
@options.seed
@options.reading
@options.as_json
def diagnose(
    bags: tuple[Path, ...],
    robot_source: str,
    out: Path,
    validate: tuple[Path, ...],
    model: Path | None,
    effects: str,
    cutoff: float | None,
    decimation: int | None,
    topic: str | None,
    partner: str | None,
    partner_topic: str | None,
    ties: tuple[str, ...],
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """Find which effect a model lacks, and add it."""
    options.hold(out, SCHEMA, robot_source)
    robot = options.open_robot(robot_source, gravity, joints, bags)
    arm = ArmModel(robot) if model is None else load_model(model, robot)
    arm = options.with_effects(arm, effects)
    beside = partner_options.open_partner(partner, ties, robot, gravity)
    settings = DiagnosisSettings(signals=SignalSettings(cutoff, decimation), partner=beside)
    with progress('reading') as tick:
        recordings = options.read(bags, robot, topic)
        held_out = options.read(validate, robot, topic)
        if beside is not None:
            recordings = partner_options.read_together(bags, recordings, beside, partner_topic)
            held_out = partner_options.read_together(validate, held_out, beside, partner_topic)
        result = run(
            arm,
            recordings,
            validate=held_out,
            settings=settings,
            rng=np.random.default_rng(seed),
            progress=tick,
        )
        forward: tuple[ForwardValidation, ...] = ()
        left_out: tuple[str, ...] = ()
        if held_out and result.gap is not None:
            used = conditioning(recordings, settings.signals)
            forward, left_out = simulate_held_out(
                arm, result.arm, used, held_out, progress=lambda _, what: tick(1.0, what)
            )
        run_next, refused = _next_run(result, seed, tick)
    document = diagnosis_document(result)
    document['forward'] = [pair.document() for pair in forward]
    document['next_run'] = None if run_next is None else run_next.document()
    estimate = None if result.explanation is None else result.explanation.fitted.estimate
    source = options.kept_source(robot_source, robot, out)
    save_model(out / 'model.yaml', result.arm, source, estimate)
    page = diagnosis_report(
        result,
        robot=robot_source,
        recordings=recordings,
        validation=held_out,
        forward=forward,
        next_run=run_next,
        patch=(out / 'model.yaml').read_text(encoding='utf-8'),
        provenance=provenance([*bags, *validate], seed=seed),
    )
    if run_next is not None:
        save_excitation(run_next.excitation, out / EXPERIMENT_FILE)
    write_file(out / 'report.html', page)
    write_file(out / 'diagnosis.json', json_text(document, indent=1))
    if as_json:
        click.echo(json_text(document))
        return
    _show(result)
    for pair in forward:
        say(pair.sentence())
    for note in (*left_out, *refused):
        say(f'note: {note}')
    files = ['diagnosis.json', 'model.yaml', 'report.html']
    if run_next is not None:
        say(run_next.sentence)
        files.append(EXPERIMENT_FILE)
    say(f'{out}: {", ".join(files)}')


def _next_run(
    result: Diagnosis, seed: int, tick: Callable[[float, str], None]
) -> tuple[NextRun | None, tuple[str, ...]]:
    """Return a motion that separates names in doubt, or why there is none."""
    tick(1.0, 'next run')
    try:
        return next_run(result, np.random.default_rng(seed)), ()
    except ArmidError as error:
        return None, (str(error),)


def _show(result: Diagnosis) -> None:
    say(f'{result.verdict.replace("_", " ").upper()}: {result.summary}')
    explanation = result.explanation
    if explanation is not None and explanation.steps:
        rows = [
            {
                'added': step.trial.score.group.effect.name,
                'joints': ', '.join(step.trial.score.group.effect.joints),
                'loss': f'{step.before.max():.3g} -> {step.after.max():.3g}',
            }
            for step in explanation.steps
        ]
        print_rows(rows, as_json=False)
    for finding in result.findings:
        print_parameters(
            [
                {'name': p.name, 'joint': p.joint, 'value': value, 'std': std, 'unit': p.unit}
                for p, value, std in zip(
                    finding.parameters, finding.values, finding.std, strict=True
                )
            ]
        )
    for note in result.notes:
        say(f'note: {note}')
