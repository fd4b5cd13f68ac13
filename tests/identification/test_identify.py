# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification import grade, IdentificationSettings, identify, Score, SignalSettings
from armid_ros.model import random_motion
from armid_ros.robots import robot_from_urdf
import numpy as np
import pytest

from .conftest import FRICTION, multisine, recorded


@pytest.fixture(scope='module')
def motion(arm):
    return multisine(arm.robot.joints, 20.0, 200.0, seed=1)


@pytest.fixture(scope='module')
def recording(arm, motion):
    return recorded(arm, motion, torque_noise=0.02, position_noise=1e-6)


def run(structure, *recordings, **signals):
    settings = IdentificationSettings(signals=SignalSettings(**signals))
    return identify(structure, recordings, settings, rng=np.random.default_rng(0))


@pytest.fixture(scope='module')
def result(structure, recording):
    return run(structure, recording)


def test_parameters_come_back_within_their_uncertainty(arm, result):
    truth = result.base.values(arm.theta)
    error = (result.estimate.values - truth) / result.estimate.std
    assert np.sqrt(np.mean(error**2)) < 1.4
    assert np.abs(error).max() < 5.0


def test_model_predicts_any_motion_not_only_the_training_data(arm, result):
    other = random_motion(arm.robot, np.random.default_rng(9), 200)
    error = result.arm.torque(other) - arm.torque(other)
    assert np.linalg.norm(error) < 0.03 * np.linalg.norm(arm.torque(other))


def test_held_out_error_is_the_noise(arm, result):
    held_out = recorded(arm, multisine(arm.robot.joints, 15.0, 200.0, seed=7), 3, 0.02, 1e-6)
    score = Score.of(result.predict([held_out]))
    taps = result.used.taps
    np.testing.assert_allclose(score.rms, 0.02 * np.linalg.norm(taps), rtol=0.3)


def test_a_resting_joint_is_named_and_the_others_are_identified(arm, structure):
    moving = multisine(arm.robot.joints, 20.0, 200.0, seed=1)
    still = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    motion = replace(moving, q=moving.q * still, dq=moving.dq * still, ddq=moving.ddq * still)
    result = run(structure, recorded(arm, motion, torque_noise=0.01))
    assert any('rest' in note and 'wrist_pitch' in note for note in result.notes)
    assert result.base.rank < arm.base_parameters(np.random.default_rng(0)).rank
    estimate = result.estimate
    found = estimate.values[estimate.index('viscous_coefficient', 'elbow_pitch')]
    assert abs(found - FRICTION['viscous_friction']) < 0.01


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        (lambda run: run.select(slice(0, 120)), 'too short; record'),
        (lambda run: replace(run, q=0.0 * run.q), 'does not move'),
        (lambda run: replace(run, tau=None), 'no effort'),
        (lambda run: replace(run, tau=1e-309 * run.tau), 'constant'),
        (lambda run: replace(run, tau=-run.tau), 'opposite sign.*[Nn]egate'),
        (lambda run: replace(run, tau=1e3 * run.tau), 'N mm'),
        (lambda run: replace(run, q=np.rad2deg(run.q)), 'degrees'),
    ],
    ids=['short', 'still', 'no torque', 'constant', 'sign', 'N mm', 'degrees'],
)
def test_data_that_identify_nothing_are_refused(structure, recording, change, message):
    with pytest.raises(IdentificationError, match=message) as caught:
        run(structure, change(recording))
    assert 'bag' in str(caught.value)


def test_wrong_sign_of_an_arm_that_the_description_does_not_know(arm, recording):
    """A description without masses says nothing of the sign; the dissipated energy does."""
    masses = 1e-9 * arm.robot.rigid_parameters
    light = ArmModel(arm.robot.with_inertias(masses), arm.effects)
    with pytest.raises(IdentificationError, match='sign'):
        run(light, replace(recording, tau=-recording.tau))


def test_a_position_beyond_its_limit_is_said_and_not_refused(structure, recording):
    robot = structure.robot
    lower = robot.lower.copy()
    lower[0] = recording.q[:, 0].min() + 0.2
    narrow = replace(structure, robot=replace(robot, lower=lower))
    (said,) = (note for note in run(narrow, recording).notes if 'limits' in note)
    assert robot.joints[0] in said
    assert f'{lower[0] - 0.2:.4g} of' in said
    slack = replace(robot, lower=np.minimum(robot.lower, recording.q.min(axis=0) + 1e-3))
    beyond = run(replace(structure, robot=slack), recording).notes
    assert not any('limits' in note for note in beyond)


def test_a_short_recording_is_said_and_not_refused(structure, recording):
    rate = 1.0 / recording.period
    short, long = (recording.select(slice(0, round(t * rate))) for t in (3.0, 6.0))
    assert any('is short' in note for note in run(structure, short).notes)
    assert not any('is short' in note for note in run(structure, long).notes)
    halves = [long.select(slice(0, len(long) // 2)), long.select(slice(len(long) // 2, None))]
    assert not any('is short' in note for note in run(structure, *halves).notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('described', 'left'),
    [(r'<inertial>.*?</inertial>', ''), (r'<mass value="[^"]*"', '<mass value="0"')],
)
@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_an_arm_described_without_masses_is_identified(arm, motion, recording, described, left):
    """First moments that are found stand on masses that no motion tells."""
    text = re.sub(described, left, arm.robot.urdf, flags=re.DOTALL)
    bare = robot_from_urdf(text, joints=arm.robot.joints)
    assert not np.any(bare.rigid_parameters[::10])
    result = run(ArmModel(bare, arm.effects), recording)
    other = multisine(arm.robot.joints, 5.0, 200.0, seed=7)
    error = result.arm.torque(other) - arm.torque(other)
    assert np.linalg.norm(error) < 0.05 * np.linalg.norm(arm.torque(other))
    grade(result, ArmModel(bare, arm.effects), [recording], {})
