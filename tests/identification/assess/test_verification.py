# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from types import SimpleNamespace

from armid_ros.arm import ArmModel
from armid_ros.identification import IdentificationSettings, identify, PhysicalSettings, verify
from armid_ros.identification.assess.verification import ForwardValidation, simulate_held_out
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

from ..conftest import multisine, recorded

USED = Conditioning(rate_hz=500.0, cutoff_hz=30.0, decimation=5)


@pytest.fixture(scope='module')
def recordings(arm):
    """Return training and held-out data."""
    motions = [
        multisine(arm.robot.joints, seconds, 200.0, seed) for seconds, seed in ((15, 1), (5, 2))
    ]
    return [
        recorded(arm, motion, seed, 0.02, 1e-5, name)
        for motion, seed, name in zip(motions, (1, 2), ('train', 'held_out'), strict=True)
    ]


@pytest.fixture(scope='module')
def result(structure, recordings):
    settings = IdentificationSettings(physical=PhysicalSettings())
    return identify(structure, recordings[:1], settings, rng=np.random.default_rng(0))


def verified(result, description, recordings, held_out):
    return verify(result, description, recordings, held_out, rng=np.random.default_rng(0))


def test_identified_arm_moves_more_like_the_recorded_one_than_the_description(
    result, structure, recordings
):
    found = verified(result, structure, recordings[:1], recordings[1:])
    (pair,) = found.forward
    assert np.all(pair.after.position_error < 0.2 * pair.before.position_error)
    assert np.all(pair.after.torque_error < pair.before.torque_error)
    assert found.noise.harmless and not found.left_out
    assert 'mrad' in pair.sentence() and 'held_out' in pair.sentence()


def test_what_is_not_done_is_said(result, recordings):
    bare = ArmModel(result.arm.robot.with_inertias(0.0 * result.arm.robot.rigid_parameters))
    (why,) = verified(result, bare, recordings[:1], ()).left_out
    assert 'held out' in why
    found = verified(result, bare, recordings[:1], recordings[1:])
    assert found.forward[0].before is None
    assert 'description' in found.left_out[0]


@pytest.mark.parametrize(
    ('before', 'after', 'worse'),
    [
        ([2e-3, 20e-3], [1e-3, 30e-3], ('elbow',)),
        ([2e-3, 20e-3], [1e-3, 20.1e-3], ()),
        ([1e-6, 20e-3], [2e-6, 10e-3], ()),
    ],
)
def test_a_simulation_that_is_worse_is_said_to_be(before, after, worse):
    before, after = (
        SimpleNamespace(
            position_error=np.array(errors), units=('rad', 'rad'), joints=('shoulder', 'elbow')
        )
        for errors in (before, after)
    )
    pair = ForwardValidation(before, after)
    assert pair.worse == worse
    assert bool(pair.comment()) == bool(worse)


def test_missing_friction_moves_the_arm_by_its_torque_over_the_stiffness(arm):
    """With 0.1 N m of friction more on the first joint; the true arm follows its own torques."""
    exact = recorded(arm, multisine(arm.robot.joints, 6.0, 500.0, seed=3))
    values = list(arm.values)
    values[1] = values[1] + np.array([0.1, 0, 0, 0, 0, 0])
    other = ArmModel(arm.robot, arm.effects, tuple(values))
    (pair,), _ = simulate_held_out(other, arm, USED, [exact])
    wrong, right = pair.before, pair.after
    assert 1e3 * right.position_error.max() < 2.0 and right.torque_error.max() < 2e-3
    assert wrong.position_error[0] > 5.0 * right.position_error[0]
    assert 0.02 < wrong.feedback_torque[0] < 0.2
    _, (why,) = simulate_held_out(other, arm, USED, [exact.select(slice(0, 20))])
    assert why.startswith('bag: not simulated: bag: no section')
