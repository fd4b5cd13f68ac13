# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification of the springs between a machine and its wearer, from torques and angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armid_ros.cli import options
from armid_ros.cli.origin import provenance
from armid_ros.cli.terminal import progress, Tick
from armid_ros.errors import ModelError
from armid_ros.files import json_text, settled, write_file
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.assumptions import read_assumptions
from armid_ros.papers.exo.plant.gait import Gait, read_gait
from armid_ros.papers.exo.plant.gait_cycle import (
    check_cycle,
    gait_cycle,
    GaitCycle,
    ground_by_shares,
    weight,
)
from armid_ros.papers.exo.plant.leg_pair import (
    exercise,
    leg_pair,
    pair_torques,
    PairMotion,
    TiedPair,
    walking,
)
from armid_ros.papers.exo.plant.walkers import walking_pair
from armid_ros.papers.exo.report.page import exo_report, verdict
from armid_ros.papers.exo.report.walk import Driven, SimulatedWalk
from armid_ros.recording import (
    read_recording,
    recorded_together,
    Recording,
    write_joint_states,
)
from armid_ros.recording.writer import require_new, whole_bag
import click
import numpy as np
from numpy.random import Generator

#: Joints that the source drives by torque, one at a time.
_DRIVEN = ('exo_right_hip', 'exo_right_knee')
_SOFTER = 0.2
SCHEMA = 'armid/exo/1'
_RATE = 1000.0


@dataclass(frozen=True)
class SimulationOptions:
    """
    Options of the simulation that replaces a recording.

    Attributes
    ----------
    gait_file : Path or None
        File with the angles of walking.
    stiffness : float or None
        Stiffness of the springs [N/m].
    motion : str
        Name of the exercise.
    duration : float
        Duration of the recording [s].
    torque_noise, angle_noise : float
        Standard deviations [N m, deg].

    """

    gait_file: Path | None
    stiffness: float | None
    motion: str
    duration: float
    torque_noise: float
    angle_noise: float

    def record(
        self, path: Path, topics: Sequence[str], pair: TiedPair, gait: Gait, rng: Generator
    ) -> None:
        """Simulate the recordings of both machines along a motion, with noise."""
        motions = exercise(pair, self.motion, np.arange(0.0, self.duration, 1.0 / _RATE), gait)
        tau = pair_torques(pair, *motions).tau
        tau = tau + self.torque_noise * rng.normal(size=tau.shape)
        stamps = 10**9 + np.rint(motions.own.t * 1e9).astype(np.int64)
        noise = np.radians(self.angle_noise)
        with whole_bag(path) as writer:
            for topic, motion, torque in zip(topics, motions, (tau, None), strict=True):
                q = motion.q + noise * rng.normal(size=motion.q.shape)
                write_joint_states(writer, topic, motion.joints, stamps, q, None, torque)


def identify_pair(
    bag: Path | None,
    out: Path,
    topics: str,
    inertias: Any,
    simulated: SimulationOptions,
    seed: int,
    as_json: bool,
) -> None:
    """Find what ties an exoskeleton to its wearer."""
    pair = leg_pair(simulated.stiffness)
    gait = read_gait(simulated.gait_file)
    names = topics.split(',')
    if len(names) != 2:
        raise ModelError(f'--topics {topics}: give two topics, of the machine and of its wearer')
    if bag is None:
        require_new(out / 'recording')
    staged = options.stage(out, SCHEMA)
    with progress('recording') as tick:
        path = staged.folder / 'recording' if bag is None else bag
        if bag is None:
            simulated.record(path, names, pair, gait, np.random.default_rng(seed))
        settings = options.read_settings()
        machine, wearer = (
            read_recording(path, joints=one.joints, topic=topic, settings=settings)
            for one, topic in zip((pair.robot, pair.other), names, strict=True)
        )
        options.tell_damage(machine, wearer)
        source = str(settled(path))
        both = replace(machine, source=source), replace(wearer, source=source)
        found = _identify(pair, *both, inertias, tick)
        walked = _walk(pair, gait, simulated.stiffness, tick) if bag is None else None
    document = _document(found, walked, both[0].source)
    page = exo_report(
        pair.with_stiffness(found[0].stiffness[0].clip(0.0)),
        *(_shown(pair, gait) if bag is None else _recorded(pair, *both)),
        found,
        walked,
        provenance(
            [path], {'inertias': inertias, 'topics': topics}, seed if bag is None else None
        ),
    )
    write_file(staged.folder / 'report.html', page)
    write_file(staged.folder / 'exo.json', json_text(document, indent=1))
    staged.keep()
    if as_json:
        click.echo(json_text(document))
        return
    rows = [
        (row['segment'], f'{row["value"]:.1f}', f'{row["std"]:.1f}')
        for row in document['stiffness']
    ]
    heads = ('spring', 'stiffness [N/m]', 'std')
    options.show_verdict(verdict(found, walked), heads, rows, f'{out}: exo.json, report.html')


