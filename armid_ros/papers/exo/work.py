# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings, estimates and the document of `armid exo`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armid_ros.cli.terminal import Tick
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait import Gait, read_assumptions
from armid_ros.papers.exo.plant.gait_cycle import (
    check_cycle,
    gait_cycle,
    ground_by_shares,
    weight,
)
from armid_ros.papers.exo.plant.leg_pair import (
    pair_torques,
    PairMotion,
    TiedPair,
    walking,
)
from armid_ros.papers.exo.plant.walkers import walking_pair
from armid_ros.papers.exo.report.walk import Driven, SimulatedWalk
from armid_ros.recording import recorded_together, Recording, write_joint_states
from armid_ros.recording.writer import whole_bag
import numpy as np
from numpy.random import Generator

#: Joints that the source drives by torque, one at a time.
_DRIVEN = ('exo_right_hip', 'exo_right_knee')
_SOFTER = 0.2
SCHEMA = 'armid/exo/1'


def record(
    path: Path,
    topics: Sequence[str],
    pair: TiedPair,
    motions: PairMotion,
    noise: tuple[float, float],
    rng: Generator,
) -> None:
    """Record both machines along a motion, with noise of angles [deg] and torques [N m]."""
    tau = pair_torques(pair, *motions).tau
    tau = tau + noise[1] * rng.normal(size=tau.shape)
    stamps = 10**9 + np.rint(motions.own.t * 1e9).astype(np.int64)
    with whole_bag(path) as writer:
        for topic, motion, torque in zip(topics, motions, (tau, None), strict=True):
            q = motion.q + np.radians(noise[0]) * rng.normal(size=motion.q.shape)
            write_joint_states(writer, topic, motion.joints, stamps, q, None, torque)


def walk(pair: TiedPair, gait: Gait, stiffness: float | None, tick: Tick) -> SimulatedWalk:
    """Simulate the walking pair, and its torque-driven joints."""
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


def identify_ties(
    pair: TiedPair, machine: Recording, wearer: Recording, inertias: Any, tick: Tick
) -> list[Interaction]:
    """Estimate one stiffness for all springs, and one for each."""
    found = []
    for share, separate in ((0.1, False), (0.35, True)):
        tick(share, 'identifying')
        problem = recorded_interaction_problem(
            pair,
            machine,
            wearer,
            inertias=inertias,
            separate=separate,
        )
        found.append(identify_interaction(problem))
    return found


def single_support(pair: TiedPair, gait: Gait) -> tuple[PairMotion, FloatArray, str]:
    """Return the motion of single support as a function of the gait cycle of the swing leg."""
    known = read_assumptions()
    begin, end = known['single_support'].value
    cycle = known['cycle_time'].value
    t = np.linspace(0.0, (end - begin) * cycle, 2 * round(500 * (end - begin) * cycle) + 1)
    phase = begin + 0.5 + t / cycle
    return walking(pair, gait, t), phase, 'gait cycle of the swing leg'


def recorded_motions(
    pair: TiedPair, machine: Recording, wearer: Recording
) -> tuple[PairMotion, FloatArray, str]:
    """Return the recorded motion; the report uses only its positions."""
    both = recorded_together(machine, wearer, pair.other)
    assert both.partner is not None
    motions = PairMotion(
        *(
            Motion(joints, both.t, q, np.zeros_like(q), np.zeros_like(q))
            for joints, q in ((machine.joints, both.q), (wearer.joints, both.partner.q))
        )
    )
    return motions, both.t, 'time [s]'


def exo_document(
    found: list[Interaction], walked: SimulatedWalk | None, source: str
) -> dict[str, Any]:
    """Return springs, and for simulated data the gait cycle, as the document of exo.json."""
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
    feet = []
    if walked is not None:
        pair, walk_cycle = walked.cycle.pair, walked.cycle
        feet = [
            {
                'machine': robot.name,
                'weight': weight(robot),
                'most': float(walk_cycle.feet(other=other)[..., 1].max()),
                'double_support': float(np.mean(walk_cycle.support(other=other) == 2)),
                'unit': 'N',
            }
            for robot, other in ((pair.robot, False), (pair.other, True))
        ]
    return {
        'schema': SCHEMA,
        'recording': source,
        'stiffness': rows,
        'cycle': cycle,
        'feet': feet,
    }
