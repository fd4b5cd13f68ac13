# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid demo`: excite, identify and diagnose a simulated arm over ROS topics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.cli import parameters
from armid_ros.cli.terminal import progress, say
import click

if TYPE_CHECKING:
    from armid_ros.api.identification import IdentificationResult
    from armid_ros.arm import ArmModel
    from armid_ros.estimate import Estimate
    from armid_ros.motion import FloatArray
    from armid_ros.nodes.lockstep import Progress
    from armid_ros.report.provenance import ResultOrigin

#: Files of an earlier demo, which the output folder may contain.
OUTPUTS = ('bag', 'excitation.yaml', 'model.yaml', 'identification.json', 'report.html', 'story')


@click.command(epilog='Example: armid demo --gravity earth --out demo')
@click.option(
    '--gravity',
    type=click.Choice(['moon', 'earth']),
    default='moon',
    show_default=True,
    help='Gravity of the simulated arm.',
)
@click.option('--rate', default=200.0, show_default=True, help='Sample rate [Hz].')
@click.option(
    '--hide',
    shell_complete=parameters.completed,
    default='',
    metavar='E@joint',
    help='Effect to hide in the arm for the diagnosis; random by default.',
)
@parameters.folder
@parameters.seed
@parameters.as_json
def demo(gravity: str, rate: float, hide: str, out: Path, seed: int, as_json: bool) -> None:
    """Excite and identify a simulated arm online and offline; find a hidden change of the arm."""
    from armid_ros.api.identification import IdentificationResult, identify
    from armid_ros.arm import ArmModel
    from armid_ros.cli import options
    from armid_ros.cli.demo import steps
    from armid_ros.excitation import design, DesignSettings, save_excitation
    from armid_ros.files import final_path, json_text, write_file
    from armid_ros.identification import write_document
    from armid_ros.identification.assess.agreement import Agreement
    from armid_ros.identification.online.identifier import OnlineIdentifier
    from armid_ros.nodes.lockstep import run_lockstep
    from armid_ros.recording import read_recording
    from armid_ros.report.notation import pretty
    from armid_ros.report.provenance import ResultOrigin
    from armid_ros.robots import collision_model, load_robot
    from armid_ros.simulation import SimulatedArm
    import numpy as np

    rng = np.random.default_rng(seed)
    robot = load_robot(steps.ROBOT, gravity=gravity)
    truth = steps.true_arm(robot)
    nominal = ArmModel(robot, truth.effects)
    changed = steps.hidden_change(truth, np.random.default_rng([seed, 1]), hide)
    staged = options.stage(out, IdentificationResult.schema, steps.ROBOT, [*OUTPUTS, '*.png'])
    new, bag = staged.folder, staged.folder / 'bag'
    settings = DesignSettings(period=10.0, harmonics=5, starts=2, candidates=20, iterations=40)
    with progress('designing the excitation') as tick:
        excitation = design(
            nominal,
            settings,
            rng,
            collision=collision_model(robot),
            progress=lambda done, cost: tick(done),
        ).excitation
        save_excitation(excitation, new / 'excitation.yaml')
        tick(0.0, 'moving, and identifying online')
        identifier = OnlineIdentifier(nominal, rng=np.random.default_rng(seed))
        target = identifier.base.values(truth.theta)
        plant = SimulatedArm(truth, rng=rng, sensors=steps.SENSORS)
        history: list[tuple[float, Estimate]] = []

        def watch(now: Progress) -> None:
            history.append((now.t, identifier.estimate()))
            tick(now.t / now.duration)

        end = run_lockstep(plant, excitation, bag, identifier, rate=rate, on_progress=watch)
        tick(0.0, 'identifying offline')
        recording = replace(read_recording(bag, joints=robot.joints), source=str(final_path(bag)))
        found = identify(nominal, recording, physical=False, rng=rng, progress=tick)
    offline = Agreement.of(found.estimate, found.core.base.values(truth.theta))
    online = Agreement.of(identifier.estimate(), target)
    origin = ResultOrigin(steps.ROBOT, steps.ROBOT, options.provenance([], seed=seed))
    found.fill(new, origin)
    write_file(new / 'report.html', _page(found, truth, history, target, origin))
    rng = np.random.default_rng([seed, 1])
    diagnosed = steps.diagnose_hidden(
        new / 'story', changed, found.arm, recording, rng, rate, origin
    )
    document: dict[str, Any] = {
        **found.document(),
        'robot': steps.ROBOT,
        'truth': offline.document(),
        'online': online.document(),
        'real_time_factor': end.real_time_factor,
        'story': steps.story(changed, diagnosed),
    }
    write_document(new / 'identification.json', document)
    staged.keep()
    if as_json:
        click.echo(json_text(document))
        return
    say(f'{found.grade.upper()}: {found.graded.reasons[0]}')
    say(f'online:  {online.sentence()}')
    say(f'offline: {offline.sentence()}')
    say('Then a change was hidden in the arm, and three runs were recorded. Diagnosis of two:')
    say(pretty(f'{diagnosed.verdict.replace("_", " ").upper()}: {diagnosed.core.summary}'))
    say(steps.outcome(changed, diagnosed))
    say(f'Open {out / "report.html"} (model) and {out / "story" / "report.html"} (diagnosis).')


def _page(
    found: IdentificationResult,
    truth: ArmModel,
    history: list[tuple[float, Estimate]],
    target: FloatArray,
    origin: ResultOrigin,
) -> str:
    """Return report.html of the demo, with true values and the online estimate over time."""
    from armid_ros.report import identification_report as page

    parameters = page.parameter_sections(found.core, truth, name='truth')
    return page.identification_report(
        found.core,
        found.graded,
        description=found.description,
        recordings=found.recordings,
        validation={},
        parameters=[*parameters, page.convergence_section(history, target)],
        origin=origin,
    )
