# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs found while both move, and slack where there is some."""

from armid_ros.errors import IdentificationError
from armid_ros.papers.exo.plant.leg_pair import leg_pair, stepping, with_noise, with_torques
from armid_ros.papers.exo.springs import OnlineInteraction
import numpy as np
import pytest

NOISE = {'angle_noise': np.radians(0.05), 'torque_noise': 0.5}
SETTINGS = {'memory': 4.0, 'period': 2.0}


def identified(slack: float = 0.0, seconds: float = 4.2) -> OnlineInteraction:
    pair = leg_pair(1e4).with_slack(slack)
    walking = stepping(pair, np.arange(1, 500.0 * seconds) / 500.0)
    exact = with_torques(pair, walking)
    own, other = with_noise(exact, **NOISE, rng=np.random.default_rng(0))
    online = OnlineInteraction(pair, **SETTINGS)
    for t, q, tau, other_q in zip(own.t, own.q, own.tau, other.q, strict=True):
        online.take_other(t, other_q)
        online.take(t, q, tau)
    return online


def test_stiffness_is_found_while_they_walk():
    online = identified()
    assert online.together is not None and online.separate is not None
    assert online.together.stiffness[0] == pytest.approx(1e4, rel=0.01)
    np.testing.assert_allclose(online.separate.stiffness, 1e4, rtol=0.08)
    lower, upper = online.together.interval(0.999)[0]
    assert lower < 1e4 < upper
    assert online.slack is None


def test_slack_is_seen_and_measured():
    """Without it the springs seem a fifth too soft; with it they are what they are."""
    online = identified(slack=0.002)
    assert online.together.stiffness[0] < 0.9e4
    assert online.slack is not None and online.slack.seen
    assert online.slack.value == pytest.approx(0.002, abs=1e-4)
    assert online.slack.interaction.stiffness[0] == pytest.approx(1e4, rel=0.01)


def test_one_machine_alone_is_not_enough():
    pair = leg_pair()
    online = OnlineInteraction(pair, **SETTINGS)
    online.take(0.0, np.zeros(6), np.zeros(6))
    with pytest.raises(IdentificationError, match='joint states'):
        online.take(5.0, np.zeros(6), np.zeros(6))


def test_what_comes_after_an_interruption_is_not_mixed_with_what_was_before():
    online = identified()
    before = online.separate
    online.interrupt()
    for k in range(100):
        online.take_other(10.0 + 0.01 * k, np.zeros(6))
        assert not online.take(10.0 + 0.01 * k, np.zeros(6), np.zeros(6))
    assert online.separate is before
