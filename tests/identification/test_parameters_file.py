# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a file of an identification says of the parameters that a model has."""

from dataclasses import replace

from armid_ros.effects import CATALOGUE
from armid_ros.errors import ModelError
from armid_ros.identification import identification_document, identify
from armid_ros.identification.parameters_file import known_fit, parameters_of
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench


@pytest.fixture(scope='module')
def bench():
    return Bench()


@pytest.fixture(scope='module')
def found(bench):
    return identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))


@pytest.fixture(scope='module')
def read(found):
    return parameters_of('identification.json', identification_document(found, 'bench', {}))


def test_information_of_standard_parameters_is_the_inverse_covariance(bench, found, read):
    told = read.information(bench.arm.parameters)
    lift = np.linalg.pinv(found.base.grouping)
    product = lift.T @ told @ lift @ found.estimate.covariance
    np.testing.assert_allclose(product, np.eye(found.base.rank), atol=1e-3)
    hidden = np.eye(len(told)) - lift @ found.base.grouping
    np.testing.assert_allclose(hidden @ told @ hidden, 0.0, atol=1e-9 * np.abs(told).max())
    assert replace(read, covariance=None).information(bench.arm.parameters) is None


def test_no_information_on_parameters_that_were_not_identified(bench, read):
    spring = CATALOGUE['joint_spring'].on(bench.robot, ('elbow',))
    arm = bench.arm.with_effect(spring)
    told = read.information(arm.parameters)
    known = len(bench.arm.parameters)
    assert not np.any(told[known:]) and not np.any(told[:, known:])
    np.testing.assert_allclose(told[:known, :known], read.information(bench.arm.parameters))


def score(rms, errors, **others):
    joints = 'ab'
    return {
        'relative_error_percent': max(errors),
        'joint_relative_error_percent': dict(zip(joints, errors, strict=True)),
        'rms': dict(zip(joints, rms, strict=True)),
    } | others


def test_what_was_fitted_counts_as_what_was_held_out_may_be_of_a_changed_arm():
    training = score([0.1, 0.2], [1.0, 2.0], bags=['x', 'y', 'z'])
    held_out = [score([0.3, 0.4], [30.0, 40.0], bag='v')]
    found = known_fit({'training': training, 'validation': held_out})
    assert (found.recordings, found.grade) == (3, 'good')
    assert found.misfit.rms == {'a': 0.1, 'b': 0.2}
    assert found.misfit.torque_rms == pytest.approx({'a': 10.0, 'b': 10.0})


def test_a_grade_that_is_written_is_kept_with_its_reason():
    document = {'grade': 'unusable', 'reasons': ['Because.', 'So.']}
    found = known_fit(document | {'training': score([0.1, 0.1], [1.0, 1.0])})
    assert found.unusable and found.reason == 'Because.'


def test_a_file_without_a_score_says_nothing():
    assert known_fit({}) is None


@pytest.mark.parametrize('rms', [float('nan'), -0.1, 'much'])
def test_numbers_that_no_residual_has_are_refused(rms):
    with pytest.raises((ValueError, ModelError), match=r"of a|joint 'a'"):
        known_fit({'training': score([rms, 0.1], [1.0, 1.0])})
