# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The two-link arm sample by sample: MuJoCo's motion, noisy sensors."""

from __future__ import annotations

from armid_ros.papers.elastic.identification.live import OnlineTwoInertia, TwoLinkSample
import numpy as np
import pytest

#: alpha, beta, gamma, rotors and stiffnesses are told well; friction and damping less.
MAIN = slice(0, 7)


def samples(run):
    motor, link = run.motor, run.link
    return map(TwoLinkSample, motor.q, motor.dq, motor.tau, link.q, link.dq, link.ddq)


@pytest.fixture(scope='module')
def true(truth):
    return np.array(
        [
            truth.alpha,
            truth.beta,
            truth.gamma,
            *truth.rotor,
            *truth.stiffness,
            *truth.link_damping,
            *truth.joint_motor_damping,
            *truth.spring_damping,
            *truth.joint_coulomb,
        ]
    )


def test_two_seconds_tell_inertias_and_springs(runs, true) -> None:
    live = OnlineTwoInertia(runs[0].motor.joints)
    for sample in list(samples(runs[0]))[:2000]:
        live.take(sample)
    found = live.estimate
    np.testing.assert_allclose(found.values[MAIN], true[MAIN], rtol=0.01)
    off = np.abs(found.values - true) / found.std
    assert np.sqrt(np.mean(off**2)) < 2.5


def test_nothing_is_learned_across_an_interruption(runs) -> None:
    """Two stretches far apart: without the word of it, the jump would be an acceleration."""
    live = OnlineTwoInertia(runs[0].motor.joints)
    first, second = list(samples(runs[0]))[:500], list(samples(runs[1]))[1000:1500]
    for sample in first:
        live.take(sample)
    before = live.estimate.values
    live.interrupt()
    assert not live.take(second[0])
    np.testing.assert_array_equal(live.estimate.values, before)
