# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A damaged sample in a recording neither bends a fit nor refuses it, and is said."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.effects import make_effect
from armid_ros.identification import identify
from armid_ros.identification.rows.damage import impossible_excursions, without_damage
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.identification.samples.spikes import SpikeGate
import numpy as np
import pytest

from tests.identification.conftest import multisine, recorded


@pytest.fixture(scope='module')
def good(arm):
    motion = multisine(arm.robot.joints, 20.0, 500.0, seed=4)
    return recorded(arm, motion, torque_noise=0.02)


@pytest.fixture(scope='module')
def fitted(structure, good):
    return identify(structure, [good], rng=np.random.default_rng(0))


def spoiled(recording, row, signal, joint, size):
    values = getattr(recording, signal).copy()
    values[row, joint] += size
    return replace(recording, **{signal: values})


def repaired(recording):
    return without_damage([recording], conditioning([recording], SignalSettings()))


@pytest.mark.parametrize(
    ('signal', 'size', 'word'),
    [('tau', 100.0, 'effort'), ('tau', 1e6, 'effort'), ('q', 0.2, 'position')],
)
def test_one_damaged_sample_changes_nothing_and_is_said(
    structure, good, fitted, signal, size, word
):
    bad = spoiled(good, 4000, signal, 5, size)
    found = identify(structure, [bad], rng=np.random.default_rng(0))
    shift = np.abs(found.estimate.values - fitted.estimate.values)
    assert np.all(shift < 0.2 * fitted.estimate.std)
    np.testing.assert_allclose(found.estimate.std, fitted.estimate.std, rtol=0.05)
    (note,) = (note for note in found.notes if 'jumps' in note)
    assert f'{word} of wrist_pitch' in note
    assert '8.000 s' in note
    assert not any('jump' in note for note in fitted.notes)


@pytest.mark.parametrize(
    ('rate', 'seed', 'late'), [(200.0, 0, 0.004), (200.0, 1, 0.0), (1000.0, 1, 0.004)]
)
def test_pulses_where_free_play_is_crossed_are_no_damage(arm, rate, seed, late):
    """One joint's impact is felt by all, and takes torques to where they never are otherwise."""
    loose = arm
    for name, size in (('backlash', 0.004), ('time_delay', late)):
        effect = make_effect(name, arm.robot)
        loose = loose.with_effect(effect, np.full(len(effect.parameters(arm.robot)), size))
    motion = multisine(arm.robot.joints, 12.0, rate, seed=seed)
    recording = recorded(loose, motion, torque_noise=0.002)
    assert repaired(recording) == ([recording], ())
    where = int(np.argmax(np.abs(recording.tau[:, 5])))
    _, (damage,) = repaired(spoiled(recording, where, 'tau', 5, 20.0))
    assert '1 sample' in damage and 'wrist_pitch' in damage


@pytest.mark.parametrize('seed', range(3))
def test_a_gate_that_takes_every_sample_finds_the_same(seed):
    """A recording is judged as a stream is, and only where something is suspicious."""
    rng = np.random.default_rng(seed)
    t = np.arange(3000) / 500.0
    smooth = np.stack([np.sin(3.0 * t), np.cos(3.0 * t)], axis=1)
    x = smooth + 1e-3 * rng.normal(size=smooth.shape)
    for start, length, signal in zip(
        rng.choice(np.arange(100, 2900, 40), 5, replace=False),
        rng.integers(1, 9, 5),
        rng.integers(0, 2, 5),
        strict=True,
    ):
        x[start : start + length, signal] += 9.0
    x[1525:, 1] += 0.5  # a change that lasts is none
    found = impossible_excursions(t, x, np.zeros(2))
    gate = SpikeGate([True], 'qt')
    passed = [s.t for stamp, row in zip(t, x, strict=True) for s in gate.take(float(stamp), row)]
    left = [sample.t for one in found for sample in one.samples]
    assert len(left) == len(set(left))
    np.testing.assert_array_equal(sorted(left), np.setdiff1d(t, passed))
