# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The main job from end to end on the shipped arm, over real topics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.arm import ArmModel, save_model
from armid_ros.cli import options
from armid_ros.cli.demo.story import show_story, tell_story
from armid_ros.cli.terminal import ConvergenceTable, progress, say
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError
from armid_ros.excitation import design, DesignSettings, Excitation, save_excitation
from armid_ros.files import json_text, load_yaml, read_text, settled, write_file
from armid_ros.identification import (
    Grade,
    grade,
    Identification,
    identification_document,
    identify,
    Score,
    write_document,
)
from armid_ros.identification.assess.agreement import Agreement
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.identification.output import SCHEMA
from armid_ros.motion import FloatArray
from armid_ros.recording import read_recording, Recording
from armid_ros.report import identification_report
from armid_ros.report.identification_report import Assessment
from armid_ros.report.sections.convergence import Convergence
from armid_ros.robots import collision_model, load_robot, Robot
from armid_ros.robots.shipped import shipped_path
from armid_ros.simulation import Sensors, SimulatedArm
import click
import numpy as np

if TYPE_CHECKING:
    from armid_ros.nodes.lockstep import Progress

ROBOT = 'humanoid_arm'

SENSORS = Sensors(
    torque_noise=np.array([0.02, 0.02, 0.01, 0.01, 0.004, 0.004]), resolution=2.0 * np.pi / 2**18
)
#: Files that a folder to be filled may hold already, from a demo before.
OUTPUTS = ('bag', 'excitation.yaml', 'model.yaml', 'identification.json', 'report.html', 'story')

#: What is written beside the story.
_FILES = 'bag, excitation.yaml, model.yaml, identification.json, report.html'


def demo(gravity: str, rate: float, hide: str, out: Path, seed: int, as_json: bool) -> None:
    """Excite, move, identify online and offline; then find what was hidden in the arm."""
    from armid_ros.nodes.lockstep import replay_lockstep

    rng = np.random.default_rng(seed)
    robot = load_robot(ROBOT, gravity=gravity)
    truth = true_arm(robot)
    nominal = ArmModel(robot, truth.effects)
    staged = options.stage(out, SCHEMA, ROBOT, [*OUTPUTS, '*.png'])
    new = staged.folder
    excitation = _excite(nominal, rng)
    save_excitation(excitation, new / 'excitation.yaml')
    identifier = OnlineIdentifier(nominal, rng=np.random.default_rng(seed))
    target = identifier.base.values(truth.theta)
    plant = SimulatedArm(truth, rng=rng, sensors=SENSORS)
    history, end = _run(plant, excitation, identifier, target, new / 'bag', rate)
    again = OnlineIdentifier(nominal, rng=np.random.default_rng(seed))
    with progress('playing the bag back') as tick:
        replay = replay_lockstep(
            new / 'bag',
            again,
            duration=end.duration,
            on_progress=lambda now: tick(now.t / now.duration),
        )
        tick(0.0, 'identifying offline')
        recording = _read(new / 'bag', robot)
        result = identify(nominal, [recording], rng=rng, progress=tick)
        graded = grade(result, nominal, [recording], {})
    offline = Agreement.of(result.estimate, result.base.values(truth.theta))
    online = Agreement.of(end.estimate, target)
    document = {
        **identification_document(result, ROBOT, {}, grade=graded),
        'truth': offline.document(),
        'online': online.document(),
        'replay_difference': float(np.abs(replay.estimate.values - end.estimate.values).max()),
        'real_time_factor': end.real_time_factor,
        'held_out': _held_out_error(result.arm, truth, rng),
    }
    save_model(new / 'model.yaml', result.arm, ROBOT, result.estimate)
    page = _page(robot, result, history, target, truth, graded, recording)
    write_file(new / 'report.html', page)
    if not as_json:
        say(f'{graded.word}: {graded.reasons[0]}')
        _tell(document, online, offline, Score.of(result.training).relative_error_percent)
    rng = np.random.default_rng([seed, 1])
    told = tell_story(
        new / 'story', truth, result.arm, recording, sensors=SENSORS, rng=rng, hide=hide, rate=rate
    )
    document['story'] = told.document()
    write_document(new / 'identification.json', document)
    staged.keep()
    if as_json:
        click.echo(json_text(document))
    else:
        show_story(told, out / 'story')
        say(f'{out}: {_FILES}')


