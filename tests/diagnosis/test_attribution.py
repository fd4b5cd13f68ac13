# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The share of a gap that names explain of data that they were not fitted to."""

from dataclasses import replace

from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.joint_fit import JointFit
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.attribution import (
    Attribution,
    cross_validated,
    headline,
    held_out_gains,
)
from armid_ros.effects import CATALOGUE
import numpy as np
import pytest

from tests.diagnosis.test_floor import cut


def spring(motion, tau):
    """Return the torque of a spring of 1.5 N m/rad in the elbow."""
    return np.column_stack([np.zeros(len(motion.t)), 1.5 * motion.q[:, 1]])


def evidence_of(bench, hidden, seed=7):
    """Return other recordings in the unit of their noise."""
    data = cut(bench.recordings(hidden, seed=seed))
    sigma = tuple(noise_floor(part, bench.arm).sigma for part in data)
    return Evidence.over_noise(data, sigma)


@pytest.fixture(scope='module')
def sprung(bench):
    """Return what a spring in the elbow explains of recordings of an arm that has one."""
    evidence = evidence_of(bench, spring, 0)
    problem = JointFit.over_noise(bench.arm, evidence, np.random.default_rng(0))
    effect = CATALOGUE['joint_spring'].on(bench.robot, ('elbow',))
    fitted = problem.fit([NamedEffect(effect, (0, 1), np.zeros(2))])
    assert fitted.estimate.values[0] == pytest.approx(1.5, abs=3.0 * fitted.estimate.std[0])
    return Explanation(bench.arm, fitted, problem.fit(), (), evidence, problem)


def test_a_share_is_that_of_the_squares_and_lies_in_its_interval():
    rng = np.random.default_rng(0)
    whole = rng.uniform(1.0, 2.0, size=40)
    taken = np.array([0.6, 0.1])[:, np.newaxis] * whole * rng.uniform(0.9, 1.1, size=(2, 40))
    shares = Attribution((0, 1), whole, taken)
    low, high = shares.interval([0, 1], rng)
    assert low < shares.share([0, 1]) < high
    assert shares.share([0, 1]) == pytest.approx(0.7, abs=0.02)
    more = Attribution((0, 1), whole, taken + whole)
    assert more.share([0]) == 1.0 and more.interval([0], rng) == (1.0, 1.0)


def test_a_cause_that_predicts_nothing_of_other_data_is_minor(bench, sprung):
    sprung, settings = replace(sprung, steps=('spring',)), DiagnosisSettings()
    kept, shares = headline(sprung, evidence_of(bench, spring), 0.1, settings)
    assert kept is sprung and shares.share([0]) > 0.95
    fewer, shares = headline(sprung, evidence_of(bench, None), 0.0, settings)
    assert (fewer.steps, fewer.minor, shares.order) == ((), ('spring',), ())


def test_folds_that_were_not_fitted_show_it_as_well(sprung):
    folds, whole = cross_validated(sprung), held_out_gains(sprung, [0], sprung.evidence)
    assert folds.share([0]) == pytest.approx(whole.share([0]), abs=0.01)
