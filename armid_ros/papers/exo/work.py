# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated recordings, estimates and the JSON document of `armid exo`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armid_ros.cli.terminal import Tick
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.motion import Motion
from armid_ros.papers.exo.plant.gait import read_assumptions
from armid_ros.papers.exo.plant.gait_cycle import gait_cycle, ground_by_shares
from armid_ros.papers.exo.plant.leg_pair import PairMotion, TiedPair, with_noise, with_torques
from armid_ros.papers.exo.plant.torque_driven import check_cycle
from armid_ros.papers.exo.plant.walkers import walking_pair
from armid_ros.papers.exo.report.walk import (
    DrivenJoint,
    SimulatedWalk,
    SOURCE_ERROR,
    STIFFNESS_ERROR,
)
from armid_ros.recording import recorded_together, Recording, write_joint_states
from armid_ros.recording.writer import atomic_bag
import numpy as np
from numpy.random import Generator

SCHEMA = 'armid/exo/1'


def record(
    path: Path,
    topics: Sequence[str],
    pair: TiedPair,
    motions: PairMotion,
    noise: tuple[float, float],
    rng: Generator,
) -> None:
    """Write a bag with noisy joint states; `noise`: std of angles [deg] and torques [N m]."""
    measured = with_noise(with_torques(pair, motions), float(np.radians(noise[0])), noise[1], rng)
    stamps = 10**9 + np.rint(motions.own.t * 1e9).astype(np.int64)
    with atomic_bag(path) as writer:
        for topic, motion in zip(topics, measured, strict=True):
            write_joint_states(writer, topic, motion.joints, stamps, motion.q, None, motion.tau)


def walk(pair: TiedPair, stiffness: float | None, tick: Tick) -> SimulatedWalk:
    """Simulate a gait cycle, and its repeats with torque-driven joints of the exoskeleton."""
    tick(0.6, 'simulating a gait cycle')
    walkers = walking_pair(stiffness)
    cycle, rate = gait_cycle(walkers), read_assumptions()['torque_rate'].value
    soft = walkers.with_stiffness((1.0 - STIFFNESS_ERROR) * walkers.stiffness)
    torques = cycle.own.tau, cycle.torques(soft), cycle.torques(ground=ground_by_shares(cycle))
    driven = [
        DrivenJoint(*(check_cycle(cycle, joint, rate, tau) for tau in torques))
        for joint in SOURCE_ERROR  # the source drives these joints, one at a time
    ]
    return SimulatedWalk(float(pair.stiffness[0]), cycle, driven)


def identify_ties(
    pair: TiedPair, machine: Recording, wearer: Recording, inertias: Any, tick: Tick
) -> list[Interaction]:
    """Estimate one common stiffness of all straps, then one stiffness for each strap."""
    found = []
    for share, separate in ((0.1, False), (0.35, True)):
        tick(share, 'identifying')
        problem = recorded_interaction_problem(
            pair, machine, wearer, inertias=inertias, separate=separate
        )
        found.append(identify_interaction(problem))
    return found


def recorded_motions(pair: TiedPair, machine: Recording, wearer: Recording) -> PairMotion:
    """Return the recorded positions of both machines on a common time base."""
    both = recorded_together(machine, wearer, pair.other)
    assert both.partner is not None
    return PairMotion(
        *(
            Motion(joints, both.t, q, np.zeros_like(q), np.zeros_like(q))
            for joints, q in ((machine.joints, both.q), (wearer.joints, both.partner.q))
        )
    )


def exo_document(
    found: list[Interaction], walked: SimulatedWalk | None, source: str
) -> dict[str, Any]:
    """Return the content of exo.json: stiffness of straps and, if simulated, the gait cycle."""
    rows = [
        {
            'segment': segment,
            'value': float(part.stiffness[k]),
            'std': float(part.std[k]),
            'unit': 'N/m',
            'interval': part.interval()[k].tolist(),
            'bias_of_least_squares': float(part.bias[k]),
            'truth': walked.stiffness if walked else None,
        }
        for part in found
        for k, segment in enumerate(part.segments)
    ]
    cycle = [
        {
            'joint': right.joint,
            'error_deg': right.most,
            'error_softer_deg': softer.most,
            'error_shared_deg': shared.most,
            'source_deg': SOURCE_ERROR[right.joint],
        }
        for right, softer, shared in (walked.driven if walked else ())
    ]
    feet = [
        {
            'machine': one.robot.name,
            'weight': one.weight,
            'most': float(one.feet[..., 1].max()),
            'double_support': float(np.mean(one.support == 2)),
            'unit': 'N',
        }
        for one in ((walked.cycle.own, walked.cycle.other) if walked else ())
    ]
    return {
        'schema': SCHEMA,
        'recording': source,
        'stiffness': rows,
        'cycle': cycle,
        'feet': feet,
    }