def _run(
    plant: SimulatedArm,
    excitation: Excitation,
    identifier: OnlineIdentifier,
    target: FloatArray,
    bag: Path,
    rate: float,
) -> tuple[list[Progress], Progress]:
    """Move the arm and identify it online, in a table; return what was said, and the end."""
    from armid_ros.nodes.lockstep import run_lockstep

    history: list[Progress] = []
    with ConvergenceTable(target) as table:

        def watch(now: Progress) -> None:
            history.append(now)
            table.show(now.t, now.duration, now.estimate, now.real_time_factor)

        end = run_lockstep(plant, excitation, identifier, bag, rate=rate, on_progress=watch)
    return history, end


def true_arm(robot: Robot) -> ArmModel:
    """Return the arm that is to be identified: other masses than described, and friction."""
    path = shipped_path(ROBOT).with_name('demo.yaml')
    true = load_yaml(read_text(path, ModelError))
    factors = np.array(true['mass_factors'])[:, np.newaxis]
    parameters = robot.rigid_parameters.reshape(-1, 10) * factors
    arm = ArmModel(robot.with_inertias(parameters.ravel()))
    for name, values in true['effects'].items():
        arm = arm.with_effect(make_effect(name, robot), values)
    return arm


def _excite(arm: ArmModel, rng: np.random.Generator) -> Excitation:
    settings = DesignSettings(period=10.0, harmonics=5, starts=2, candidates=20, iterations=40)
    with progress('designing the excitation') as tick:
        result = design(
            arm,
            settings,
            rng,
            collision=collision_model(arm.robot),
            progress=lambda now: tick(now.done),
        )
    return result.excitation


def _held_out_error(arm: ArmModel, truth: ArmModel, rng: np.random.Generator) -> float:
    """Return the error of the torque in a motion that was never run, in percent of the torque."""
    settings = DesignSettings(period=10.0, starts=1, candidates=1, iterations=1, processes=1)
    collision = collision_model(arm.robot)
    motion = design(arm, settings, rng, collision=collision).excitation.motion(100.0)
    tau = truth.torque(motion)
    return float(100.0 * np.linalg.norm(arm.torque(motion) - tau) / np.linalg.norm(tau))


def _page(
    robot: Robot,
    result: Identification,
    history: list[Progress],
    online_truth: FloatArray,
    truth: ArmModel,
    graded: Grade,
    recording: Recording,
) -> str:
    """Return report.html, with the truth and the convergence of the online estimate."""
    convergence = Convergence(
        np.array([now.t for now in history]),
        np.array([now.estimate.values for now in history]),
        np.array([now.estimate.std for now in history]),
        online_truth,
        history[-1].estimate.parameters,
    )
    assessment = Assessment(grade=graded, reference='truth', sections=[convergence])
    return identification_report(
        result,
        description=truth,
        robot=robot.name,
        recordings=[recording],
        validation={},
        assessment=assessment,
    )


def _read(bag: Path, robot: Robot) -> Recording:
    """Read what was recorded, under the name that it is going to have."""
    return replace(read_recording(bag, joints=robot.joints), source=str(settled(bag)))


def _tell(
    document: dict[str, Any], online: Agreement, offline: Agreement, training: float
) -> None:
    say(f'online:  {online.sentence()}')
    say(f'offline: {offline.sentence()}')
    say(
        f'relative error {training:.2f} % with the noise, {document["held_out"]:.2f} % of the '
        'true torque in a motion that was never run'
    )
    say(
        f'the bag played back gives the online estimate again, to '
        f'{document["replay_difference"]:.1g}'
    )
