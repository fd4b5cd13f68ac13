# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Drives of the two-link arm, simulated bags and terminal tables of `armid elastic`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from armid_ros.cli.terminal import Tick
from armid_ros.errors import RobotError
from armid_ros.files import Staged
from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.experiments import (
    resonance_experiments,
    RESONANCE_GAIN,
    run_experiment,
    step_experiments,
)
from armid_ros.papers.elastic.report import IN_WORDS
from armid_ros.recording.elastic import write_runs
from armid_ros.recording.writer import require_new
from armid_ros.robots import Robot
from armid_ros.robots.two_link import two_link_set, TwoLinkParameters
from armid_ros.simulation import Sensors
from armid_ros.simulation.controller import VelocityLoop
from armid_ros.simulation.elastic import two_link_loop
import numpy as np

#: Heads and rows of a table.
Table = tuple[Sequence[str], Sequence[Sequence[str]]]
#: Recordings that --demo makes.
DEMO_BAGS = ('resonances', 'steps')


def machine(**given: str | None) -> tuple[FloatArray, TwoLinkParameters, VelocityLoop]:
    """Return accelerometer distances [m], drives and velocity loop from options or defaults."""
    shipped = two_link_set('after')
    loop = two_link_loop(shipped)
    defaults = {
        'accelerometers': shipped.assumptions['accelerometer_radius'],
        'gear': shipped.parameters.gear,
        'kp': loop.proportional,
        'ki': loop.integral,
    }
    found = {name: np.asarray(default, dtype=float) for name, default in defaults.items()}
    for name, text in given.items():
        if text is None:
            continue
        try:
            found[name] = np.array([float(part) for part in text.split(',')])
        except ValueError:
            found[name] = np.empty(0)
        if found[name].shape != (2,) or not np.all(found[name] > 0.0):
            raise RobotError(
                f"--{name} needs two positive numbers, one for each joint, not '{text}'"
            )
    drives = replace(shipped.parameters, gear=found['gear'])
    return found['accelerometers'], drives, VelocityLoop(found['kp'], found['ki'])


def simulate(
    robot: Robot, radius: FloatArray, staged: Staged, experiments: int, seed: int, tick: Tick
) -> tuple[list[Path], list[Path]]:
    """Simulate a two-link arm; return the paths of resonance bags and of step bags."""
    for name in DEMO_BAGS:
        require_new(staged.out / name)
    resonances, steps = (staged.folder / name for name in DEMO_BAGS)
    rng, drives = np.random.default_rng(seed), two_link_set('after')
    drives = replace(drives, assumptions={**drives.assumptions, 'accelerometer_radius': radius})
    plans = (
        (resonances, RESONANCE_GAIN, resonance_experiments(experiments, rng), 0.004),
        (steps, 1.0, step_experiments(), 0.002),
    )
    for path, gain, plan, noise in plans:
        sensors, runs = Sensors(velocity_noise=noise, acceleration_noise=0.2), []
        for number, reference in enumerate(plan):
            tick(number / len(plan), f'simulating {path.name}')
            runs.append(run_experiment(reference, drives, rng, gain=gain, sensors=sensors))
        write_runs(path, runs, robot)
    return [resonances], [steps]


def resonances_table(document: dict[str, Any]) -> Table:
    """Return a table of stiffness, resonances and Coulomb torque of both joints."""
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


def values_table(document: dict[str, Any]) -> Table:
    """Return a table of all parameters with their standard deviations."""
    return ('parameter', 'symbol', 'joint', 'value', 'std', 'unit'), [
        (
            IN_WORDS[row['name']],
            row['name'],
            row['joint'],
            f'{row["value"]:.5g}',
            '' if row['std'] is None else f'{row["std"]:.2g}',
            row['unit'],
        )
        for row in [*document['parameters'], *document.get('total_damping', [])]
    ]
