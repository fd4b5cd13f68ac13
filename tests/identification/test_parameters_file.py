# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a file of an identification says of the parameters that a model has."""

from dataclasses import replace

from armid_ros.effects import CATALOGUE
from armid_ros.identification import identify
from armid_ros.identification.output import identification_document
from armid_ros.identification.parameters_file import parameters_of
import numpy as np

from tests.diagnosis.conftest import Bench


def test_torques_are_off_by_the_covariance_of_the_standard_parameters():
    bench = Bench()
    found = identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))
    read = parameters_of('identification.json', identification_document(found, 'bench', {}))
    standard = read.standard_covariance(bench.arm.parameters)
    motion = found.training[0].motion
    columns = bench.arm.columns(motion)[::20].reshape(-1, len(bench.arm.parameters))
    base = columns[:, found.base.independent]
    expected = np.einsum('rp,pq,rq->r', base, found.estimate.covariance, base)
    off = np.einsum('rp,pq,rq->r', columns, standard, columns)
    np.testing.assert_allclose(off, expected, rtol=1e-3, atol=1e-9 * expected.max())
    assert replace(read, covariance=None).standard_covariance(bench.arm.parameters) is None


def test_parameters_that_were_not_identified_have_no_variance():
    bench = Bench()
    found = identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))
    read = parameters_of('identification.json', identification_document(found, 'bench', {}))
    spring = CATALOGUE['joint_spring'].on(bench.robot, ('elbow',))
    arm = bench.arm.with_effect(spring)
    standard = read.standard_covariance(arm.parameters)
    known = len(bench.arm.parameters)
    assert not np.any(standard[known:]) and not np.any(standard[:, known:])
    np.testing.assert_allclose(
        standard[:known, :known], read.standard_covariance(bench.arm.parameters)
    )
