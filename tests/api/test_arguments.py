# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What cannot be an argument is refused in one line that says what to give."""

import armid_ros as ar
import numpy as np
import pytest

from tests.identification.conftest import multisine, recorded


@pytest.fixture(scope='module')
def arm():
    return ar.ArmModel.of('humanoid_arm', effects='viscous_friction')


@pytest.fixture(scope='module')
def run(arm):
    return recorded(arm, multisine(arm.robot.joints, 4.0, 50.0, seed=1))


@pytest.mark.parametrize('ask', [ar.identify, ar.diagnose])
@pytest.mark.parametrize(
    ('recordings', 'said'),
    [([], 'no recordings'), (None, "'None'.*Recording"), (3, "'3'"), ([None], "'None'")],
)
def test_no_recording_is_said(arm, ask, recordings, said):
    with pytest.raises(ar.ArmidError, match=said):
        ask(arm, recordings)


def test_an_unknown_method_is_answered_with_those_there_are(arm, run):
    with pytest.raises(ar.ArmidError, match=r"'foo'.* ols"):
        ar.identify(arm, run, method='foo')


def test_a_recording_in_place_of_the_robot_is_answered_with_the_order(run):
    with pytest.raises(ar.ArmidError, match=r'Recording is no robot.*before recordings'):
        ar.identify(run, 'my_arm.urdf')


def test_a_folder_in_place_of_a_model_is_answered_with_the_model_in_it(tmp_path):
    (tmp_path / 'model.yaml').touch()
    with pytest.raises(ar.ArmidError, match=r'name .*model\.yaml'):
        ar.identify(tmp_path, 'monday')


def test_a_model_is_read_with_a_robot_in_any_form(arm, tmp_path):
    path = tmp_path / 'model.yaml'
    ar.save_model(path, arm, 'nowhere.urdf')
    for robot in (arm, arm.robot, 'humanoid_arm', arm.robot.path):
        np.testing.assert_array_equal(ar.load_model(path, robot).theta, arm.theta)
    with pytest.raises(ar.ArmidError, match=r'absent\.urdf'):
        ar.load_model(path, 'absent.urdf')


def test_a_misspelt_robot_or_prior_is_answered_with_what_was_meant(run):
    with pytest.raises(ar.ArmidError, match="'humanoid_arm'"):
        ar.load_robot('humanoid_am')
    for prior in ({'viscus_friction': 'often'}, {'viscous_friction': 'ofen'}):
        with pytest.raises(ar.ArmidError, match=r"'(viscous_friction|often)'"):
            ar.diagnose('humanoid_arm', run, prior=prior)
