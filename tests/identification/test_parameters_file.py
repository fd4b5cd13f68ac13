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


def test_information_of_standard_parameters_is_the_inverse_covariance():
    """On parameters that were not identified there is none."""
    bench = Bench()
    found = identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))
    read = parameters_of('identification.json', identification_document(found, 'bench', {}))
    told = read.information(bench.arm.parameters)
    lift = np.linalg.pinv(found.base.grouping)
    product = lift.T @ told @ lift @ found.estimate.covariance
    np.testing.assert_allclose(product, np.eye(found.base.rank), atol=1e-3)
    hidden = np.eye(len(told)) - lift @ found.base.grouping
    np.testing.assert_allclose(hidden @ told @ hidden, 0.0, atol=1e-9 * np.abs(told).max())
    assert replace(read, covariance=None).information(bench.arm.parameters) is None
    arm = bench.arm.with_effect(CATALOGUE['joint_spring'].on(bench.robot, ('elbow',)))
    more, known = read.information(arm.parameters), len(told)
    assert not np.any(more[known:]) and not np.any(more[:, known:])
    np.testing.assert_allclose(more[:known, :known], told)


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
    written = {'grade': 'unusable', 'reasons': ['Because.', 'So.'], 'training': training}
    assert known_fit(written).unusable and known_fit(written).reason == 'Because.'
    assert known_fit({}) is None


@pytest.mark.parametrize('rms', [float('nan'), -0.1, 'much'])
def test_numbers_that_no_residual_has_are_refused(rms):
    with pytest.raises((ValueError, ModelError), match=r"of a|joint 'a'"):
        known_fit({'training': score([rms, 0.1], [1.0, 1.0])})
