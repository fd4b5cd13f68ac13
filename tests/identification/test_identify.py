# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification import grade, identify
from armid_ros.model import random_motion
from armid_ros.robots import robot_from_urdf
import numpy as np
import pytest

from .conftest import multisine


def run(structure, *recordings):
    return identify(structure, recordings, rng=np.random.default_rng(0))


def test_parameters_come_back_within_their_uncertainty_and_predict_any_motion(arm, identified):
    truth = identified.base.values(arm.theta)
    error = (identified.estimate.values - truth) / identified.estimate.std
    assert np.sqrt(np.mean(error**2)) < 1.4
    assert np.abs(error).max() < 5.0
    other = random_motion(arm.robot, np.random.default_rng(9), 200)
    off = np.linalg.norm(identified.arm.torque(other) - arm.torque(other))
    assert off < 0.03 * np.linalg.norm(arm.torque(other))


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


def test_a_description_without_masses_tells_the_sign_by_the_dissipated_energy(arm, recording):
    light = ArmModel(arm.robot.with_inertias(1e-9 * arm.robot.rigid_parameters), arm.effects)
    with pytest.raises(IdentificationError, match='sign'):
        run(light, replace(recording, tau=-recording.tau))


def test_a_short_recording_is_said_and_not_refused(structure, recording):
    first, second = (recording.select(slice(k, k + 600)) for k in (0, 600))
    for some, short in (((first,), True), ((first, second), False)):
        assert any('is short' in note for note in run(structure, *some).notes) == short


@pytest.mark.slow
@pytest.mark.parametrize(
    ('described', 'left'),
    [(r'<inertial>.*?</inertial>', ''), (r'<mass value="[^"]*"', '<mass value="0"')],
)
@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_an_arm_described_without_masses_is_identified(arm, recording, described, left):
    """First moments that are found stand on masses that no motion tells."""
    text = re.sub(described, left, arm.robot.urdf, flags=re.DOTALL)
    bare = robot_from_urdf(text, joints=arm.robot.joints)
    assert not np.any(bare.rigid_parameters[::10])
    result = run(ArmModel(bare, arm.effects), recording)
    other = multisine(arm.robot.joints, 5.0, 200.0, seed=7)
    error = result.arm.torque(other) - arm.torque(other)
    assert np.linalg.norm(error) < 0.05 * np.linalg.norm(arm.torque(other))
    grade(result, ArmModel(bare, arm.effects), [recording], {})
