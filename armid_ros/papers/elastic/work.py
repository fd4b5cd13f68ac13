# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification of two links on springs in three steps, from bags to parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armid_ros.cli import options
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import progress, Tick
from armid_ros.errors import RecordingError, RobotError
from armid_ros.files import json_text, Staged, write_file
from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.files import read_runs
from armid_ros.papers.elastic.identification.output import elastic_document, SCHEMA, tuning_story
from armid_ros.papers.elastic.identification.response import PER_JOINT
from armid_ros.papers.elastic.identification.three_steps import identify_two_inertia
from armid_ros.papers.elastic.plant import (
    ElasticSensors,
    EXCITATION_RMS,
    resonance_experiments,
    run_all,
    step_experiments,
    STEP_POSES,
    STEPS,
    WEAK,
)
from armid_ros.papers.elastic.report import elastic_report, verdict
from armid_ros.papers.elastic.springs import identify_springs
from armid_ros.recording.elastic import write_runs
from armid_ros.recording.writer import require_new
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.two_link import (
    planar_pair,
    ROBOT,
    two_link_set,
    TwoLinkParameters,
)
from armid_ros.simulation.controller import VelocityLoop
from armid_ros.simulation.elastic import two_link_loop, two_link_plant
from armid_ros.simulation.sensors import LinkAccelerometers
import click
import numpy as np

#: Heads and rows of a table.
Table = tuple[Sequence[str], Sequence[Sequence[str]]]
#: Recordings that --demo makes.
DEMO_BAGS = ('resonances', 'steps')
#: Noise of the simulated sensors: rates in rad/s, accelerations in rad/s^2, at the joints.
SENSORS = ElasticSensors(motor_velocity=0.006, link_velocity=0.003, link_acceleration=0.2)
STEP_SENSORS = ElasticSensors(motor_velocity=0.002, link_velocity=0.002, link_acceleration=0.2)


@dataclass(frozen=True)
class ElasticOptions:
    """
    Options of the identification: data, sensors and motors.

    Attributes
    ----------
    bags, steps : tuple of Path
        Recordings through the resonances, and of step responses.
    robot : str
        The arm.
    model : Path or None
        A model.yaml with inertias, for arms other than a pair of links.
    demo : bool
        Whether the shipped arm is simulated first.
    experiments : int
        Number of simulated experiments of 4 s.
    start : str or None
        Initial parameters of the tuning.
    accelerometers, gear, kp, ki : str or None
        Distances [m], gear ratios, gains of the velocity loop, two numbers each.

    """

    bags: tuple[Path, ...]
    steps: tuple[Path, ...]
    robot: str
    model: Path | None
    demo: bool
    experiments: int
    start: str | None
    accelerometers: str | None
    gear: str | None
    kp: str | None
    ki: str | None

    def machine(self) -> tuple[FloatArray, TwoLinkParameters, VelocityLoop]:
        """Return positions of sensors, drives and loop; by default those of the shipped arm."""
        shipped = two_link_set('after')
        radius = shipped.assumptions['accelerometer_radius']
        radius = _two_numbers(self, 'accelerometers', radius)
        gear = _two_numbers(self, 'gear', shipped.parameters.gear)
        loop = two_link_loop(shipped)
        loop = replace(
            loop,
            proportional=_two_numbers(self, 'kp', loop.proportional),
            integral=_two_numbers(self, 'ki', loop.integral),
        )
        return radius, replace(shipped.parameters, gear=gear), loop


