# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No sample of an arm without noise is left out: at rest its signals tell nothing of the noise."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.identification.samples.spikes import SpikeGate
from armid_ros.robots import load_robot
from armid_ros.simulation import Reference, SimulatedArm
import numpy as np
import pytest


def clean(rate: float, rest: float = 0.6, move: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """Return stamps, and position and torque of a joint that stands still and then moves."""
    t = np.arange(0.0, 4.0, 1.0 / rate)
    phase = np.clip((t - rest) / move, 0.0, 1.0)
    q = 1.2 + 0.8 * phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)
    ddq = np.gradient(np.gradient(q, t), t)
    return t, np.column_stack([q, 2.0 * ddq + 5.0 * np.cos(q)])


@pytest.mark.parametrize(
    ('rate', 'rounding', 'rest', 'move'),
    [(100.0, 1e-8, 0.3, 1.0), (200.0, 0.0, 0.6, 3.0), (1000.0, 1e-12, 0.6, 3.0)],
)
def test_a_joint_that_begins_to_move_keeps_all_samples(
    rate: float, rounding: float, rest: float, move: float
) -> None:
    t, signals = clean(rate, rest, move)
    signals = signals + rounding * np.random.default_rng(0).standard_normal(signals.shape)
    gate = SpikeGate([False], 'qt', torque_limit=[50.0])
    good = [one for at, x in zip(t, signals, strict=True) for one in gate.take(at, x)]
    assert len(good) >= len(t) - 2  # the last ones wait
    assert not gate.rejected
    assert not any(one.begins for one in good)


def test_damage_of_a_clean_stream_is_left_out() -> None:
    t, signals = clean(500.0)
    signals[1000, 0] += 0.01
    gate = SpikeGate([False], 'qt', torque_limit=[50.0])
    good = [one.t for at, x in zip(t, signals, strict=True) for one in gate.take(at, x)]
    assert t[1000] not in good and gate.rejected == {'spike': 1}


@pytest.mark.parametrize('spike', [0.0, 50.0])
def test_the_identifier_uses_every_state_of_a_simulation_but_damage(spike: float) -> None:
    robot = load_robot('humanoid_arm', gravity='moon')
    arm = ArmModel(robot).with_effect(make_effect('torque_offset', robot))
    rng = np.random.default_rng(0)
    motion = random_feasible(arm, Limits.of(robot, speed='medium'), 2.0, 3, rng)
    run = Excitation(motion, 1, 0.5)
    plant = SimulatedArm(arm, rng=rng, start=run.at([0.0]).q[0])
    identifier = OnlineIdentifier(arm, rng=rng)
    for k in range(700):
        if k == 200:
            plant.set_trajectory(Reference.of(run.motion(100.0)))
        sample = plant.advance(2)
        tau = sample.tau + spike * (k == 500)
        identifier.update(plant.state.t, sample.q, sample.dq, tau)
    assert sum(identifier.rejected.values()) == (spike > 0.0)
    assert not identifier.restarts and not identifier.missing