def _walk(pair: TiedPair, gait: Gait, stiffness: float | None, tick: Tick) -> SimulatedWalk:
    """Simulate the walking pair, with joints driven by torque."""
    tick(0.6, 'walking a whole cycle')
    walkers = walking_pair(stiffness)
    cycle, rate = gait_cycle(walkers, gait), read_assumptions()['torque_rate'].value
    soft = walkers.with_stiffness((1.0 - _SOFTER) * walkers.stiffness)
    shared = ground_by_shares(cycle)
    driven = [
        Driven(
            check_cycle(cycle, joint, rate),
            check_cycle(cycle, joint, rate, soft),
            check_cycle(cycle, joint, rate, ground_forces=shared),
        )
        for joint in _DRIVEN
    ]
    truth = dict(zip(('all', *pair.segments), [pair.stiffness[0]] * 5, strict=False))
    return SimulatedWalk(truth, cycle, driven, _SOFTER, rate)


def _identify(
    pair: TiedPair, machine: Recording, wearer: Recording, inertias: Any, tick: Tick
) -> list[Interaction]:
    """Estimate one stiffness for all springs, and one for each."""
    found = []
    for share, separate in ((0.1, False), (0.35, True)):
        tick(share, 'identifying')
        problem = recorded_interaction_problem(
            pair.machines,
            machine,
            wearer,
            inertias=inertias,
            separate=separate,
        )
        found.append(identify_interaction(problem))
    return found


def _shown(pair: TiedPair, gait: Gait) -> tuple[PairMotion, FloatArray, str]:
    """Return the motion of single support, over the gait cycle of the swing leg."""
    known = read_assumptions()
    begin, end = known['single_support'].value
    cycle = known['cycle_time'].value
    t = np.linspace(0.0, (end - begin) * cycle, 2 * round(500 * (end - begin) * cycle) + 1)
    phase = begin + 0.5 + t / cycle
    return walking(pair, gait, t), phase, 'gait cycle of the swing leg'


def _recorded(
    pair: TiedPair, machine: Recording, wearer: Recording
) -> tuple[PairMotion, FloatArray, str]:
    """Return the recorded motion; only its positions are shown."""
    both = recorded_together(machine, wearer, pair.other)
    assert both.partner is not None
    motions = PairMotion(
        *(
            Motion(joints, both.t, q, np.zeros_like(q), np.zeros_like(q))
            for joints, q in ((machine.joints, both.q), (wearer.joints, both.partner.q))
        )
    )
    return motions, both.t, 'time [s]'


def _document(
    found: list[Interaction], walked: SimulatedWalk | None, source: str
) -> dict[str, Any]:
    rows = [
        {
            'segment': segment,
            'value': float(part.stiffness[k]),
            'std': float(part.std[k]),
            'unit': 'N/m',
            'interval': part.interval()[k].tolist(),
            'bias_of_least_squares': float(part.bias[k]),
            'truth': walked.truth.get(segment) if walked else None,
        }
        for part in found
        for k, segment in enumerate(part.segments)
    ]
    cycle = [
        {
            'joint': d.joint,
            'error_deg': d.right.most,
            'error_softer_deg': d.softer.most,
            'error_shared_deg': d.shared.most,
            'source_deg': d.source,
        }
        for d in (walked.driven if walked else ())
    ]
    return {
        'schema': SCHEMA,
        'recording': source,
        'stiffness': rows,
        'cycle': cycle,
        'feet': _feet(walked.cycle) if walked else [],
    }


def _feet(cycle: GaitCycle) -> list[dict[str, Any]]:
    """Return the forces on the feet of both machines."""
    pair = cycle.pair
    return [
        {
            'machine': robot.name,
            'weight': weight(robot),
            'most': float(cycle.feet(other=other)[..., 1].max()),
            'double_support': float(np.mean(cycle.support(other=other) == 2)),
            'unit': 'N',
        }
        for robot, other in ((pair.robot, False), (pair.other, True))
    ]