def identify_elastic(
    data: ElasticOptions, out: Path, seed: int, as_json: bool, every: bool = False
) -> None:
    """Identify elastic joints."""
    begin = data.start or ('before' if data.demo else 'found')
    printed = None if begin == 'found' else two_link_set(begin).parameters
    robot = load_robot(data.robot)
    if not planar_pair(robot):
        if data.demo or data.steps:
            raise RobotError(
                f'{robot.name} is no pair of links that move in a horizontal plane, as --demo and '
                '--steps need. Without them its springs are found joint by joint'
            )
        identify_springs(data.bags, robot, data.robot, data.model, out, seed, as_json)
        return
    if data.model is not None:
        raise RobotError('--model has no place in the three steps, which find the inertias')
    shipped = two_link_set('after')
    radius, drives, loop = data.machine()
    staged = options.stage(out, SCHEMA, data.robot)
    with progress('reading') as tick:
        if data.demo:
            data = _simulate(robot, radius, staged, data, seed, tick)
        elif not data.bags:
            raise RecordingError('no bag is named; give one, or --demo to simulate one')
        how = options.read_settings(), options.tell_damage
        runs, responses = (
            [run for path in paths for run in read_runs(path, robot, radius, *how)]
            for paths in (data.bags, data.steps)
        )
        result = identify_two_inertia(
            runs, drives, steps=responses, loop=loop, start=printed, progress=tick
        )
        tick(1.0, 'writing')
        known, table = None, ''
        if robot.name == ROBOT:
            known, table = shipped.parameters, 'Table 1 of the source, after tuning'
        elif printed is not None:
            known, table = printed, f"the set '{begin}', which the tuning began with"
        files, seeds = [*data.bags, *data.steps], seed if data.demo else None
        origin = provenance(files, {'start of the tuning': begin}, seeds)
        page = elastic_report(result, robot.name, known, table, origin)
        write_file(staged.folder / 'report.html', page)
    document = elastic_document(result, data.robot)
    if data.demo and result.tuning is not None:
        truth = shipped.parameters
        document['story'] = tuning_story(result.tuning, printed or result.untuned, truth)
    write_file(staged.folder / 'elastic.json', json_text(document, indent=1))
    staged.keep()
    if as_json:
        click.echo(json_text(document))
        return
    heads, rows = _values(document) if every else _resonances(document)
    shown = verdict(result)
    shown = replace(shown, sentences=[*shown.sentences, *_story(document)])
    options.show_verdict(shown, heads, rows, f'{out}: elastic.json, report.html')


def _two_numbers(data: ElasticOptions, what: str, default: Any) -> FloatArray:
    """Return the two positive numbers of an option."""
    text = getattr(data, what)
    if text is None:
        return np.asarray(default, dtype=float)
    try:
        values = np.array([float(part) for part in text.split(',')])
    except ValueError:
        values = np.empty(0)
    if values.shape != (2,) or not np.all(values > 0.0):
        raise RobotError(f"--{what} takes two positive numbers, one for each joint, not '{text}'")
    return values


def _simulate(
    robot: Robot,
    radius: FloatArray,
    staged: Staged,
    data: ElasticOptions,
    seed: int,
    tick: Tick,
) -> ElasticOptions:
    """Write bags of the simulated arm: through the resonances, and steps."""
    for name in DEMO_BAGS:
        require_new(staged.out / name)
    resonances, steps = (staged.folder / name for name in DEMO_BAGS)
    rng, shipped = np.random.default_rng(seed), two_link_set('after')
    plant = two_link_plant(shipped.parameters)
    sensors = LinkAccelerometers(robot, np.outer(radius, [1.0, 0.0, 0.0]))
    plans = (
        (
            resonances,
            two_link_loop(shipped, WEAK),
            resonance_experiments(data.experiments, rms=EXCITATION_RMS, rng=rng),
            SENSORS,
        ),
        (steps, two_link_loop(shipped), step_experiments(STEP_POSES, STEPS), STEP_SENSORS),
    )
    for path, loop, plan, noise in plans:
        tick(0.0, f'simulating {path.name}')
        runs = [noise.measure(run, rng) for run in run_all(plant, loop, plan, tick)]
        write_runs(path, runs, robot, sensors)
    return replace(data, bags=(resonances,), steps=(steps,))


def _resonances(document: dict[str, Any]) -> Table:
    heads = ('joint', 'stiffness [N m/rad]', 'antiresonance', 'resonance', 'Coulomb [N m]')
    stiffness = {
        row['joint']: row['value'] for row in document['parameters'] if row['name'] == 'kg'
    }
    return heads, [
        (
            one['joint'],
            f'{stiffness[one["joint"]]:.0f}',
            f'{one["antiresonance_hz"]:.2f} Hz',
            f'{one["resonance_hz"]:.2f} Hz',
            f'{one["coulomb_torque"]:.3g}',
        )
        for one in document['joints']
    ]


def _values(document: dict[str, Any]) -> Table:
    words = {name: field.replace('_', ' ') for field, name, _ in PER_JOINT}
    return ('parameter', 'joint', 'value', 'std', 'unit'), [
        (
            f'{words[row["name"]]} ({row["name"]})' if row['name'] in words else row['name'],
            row['joint'],
            f'{row["value"]:.5g}',
            '' if row['std'] is None else f'{row["std"]:.2g}',
            row['unit'],
        )
        for row in (*document['parameters'], *document.get('total_damping', []))
    ]


def _story(document: dict[str, Any]) -> list[str]:
    return [
        f'Against the true arm tuning made the error {story["factor"]:.0f} times smaller; main '
        f'parameters are within {story["main_parameters_percent_after"]:.2g} %.'
        for story in filter(None, [document.get('story')])
    ]
