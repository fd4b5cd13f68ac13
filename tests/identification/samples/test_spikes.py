# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damage costs the samples that are damaged; what the arm really does always passes."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.identification.samples.spikes import N_FIRST, SpikeGate
from armid_ros.robots import load_robot
from armid_ros.simulation import Reference, SimulatedArm
import numpy as np
import pytest

RATE = 500.0
NOISE = 0.02
COUNT = 2000
DAMAGED = COUNT // 2


def stream(rng, count=COUNT):
    """Return stamps, and a smooth signal beside a noisy one with steps, as friction makes them."""
    t = np.arange(count) / RATE
    smooth = np.sin(3.0 * t)
    steps = np.sign(np.cos(3.0 * t)) + NOISE * rng.normal(size=count)
    return t, np.stack([np.round(smooth / 1e-4) * 1e-4, steps], axis=1)


def passed(t, x, floor=0.0):
    """Return the gate of a position and a torque, the samples it passes on, and their stamps."""
    gate = SpikeGate([False], 'qt')
    good = [s for at, row in zip(t, x, strict=True) for s in gate.take(float(at), row, floor)]
    return gate, good, np.array([s.t for s in good])


@pytest.mark.parametrize('length', [1, 10])
@pytest.mark.parametrize(('signal', 'size'), [(1, 100.0), (1, 1.5), (0, 0.5), (0, 3e-3)])
def test_damage_costs_the_damaged_samples_alone(signal, size, length):
    t, x = stream(np.random.default_rng(1))
    damaged = slice(DAMAGED, DAMAGED + length)
    x[damaged, signal] += size
    assert not passed(t, x, np.full(2, 1.2 * size))[0].rejected  # an error without consequence
    gate, _, good = passed(t, x)
    np.testing.assert_array_equal(good, np.delete(t, damaged))
    assert gate.rejected.total() == length
    if size != 1.5:  # a torque within reach of the others may be of the arm
        assert gate.spikes == {signal: length}


@pytest.mark.parametrize(('where', 'sign'), [(630, -1.0), (880, 1.0), (DAMAGED, 1.0)])
def test_a_glitch_of_a_smooth_signal_does_not_hide_in_its_acceleration(where, sign):
    """Its line may be missed by twice what acceleration does, whichever way it turns."""
    t, x = stream(np.random.default_rng(18))
    x[:, 0] = np.sin(9.0 * t)
    x[where, 0] += sign * 2.5 * (9.0 / RATE) ** 2
    gate, _, good = passed(t, x)
    assert t[where] not in good
    assert len(good) >= COUNT - 2  # so near its line, the next one may seem to go on from it
    assert set(gate.spikes) == {0}


@pytest.mark.parametrize('where', [0, 1, N_FIRST - 1, N_FIRST])
def test_damage_among_the_first_samples_is_no_measure_of_noise(where):
    t, x = stream(np.random.default_rng(2))
    x[where, 1] += 50.0
    _, _, good = passed(t, x)
    assert t[where] not in good
    missing = np.delete(t, where)[~np.isin(np.delete(t, where), good)]
    assert len(missing) <= 2 and np.all(missing < t[where])  # a line needs two samples


