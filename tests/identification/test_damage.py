# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A damaged sample in a recording neither bends a fit nor refuses it, and is said."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.identification import identify
from armid_ros.identification.damage import without_damage
from armid_ros.identification.signals import SignalSettings
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


@pytest.mark.parametrize(
    ('signal', 'size', 'words'),
    [
        ('tau', 100.0, 'effort of wrist_pitch at 8.000 s'),
        ('tau', 1e6, 'effort of wrist_pitch at 8.000 s'),
        ('q', 0.2, 'position of wrist_pitch at 8.000 s'),
        ('q', 100.0, 'position of wrist_pitch at 8.000 s'),
    ],
)
def test_one_damaged_sample_changes_nothing_and_is_said(
    structure, good, fitted, signal, size, words
):
    bad = spoiled(good, 4000, signal, 5, size)
    found = identify(structure, [bad], rng=np.random.default_rng(0))
    shift = np.abs(found.estimate.values - fitted.estimate.values)
    assert np.all(shift < 0.2 * fitted.estimate.std)
    np.testing.assert_allclose(found.estimate.std, fitted.estimate.std, rtol=0.05)
    assert any(words in note and '1 sample jumps' in note for note in found.notes)


def test_a_good_recording_is_passed_on_as_it_is(good, fitted):
    recordings, damage = without_damage([good], SignalSettings())
    assert recordings[0] is good and not damage
    assert not any('jump' in note for note in fitted.notes)
