# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Deviations of values that follow what a model gets wrong of a motion."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.diagnosis.data.baseline import Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.fit import fit
from armid_ros.diagnosis.search.held_out import as_change, widened
from armid_ros.diagnosis.search.trial import Named
from armid_ros.effects import CATALOGUE
from armid_ros.identification import SignalSettings
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.identification.rows.signals import conditioning
import numpy as np
import pytest


def coulomb_of(bench, hide):
    """Return Coulomb friction of the elbow that is fitted to a hidden torque, and its evidence."""
    recordings = bench.recordings(hide)
    used = conditioning(recordings, SignalSettings())
    data = tuple(trajectories(recordings, used, bench.arm))
    sigma = tuple(np.full(2, 0.03) for _ in data)
    named = [Named(CATALOGUE['coulomb_friction'].on(bench.robot, ('elbow',)), (0,))]
    evidence = Evidence.over_noise(data, sigma)
    return fit(bench.arm, named, evidence, None), evidence


def on_elbow(torque):
    return np.column_stack([np.zeros(len(torque)), torque])


def test_a_value_that_every_part_tells_alike_is_as_sure_as_noise_has_it(bench):
    fitted, evidence = coulomb_of(bench, lambda m, tau: on_elbow(0.2 * np.sign(m.dq[:, 1])))
    wide = widened(fitted, evidence, None, 0.0)
    assert fitted.estimate.std[0] <= wide.estimate.std[0] < 3.0 * fitted.estimate.std[0]


def test_a_value_that_parts_tell_otherwise_is_as_unsure_as_they_differ(bench):
    def later(motion, tau):
        half = motion.t > 0.5 * (motion.t[0] + motion.t[-1])
        return on_elbow((0.1 + 0.2 * half) * np.sign(motion.dq[:, 1]))

    fitted, evidence = coulomb_of(bench, later)
    wide = widened(fitted, evidence, None, 0.0)
    np.testing.assert_array_equal(wide.estimate.values, fitted.estimate.values)
    assert wide.estimate.std[0] > 2.0 * fitted.estimate.std[0]


def test_a_value_is_as_unsure_as_what_the_rest_has_along_any_cause(bench):
    fitted, evidence = coulomb_of(bench, lambda m, tau: on_elbow(0.2 * np.sign(m.dq[:, 1])))
    rows = np.concatenate([columns[:, 1, 0] for columns in fitted.columns])
    told = np.concatenate([part.informative[:, 1] for part in evidence.data])
    white = 0.03 / np.sqrt(np.sum(rows[told] ** 2))
    noise = widened(fitted, evidence, None, 1.0)
    wide = widened(fitted, evidence, None, 101.0)
    assert noise.estimate.std[0] == widened(fitted, evidence, None, 0.0).estimate.std[0]
    assert wide.estimate.std[0] == pytest.approx(10.0 * white, rel=0.2)


def with_body(fitted, evidence, rng):
    """Return a fit with a body of one parameter beside the value, and a baseline of 40 rows."""
    body = [rng.normal(size=own.shape) for own in fitted.columns]
    columns = tuple(
        np.concatenate(pair, axis=2) for pair in zip(body, fitted.columns, strict=True)
    )
    before, own = rng.normal(size=(2, 40, 1))
    prior = Prior((), (before[:, :, None],), (0.3 * own + rng.normal(size=(40, 1)),), np.eye(1))
    held = prior.of_change + NormalEquations(prior.described, np.zeros(1))
    wider = replace(fitted, columns=columns, change=np.zeros(1), prior=held.and_zeros(np.zeros(1)))
    return wider, prior, SimpleNamespace(columns=lambda arm, effect, kept: own), own


def test_a_value_that_was_there_before_makes_its_change_as_unsure_as_it_moves_it(bench):
    """The change is that of a fit of the values of both days and a body, all written out."""
    fitted, evidence = coulomb_of(bench, lambda m, tau: on_elbow(0.2 * np.sign(m.dq[:, 1])))
    wider, prior, baseline, own = with_body(fitted, evidence, np.random.default_rng(3))
    wide = as_change(wider, evidence, prior, baseline)
    size, std = abs(fitted.estimate.values[0]), fitted.estimate.std[0]
    now = np.concatenate([rows.reshape(-1, 2) for rows in evidence.weighted(wider.columns)])
    left = np.concatenate([rest.ravel() for rest in evidence.weighted(wider.residual)])
    rows = np.vstack(
        [
            np.column_stack([now[:, 1], now]),  # value before, body, change
            np.column_stack([own, prior.columns, np.zeros(40)]),
            np.diag([1.0 / size, 1.0, 0.0]),
        ]
    )
    aim = np.concatenate([left, prior.residual, np.zeros(3)])
    moved = np.linalg.lstsq(rows, aim, rcond=None)[0][2]
    np.testing.assert_array_equal(wide.estimate.values, fitted.estimate.values)
    assert abs(moved) > std
    assert wide.estimate.std[0] == pytest.approx(np.hypot(std, moved), rel=1e-6)


def test_a_value_that_no_data_tell_stays_untold_where_others_are_changes(bench):
    fitted, evidence = coulomb_of(bench, lambda m, tau: on_elbow(0.2 * np.sign(m.dq[:, 1])))
    untold = replace(fitted, estimate=replace(fitted.estimate, covariance=np.array([[np.inf]])))
    wider, prior, baseline, _ = with_body(untold, evidence, np.random.default_rng(3))
    assert as_change(wider, evidence, prior, baseline).estimate.std[0] == np.inf
