# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a file of an identification says of the parameters that a model has."""

from dataclasses import replace

from armid_ros.effects import CATALOGUE
from armid_ros.identification import identify
from armid_ros.identification.output import identification_document
from armid_ros.identification.parameters_file import parameters_of
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
