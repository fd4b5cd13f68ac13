# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The main job from end to end on the shipped arm, over real topics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.cli import parameters
from armid_ros.cli.terminal import progress, say
import click

if TYPE_CHECKING:
    from armid_ros.identification.assess.agreement import Agreement

#: Files that a folder to be filled may hold already, from a demo before.
OUTPUTS = ('bag', 'excitation.yaml', 'model.yaml', 'identification.json', 'report.html', 'story')


@click.command(epilog='Example: armid demo --gravity earth --out demo')
@click.option('--gravity', type=click.Choice(['moon', 'earth']), default='moon', show_default=True)
@click.option('--rate', default=200.0, show_default=True, help='Joint states per second.')
@click.option(
    '--hide',
    default='',
    metavar='E@joint',
    help='Effect that is hidden in the arm and has to be found; random by default.',
)
@parameters.folder
@parameters.seed
@parameters.as_json
def demo(gravity: str, rate: float, hide: str, out: Path, seed: int, as_json: bool) -> None:
    """Excite, move, identify online and offline; then find a hidden change of the arm."""
    from armid_ros.arm import ArmModel, save_model
    from armid_ros.cli import options
    from armid_ros.cli.demo import steps
    from armid_ros.cli.demo.story import show_story, tell_story
    from armid_ros.excitation import save_excitation
    from armid_ros.files import json_text, settled, write_file
    from armid_ros.identification import (
        grade,
        identification_document,
        identify,
        Score,
        write_document,
    )
    from armid_ros.identification.assess.agreement import Agreement
    from armid_ros.identification.online.identifier import OnlineIdentifier
    from armid_ros.identification.output import SCHEMA
    from armid_ros.nodes.lockstep import replay_lockstep
    from armid_ros.recording import read_recording
    from armid_ros.robots import load_robot
    from armid_ros.simulation import SimulatedArm
    import numpy as np

    rng = np.random.default_rng(seed)
    robot = load_robot(steps.ROBOT, gravity=gravity)
    truth = steps.true_arm(robot)
    nominal = ArmModel(robot, truth.effects)
    staged = options.stage(out, SCHEMA, steps.ROBOT, [*OUTPUTS, '*.png'])
    new = staged.folder
    excitation = steps.excite(nominal, rng)
    save_excitation(excitation, new / 'excitation.yaml')
    identifier = OnlineIdentifier(nominal, rng=np.random.default_rng(seed))
    target = identifier.base.values(truth.theta)
    plant = SimulatedArm(truth, rng=rng, sensors=steps.SENSORS)
    history, end = steps.run_online(plant, excitation, identifier, target, new / 'bag', rate)
    again = OnlineIdentifier(nominal, rng=np.random.default_rng(seed))
    with progress('playing the bag back') as tick:
        replay = replay_lockstep(
            new / 'bag',
            again,
            duration=end.duration,
            on_progress=lambda now: tick(now.t / now.duration),
        )
        tick(0.0, 'identifying offline')
        recording = read_recording(new / 'bag', joints=robot.joints)
        recording = replace(recording, source=str(settled(new / 'bag')))
        result = identify(nominal, [recording], rng=rng, progress=tick)
        graded = grade(result, nominal, [recording], {})
    offline = Agreement.of(result.estimate, result.base.values(truth.theta))
    online = Agreement.of(end.estimate, target)
    document = {
        **identification_document(result, steps.ROBOT, {}, grade=graded),
        'truth': offline.document(),
        'online': online.document(),
        'replay_difference': float(np.abs(replay.estimate.values - end.estimate.values).max()),
        'real_time_factor': end.real_time_factor,
        'held_out': steps.held_out_error(result.arm, truth, rng),
    }
    save_model(new / 'model.yaml', result.arm, steps.ROBOT, result.estimate)
    page = steps.page(result, history, target, truth, graded, recording)
    write_file(new / 'report.html', page)
    if not as_json:
        say(f'{graded.word}: {graded.reasons[0]}')
        _tell(document, online, offline, Score.of(result.training).relative_error_percent)
    rng = np.random.default_rng([seed, 1])
    told = tell_story(
        new / 'story',
        truth,
        result.arm,
        recording,
        sensors=steps.SENSORS,
        rng=rng,
        hide=hide,
        rate=rate,
    )
    document['story'] = told.document()
    write_document(new / 'identification.json', document)
    staged.keep()
    if as_json:
        click.echo(json_text(document))
    else:
        show_story(told)
        say(f'Open {out / "report.html"} (model) and {out / "story" / "report.html"} (diagnosis).')


def _tell(
    document: dict[str, Any], online: Agreement, offline: Agreement, training: float
) -> None:
    say(f'online:  {online.sentence()}')
    say(f'offline: {offline.sentence()}')
    say(
        f'relative error of the torque {training:.2f} % (noise included); '
        f'{document["held_out"]:.2f} % against the true torque of another motion'
    )
    say(
        'playing the bag back repeats the online estimate (largest difference '
        f'{document["replay_difference"]:.1g})'
    )
