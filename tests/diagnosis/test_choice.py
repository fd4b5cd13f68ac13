# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which causes stay beside a correction of the description."""

from types import SimpleNamespace

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.choice import (
    _as_good,
    _beside_a_correction,
    _noise_within,
    _stands,
)
from armid_ros.diagnosis.search.explanation import at_floor
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest


def explanation(bench, *names, rivals=(), shown=()):
    """Return an explanation by names in the elbow, with rivals of the first, of what is shown."""

    def trial(name):
        effect = CATALOGUE[name].on(bench.robot, ('elbow',))
        candidate = Candidate(effect, slice(0, 1), (0,), bench.robot)
        told = {'values': np.array([1.0]), 'deviation': np.array([0.1])}
        return SimpleNamespace(candidate=candidate, freedom=1.0, **told)

    steps = [SimpleNamespace(trial=trial(name), rivals=[]) for name in names]
    if steps:
        steps[0].rivals = [trial(name) for name in rivals]
    survey = SimpleNamespace(ranking=[trial(name) for name in shown])
    return SimpleNamespace(steps=steps, given=bench.arm, base=None, survey=survey)


def test_a_cause_that_a_full_correction_explains_does_not_stand(bench):
    first = explanation(bench, 'link_inertia', 'joint_spring')
    assert _beside_a_correction(first)
    assert not _stands(first, explanation(bench))
    assert not _stands(first, explanation(bench, 'torque_offset'))


def test_a_cause_beside_a_full_correction_stands(bench):
    first = explanation(bench, 'link_inertia', 'torque_offset', 'link_inertia')
    assert _stands(first, explanation(bench, 'torque_offset'))


def test_one_body_that_changed_stands_in_whatever_order_it_is_found(bench):
    names = ['viscous_friction', 'payload']
    for order in (names, names[::-1]):
        assert _stands(explanation(bench, *order), explanation(bench, 'viscous_friction'))
        assert not _stands(explanation(bench, *order), explanation(bench))


@pytest.mark.parametrize('shown', [(), ('interface_slack',)])
def test_only_what_a_fitted_body_hides_may_be_missing_beside_it(bench, shown):
    first = explanation(bench, 'quadratic_friction', 'interface_slack')
    anew = explanation(bench, 'quadratic_friction', shown=('quadratic_friction', *shown))
    assert _stands(first, anew) == (not shown)


def test_friction_without_values_is_part_of_the_correction(bench):
    first = explanation(bench, 'link_inertia', 'coulomb_friction')
    assert not _stands(first, explanation(bench))
    first.given = bench.named_friction()
    assert _stands(first, explanation(bench))


@pytest.mark.parametrize(
    ('names', 'rivals', 'asked'),
    [
        (('payload', 'torque_offset'), ('link_inertia',), True),
        (('payload', 'torque_offset'), ('encoder_offset',), False),
        (('rotor_inertia', 'torque_offset'), ('link_inertia',), False),
        (('link_inertia',), (), False),
        ((), (), False),
    ],
)
def test_what_may_be_a_correction_is_asked_about(bench, names, rivals, asked):
    assert _beside_a_correction(explanation(bench, *names, rivals=rivals)) == asked


@pytest.mark.parametrize(('recorded', 'wanted'), [(0.01, 1.0), (0.02, 3.0)])
def test_noise_is_no_more_than_a_misfit_or_rough(recorded, wanted):
    """A fault that is as rough as noise would hide itself; fewer samples have more of it."""
    now = SimpleNamespace(
        as_described=(np.array([5.0, 0.1]),),
        floors=(SimpleNamespace(rough=np.array([3.0, 0.2])),),
        data=(SimpleNamespace(period_recorded=recorded),),
    )
    (noise,) = _noise_within(np.array([1.0, 1.0]), now, 0.01)
    assert noise.tolist() == [wanted, 0.1]


@pytest.mark.parametrize('repeats', [True, False])
def test_only_noise_that_is_measured_excuses_what_a_body_fitted_anew_does_not_leave(
    bench, repeats
):
    used = Conditioning(200.0, 20.0, 5)
    data = tuple(trajectories(bench.recordings(), used))
    if not repeats:
        recordings = [one.select(slice(len(one.t) // 2)) for one in bench.recordings()]
        data = tuple(trajectories(recordings, used))
    unit = tuple(np.ones(2) for _ in data)
    evidence = Evidence(data, unit, unit)
    draw = np.random.default_rng(0)
    white = [draw.normal(size=part.torque.shape) for part in data]
    settings = DiagnosisSettings(material=0.0)

    def leaving(share):
        fitted = SimpleNamespace(residual=[share * rows for rows in white])
        return SimpleNamespace(
            evidence=evidence,
            fitted=fitted,
            chi2_per_row=evidence.chi2_per_row(fitted.residual),
            steps=[],
            base=None,
        )

    assert at_floor(leaving(1.0), settings)
    assert _as_good(leaving(1.0), leaving(0.9), settings)
    assert _as_good(leaving(1.0), leaving(0.5), settings) == repeats
