# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""When a gain counts: replicated, possible, and not made of the measured torque itself."""

from types import SimpleNamespace

from armid_ros.diagnosis.selection import block_z, of_the_gap, replicated, solve_products
from armid_ros.diagnosis.settings import DiagnosisSettings
import numpy as np
import pytest


@pytest.mark.parametrize(
    ('z', 'counts'),
    [
        ([4.0, 3.5, 0.0], True),
        ([8.0, 2.0, 0.1], True),  # lives in the fast motion
        ([8.0, 0.5, 0.1], False),  # one trajectory alone
        ([8.0, 2.0, -4.0], False),  # another one disagrees
        ([2.0, 2.0, 2.0], False),
        ([2.5, 2.3, 2.4, 2.6], True),  # many short parts, of which each agrees
        ([2.5, 2.3, 2.4, 1.0], False),
        ([1.8, 1.9, 2.0, 1.8], False),
    ],
)
def test_a_gain_has_to_be_there_in_more_than_one_trajectory(z, counts):
    trial = SimpleNamespace(z=np.array(z), only=None)
    assert replicated(trial, DiagnosisSettings()) is counts


@pytest.mark.parametrize(
    ('gains', 'counts'),
    [
        ([2000.0, 0.0], True),
        ([1000.0, 0.0], False),  # a thousandth of all
        ([0.0, 700.0], True),  # a fiftieth of a joint that had a part of the gap
        ([0.0, 300.0], False),
    ],
)
def test_a_gain_has_to_be_a_part_of_the_first_gap(gains, counts):
    trial = SimpleNamespace(gain=sum(gains), gains=np.array([gains]))
    assert of_the_gap(trial, np.array([1e6, 4e4]), DiagnosisSettings()) is counts


def test_a_joint_that_had_next_to_nothing_of_the_gap_does_not_count():
    trial = SimpleNamespace(gain=50.0, gains=np.array([[0.0, 50.0]]))
    assert not of_the_gap(trial, np.array([1e6, 100.0]), DiagnosisSettings())


@pytest.mark.parametrize(('z', 'counts'), [(4.6, True), (3.2, False)])
def test_what_one_trajectory_alone_can_show_has_to_be_beyond_doubt_there(z, counts):
    trial = SimpleNamespace(z=np.array([0.0, 0.0, z]), only=2)
    assert replicated(trial, DiagnosisSettings()) is counts


def test_blocks_are_not_fooled_by_coloured_noise():
    rng = np.random.default_rng(0)
    slow = np.repeat(rng.normal(size=(200, 20)), 25, axis=1)  # 25 alike in a row
    fold = np.zeros(slow.shape[1], dtype=int)
    z = np.array([block_z(fold, gain, 12)[0] for gain in slow])
    rows = slow.mean(axis=1) / slow.std(axis=1) * np.sqrt(slow.shape[1])
    assert np.mean(np.abs(z) > 3.0) < 0.06
    assert np.mean(np.abs(rows) > 3.0) > 0.3  # what counting rows would have said


def test_directions_that_the_data_do_not_tell_stay_at_zero():
    own = np.array([[2.0, 2.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    values, _ = solve_products(own, np.array([4.0, 4.0, 0.0]))
    np.testing.assert_allclose(values, [1.0, 1.0, 0.0], atol=1e-9)
