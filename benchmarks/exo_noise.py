# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Noise of the leg pair's sensors, and identification of its springs."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.identification.ties.problem import Inertias, interaction_problem
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.motion import Motion
from armid_ros.papers.exo.plant.leg_pair import pair_torques, PairMotion, TiedPair
from armid_ros.recording import Recording
import numpy as np

TORQUE_NOISE = 0.5


def find_springs(
    pair: TiedPair,
    motions: PairMotion,
    degrees: float,
    seed: int,
    *,
    inertias: Inertias = 'known',
    separate: bool = False,
) -> Interaction:
    """Draw noise, and identify springs from poses, or from 1000 samples on as a recording."""
    own, other = measured(motions, degrees, np.random.default_rng(seed))
    if len(own) < 1000:
        problem = interaction_problem(
            pair,
            own,
            other,
            noise=(np.radians(degrees), TORQUE_NOISE),
            inertias=inertias,
            separate=separate,
        )
        return identify_interaction(problem)
    return identify_interaction(
        recorded_interaction_problem(
            pair,
            recorded(own),
            recorded(other),
            inertias=inertias,
            separate=separate,
        )
    )


def with_torques(pair: TiedPair, motions: PairMotion) -> PairMotion:
    """Return a motion with exact torques of the machine."""
    return PairMotion(motions.own.with_torque(pair_torques(pair, *motions).tau), motions.other)


def measured(motions: PairMotion, degrees: float, rng: np.random.Generator) -> PairMotion:
    """Return a motion with exact torques and added sensor noise."""
    own, other = (
        replace(m, q=m.q + np.radians(degrees) * rng.normal(size=m.q.shape)) for m in motions
    )
    assert own.tau is not None
    tau = own.tau + TORQUE_NOISE * rng.normal(size=own.tau.shape)
    return PairMotion(own.with_torque(tau), other)


def recorded(motion: Motion, start_ns: int = 0) -> Recording:
    """Return a motion as a recording."""
    return Recording(
        joints=motion.joints, t=motion.t, q=motion.q, tau=motion.tau, start_ns=start_ns
    )
