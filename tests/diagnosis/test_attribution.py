# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What data that a name was not fitted to say of it: they show it, deny it, or are silent."""

from dataclasses import replace

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.verdict.attribution import attribute, Attribution
import numpy as np
import pytest

from tests.diagnosis.test_floor import cut


def spring(motion, tau):
    """Return the torque of a spring of 1.5 N m/rad in the elbow."""
    return np.column_stack([np.zeros(len(motion.t)), 1.5 * motion.q[:, 1]])


def evidence_of(bench, hidden):
    """Return other recordings in the unit of their noise."""
    data = cut(bench.recordings(hidden, seed=7))
    sigma = tuple(noise_floor(part, bench.arm).sigma for part in data)
    return Evidence.over_noise(data, sigma)


@pytest.fixture(scope='module')
def sprung(bench):
    """Return what explains recordings of an arm with a spring in its elbow."""
    rng = np.random.default_rng(0)
    found = diagnose(bench.arm, bench.recordings(spring), rng=rng).explanation
    assert [step.trial.effect.name for step in found.steps] == ['joint_spring']
    return found


def with_shoulder_off(explanation):
    """Return an explanation whose fit has changed friction of the shoulder as well."""
    arm = explanation.fitted.arm
    names = [(p.name, p.joint) for p in arm.parameters]
    theta = arm.theta.copy()
    theta[names.index(('coulomb_torque', 'shoulder'))] += 2.0
    return replace(explanation, fitted=replace(explanation.fitted, arm=arm.with_theta(theta)))


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


def test_data_with_a_cause_show_it_and_data_without_deny_it(bench, sprung):
    shown = attribute(sprung, evidence_of(bench, spring))
    assert shown.denied == ()
    assert shown.share([0]) > 0.95
    assert attribute(sprung, evidence_of(bench, None)).denied == (0,)


def test_a_cause_is_denied_only_where_it_acts(bench, sprung):
    """A body that is fitted with a spring may predict another joint worse."""
    off = with_shoulder_off(sprung)
    shown = attribute(off, evidence_of(bench, spring))
    assert shown.denied == ()
    assert shown.share([0]) < 0.0
    assert attribute(off, evidence_of(bench, None)).denied == (0,)
