# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Deviations of values that follow what a model gets wrong of a motion."""

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.cause import SelectedEffect
from armid_ros.diagnosis.search.deviations import with_jackknife_std
from armid_ros.diagnosis.search.fit import fit
from armid_ros.effects import CATALOGUE
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.signals import conditioning
import numpy as np
import pytest


def coulomb_of(bench, hide):
    """Return Coulomb friction of the elbow that is fitted to a hidden torque, and its evidence."""
    recordings = bench.recordings(hide)
    used = conditioning(recordings, SignalSettings())
    data = tuple(trajectories(recordings, used, bench.arm))
    sigma = tuple(np.full(2, 0.03) for _ in data)
    named = [SelectedEffect(CATALOGUE['coulomb_friction'].on(bench.robot, ('elbow',)), (0,))]
    evidence = Evidence.over_noise(data, sigma)
    return fit(bench.arm, named, evidence, None), evidence


def on_elbow(torque):
    return np.column_stack([np.zeros(len(torque)), torque])


def test_a_value_that_every_part_tells_alike_is_as_sure_as_noise_has_it(bench):
    fitted, evidence = coulomb_of(bench, lambda m, tau: on_elbow(0.2 * np.sign(m.dq[:, 1])))
    wide = with_jackknife_std(fitted, evidence, None, 0.0)
    assert fitted.estimate.std[0] <= wide.estimate.std[0] < 3.0 * fitted.estimate.std[0]


def test_a_value_that_parts_tell_otherwise_is_as_unsure_as_they_differ(bench):
    def later(motion, tau):
        half = motion.t > 0.5 * (motion.t[0] + motion.t[-1])
        return on_elbow((0.1 + 0.2 * half) * np.sign(motion.dq[:, 1]))

    fitted, evidence = coulomb_of(bench, later)
    wide = with_jackknife_std(fitted, evidence, None, 0.0)
    np.testing.assert_array_equal(wide.estimate.values, fitted.estimate.values)
    assert wide.estimate.std[0] > 2.0 * fitted.estimate.std[0]


def test_a_value_is_as_unsure_as_what_the_rest_has_along_any_cause(bench):
    fitted, evidence = coulomb_of(bench, lambda m, tau: on_elbow(0.2 * np.sign(m.dq[:, 1])))
    rows = np.concatenate([columns[:, 1, 0] for columns in fitted.columns])
    told = np.concatenate([part.informative[:, 1] for part in evidence.data])
    white = 0.03 / np.sqrt(np.sum(rows[told] ** 2))
    noise = with_jackknife_std(fitted, evidence, None, 1.0)
    wide = with_jackknife_std(fitted, evidence, None, 101.0)
    assert noise.estimate.std[0] == with_jackknife_std(fitted, evidence, None, 0.0).estimate.std[0]
    assert wide.estimate.std[0] == pytest.approx(10.0 * white, rel=0.2)
