# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is known of a model whose recordings are not there any more."""

from dataclasses import replace

from armid_ros.diagnosis import known_misfit
from armid_ros.diagnosis.data.baseline import described_precision
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.joint_fit import JointFit
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.effects import CATALOGUE
from armid_ros.identification import identify, SignalSettings
from armid_ros.identification.output import identification_document
from armid_ros.identification.parameters_file import parameters_of
from armid_ros.identification.rows.signals import conditioning
import numpy as np
import pytest

from tests.diagnosis.conftest import diagnosed


@pytest.fixture
def data(bench):
    recordings = bench.recordings()
    return trajectories(recordings, conditioning(recordings, SignalSettings()), bench.arm)


def told_of(found):
    """Return what an identification tells of its parameters, and that of a model file."""
    read = parameters_of('identification.json', identification_document(found, 'arm', {}))
    return read.information(found.arm.parameters)


def test_base_parameters_are_as_sure_as_they_were_identified(bench):
    found = identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))
    precision = described_precision(found.base, found.arm, told_of(found))
    std = np.sqrt(np.diag(np.linalg.inv(precision)))
    np.testing.assert_allclose(std, found.estimate.std, rtol=0.01)  # the description tells little


@pytest.mark.long
def test_a_value_is_as_unsure_as_the_model_that_it_makes_up_for(bench):
    """Errors of values over models that are off by draws of their covariance."""
    rng = np.random.default_rng(7)
    size = len(bench.arm.parameters)
    off, own = [13, 21], 1e-4 * np.array([[1.0, 0.5], [0.5, 1.0]])  # mz, viscous friction
    told = 1e12 * np.eye(size)
    told[np.ix_(off, off)] = np.linalg.inv(own)
    recordings = bench.recordings(lambda m, tau: np.array([0.0, 0.4]) * m.q)
    data = tuple(trajectories(recordings, conditioning(recordings, SignalSettings()), bench.arm))
    evidence = Evidence.over_noise(data, tuple(np.full(2, 0.03) for _ in data))
    effect = CATALOGUE['joint_spring'].on(bench.robot, ('elbow',))
    named = [NamedEffect(effect, (0, 1), np.zeros(2))]
    errors, as_exact = [], []
    for _ in range(40):
        theta = bench.arm.theta
        theta[off] += rng.multivariate_normal(np.zeros(2), own)
        arm = bench.arm.with_theta(theta)
        problem = JointFit.over_noise(arm, evidence, np.random.default_rng(0))
        informed = Nuisance.of(problem.nuisance.rows, arm, np.random.default_rng(0), told)
        problem = replace(problem, nuisance=informed)
        for fits, found in ((problem, errors), (problem.as_described(), as_exact)):
            estimate = fits.fit(named).estimate
            found.append((estimate.values[0] - 0.4) / estimate.std[0])
    assert np.mean(np.abs(errors) < 2.0) >= 0.9
    assert np.mean(np.abs(as_exact) < 2.0) < 0.7, as_exact


@pytest.mark.slow
def test_what_a_model_was_identified_wrong_is_no_change(upright):
    """A slow short motion hardly tells inertias; a fast one of another day does."""
    known = upright.recordings()[0]
    short = [known.select(slice(0, len(known.t) // 4))]
    model = identify(upright.arm, short, rng=np.random.default_rng(0))
    misfit = replace(known_misfit(model.arm, short, model.used), information=told_of(model))
    found = diagnosed(model.arm, upright.recordings(seed=5), misfit=misfit)
    assert (found.verdict, found.findings) == ('consistent', ())