@pytest.mark.parametrize('size', [0.0, 0.3, 30.0, 1e4])
def test_a_step_of_a_torque_that_lasts_and_a_collision_pass_whole(size):
    t, x = stream(np.random.default_rng(3))
    x[DAMAGED:, 1] += size
    x[:, 0] += 2.0 * np.minimum(t, 2.0 * (t[DAMAGED // 2] + 0.3 / RATE) - t)
    gate, good, stamps = passed(t, x)
    np.testing.assert_array_equal(stamps, t)
    assert not gate.rejected and not any(s.begins for s in good)


@pytest.mark.parametrize('late', [2, 9])
def test_a_clock_that_is_set_a_little_begins_a_new_stretch(late):
    """Set forth, positions stand still for some samples; set back, they jump."""
    t, x = stream(np.random.default_rng(13))
    back = np.concatenate([t[:DAMAGED], t[DAMAGED:] - late / RATE])
    forth = np.concatenate([t[:DAMAGED], t[DAMAGED:] + late / RATE])
    for stamps, first in ((back, DAMAGED + late), (forth, DAMAGED)):
        _, good, _ = passed(stamps, x)
        assert [s.t for s in good if s.begins] == [stamps[first]]
        assert len(good) >= COUNT - late - 1


@pytest.mark.parametrize(('height', 'reason'), [(-1.7, 'pulse'), (-20.0, 'spike')])
def test_a_torque_that_jumps_to_where_it_often_is_may_be_of_the_arm(height, reason):
    t, x = stream(np.random.default_rng(15))
    x[400:1900:100, 1] += height * np.sign(x[400:1900:100, 1])
    gate, good, _ = passed(t, x)
    assert len(good) == COUNT - 15
    assert gate.rejected == {reason: 15}
    assert sum(gate.spikes.values()) == 15 * (reason == 'spike')


@pytest.mark.parametrize('later', [0.0, 0.1])
def test_full_turns_are_no_damage_and_undone(later):
    """Across a gap after which a new stretch begins, too."""
    t, x = stream(np.random.default_rng(5))
    t[DAMAGED:] += later
    turned = 4.0 * t
    x[:, 0] = np.angle(np.exp(1j * turned))
    gate, good, stamps = passed(t, x)
    assert stamps.tolist() == t.tolist() and not gate.rejected
    np.testing.assert_allclose([s.x[0] for s in good], turned, atol=1e-9)


@pytest.mark.parametrize('where', [0, 1, DAMAGED])
@pytest.mark.parametrize('angle', [3.3, 1e5])
def test_a_damaged_angle_turns_nothing_after_it(where, angle):
    t, x = stream(np.random.default_rng(17))
    spoiled = x.copy()
    spoiled[where, 0] += angle
    _, good, _ = passed(t, spoiled)
    assert all(np.array_equal(s.x, x[round(s.t * RATE)]) for s in good)
    assert len(good) >= COUNT - 3


@pytest.mark.parametrize('resolution', [1e-4, 1.5e-3])
def test_an_arm_that_rested_may_begin_to_move(resolution):
    """The first steps of a coarse encoder are no damage."""
    rng = np.random.default_rng(6)
    t, x = stream(rng)
    x[:DAMAGED] = np.stack([np.zeros(DAMAGED), NOISE * rng.normal(size=DAMAGED)], axis=1)
    x[DAMAGED:, 0] = np.round((t[DAMAGED:] - t[DAMAGED]) ** 2 / resolution) * resolution
    gate, good, _ = passed(t, x)
    assert len(good) == COUNT and not gate.rejected
    assert not any(one.begins for one in good)


def test_a_stamp_from_elsewhere_costs_one_sample_and_a_new_clock_none():
    t, x = stream(np.random.default_rng(8))
    stamps = t.copy()
    stamps[500] += 1000.0
    stamps[700] = -5.0
    stamps[DAMAGED:] -= 300.0
    gate, _, good = passed(stamps, x)
    np.testing.assert_array_equal(good, np.delete(stamps, [500, 700]))
    assert gate.rejected == {'stamp': 2}


@pytest.mark.parametrize(('ahead', 'where'), [(2, DAMAGED), (9, DAMAGED), (5, COUNT - 3)])
def test_a_stamp_a_little_ahead_costs_its_own_sample_and_none_after_it(ahead, where):
    t, x = stream(np.random.default_rng(19))
    stamps = t.copy()
    stamps[where] = t[where] + (ahead + 0.5) / RATE
    gate, _, good = passed(stamps, x)
    np.testing.assert_array_equal(good, np.delete(t, where))
    assert gate.rejected.total() == 1


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
    signals[len(t) // 2, 0] += 0.01
    gate = SpikeGate([False], 'qt', torque_limit=[50.0])
    left = [one.t for at, x in zip(t, signals, strict=True) for one in gate.take(at, x)]
    assert t[len(t) // 2] not in left and gate.rejected == {'spike': 1}


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
