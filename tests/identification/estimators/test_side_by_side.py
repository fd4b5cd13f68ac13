# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bias and scatter of the comparison are those that fits to simulated noise have."""

import itertools

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import SignalSettings
from armid_ros.identification.estimators.side_by_side import compare_methods, ComparisonSettings
from armid_ros.robots import load_robot
import numpy as np
import pytest

from ..conftest import multisine, recorded


@pytest.fixture(scope='module')
def scores():
    """Compare least squares and instruments on a recording with poor encoders."""
    arm = ArmModel(load_robot('humanoid_arm'))
    for name in ('viscous_friction', 'rotor_inertia'):
        arm = arm.with_effect(make_effect(name, arm.robot), np.full(6, 0.05))
    first, second = (
        recorded(arm, multisine(arm.robot.joints, 20.0, 200.0, seed), seed, 0.02, 3e-4)
        for seed in (1, 2)
    )
    ticks = itertools.count()
    return compare_methods(
        ArmModel(arm.robot, arm.effects),
        [first],
        [second],
        ComparisonSettings(('wls', 'iv'), SignalSettings(20.0, 4), twins=2),
        clock=lambda: float(next(ticks)),
    )


def test_the_bias_of_least_squares_is_seen_and_that_of_instruments_is_not(scores):
    plain, instruments = scores
    assert plain.bias > 3.0 * instruments.bias
    assert plain.bias > plain.scatter


def test_time_is_that_of_the_clock(scores):
    assert [score.seconds for score in scores] == [1.0, 1.0]


def test_documents_have_all_numbers(scores):
    document = scores[1].document()
    assert document['method'] == 'iv'
    assert all(isinstance(document[key], float) for key in document if key[-7:] == 'percent')


def test_an_estimator_that_cannot_be_used_is_a_row_with_the_reason():
    arm = ArmModel(load_robot('humanoid_arm'))
    for name in ('rotor_inertia', 'time_delay'):
        arm = arm.with_effect(make_effect(name, arm.robot))
    recording = recorded(arm, multisine(arm.robot.joints, 8.0, 200.0, 1), 1, 0.05)
    settings = ComparisonSettings(('ekf',), SignalSettings(20.0, 4), twins=0)
    (score,) = compare_methods(arm, [recording], [], settings, clock=lambda: 0.0)
    assert score.training is None
    assert 'ekf takes effects without a memory' in score.note
