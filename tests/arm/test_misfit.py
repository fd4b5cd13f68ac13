# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The misfit in model.yaml: what goes in comes out, and what is wrong is named."""

from armid_ros.arm import ArmModel, load_misfit, load_model, Misfit, save_model
from armid_ros.arm.misfit import RowFilters
from armid_ros.errors import ModelError
import numpy as np
import pytest
import yaml


@pytest.fixture
def path(robot, tmp_path):
    """Return a model with a misfit of 0.1, 0.2, ... N m."""
    rms = {joint: 0.1 * (k + 1) for k, joint in enumerate(robot.joints)}
    loud = dict.fromkeys(robot.joints, 2.0)
    misfit = Misfit('held-out', rms, 5.1, loud, filters=RowFilters(200.0, 12.5, 8))
    save_model(tmp_path / 'model.yaml', ArmModel(robot), robot.name, misfit=misfit)
    return tmp_path / 'model.yaml'


def test_it_comes_back_and_the_model_is_the_same_without_it(robot, path):
    found = load_misfit(path)
    assert found.data == 'held-out'
    assert found.relative_error_percent == 5.1
    assert found.filters == (200.0, 12.5, 8)
    np.testing.assert_allclose(found.of(robot), 0.1 * np.arange(1, 7))
    torque = np.array([1.0, 2.0, 3.0, 4.0, 0.0, 8.0])
    factor = np.array([1.0, 1.0, 1.5, 2.0, 1.0, 4.0])
    np.testing.assert_allclose(found.of(robot, torque), factor * found.of(robot))
    assert yaml.safe_load(path.read_text())['misfit']['unit'] == 'N m'
    np.testing.assert_array_equal(load_model(path).theta, ArmModel(robot).theta)


def test_a_model_that_was_not_identified_has_none(robot, tmp_path):
    save_model(tmp_path / 'model.yaml', ArmModel(robot), robot.name)
    assert load_misfit(tmp_path / 'model.yaml') is None


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        ({'rms': {'elbow_pitch': float('nan')}}, 'elbow_pitch'),
        ({'rms': 'much'}, 'misfit'),
        ({'data': 'guessed'}, 'guessed'),
        ({'torque_rms': {'elbow_pitch': -1.0}}, 'elbow_pitch'),
        ({'relative_error_percent': None}, 'misfit'),
        ({'filters': {'rate_hz': 100.0, 'cutoff_hz': -5.0, 'decimation': 4}}, 'cutoff_hz'),
    ],
)
def test_what_is_wrong_is_named_with_the_file(path, change, said):
    document = yaml.safe_load(path.read_text())
    document['misfit'] |= change
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(ModelError, match=said) as caught:
        load_misfit(path)
    assert str(path) in str(caught.value)


def test_a_joint_that_it_says_nothing_of_is_named(robot, path):
    misfit = load_misfit(path)
    rms = {joint: value for joint, value in misfit.rms.items() if joint != 'elbow_pitch'}
    with pytest.raises(ModelError, match='elbow_pitch'):
        Misfit('training', rms, 5.0).of(robot)
