# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A payload of known mass in one recording fixes the gains of the drives."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import identify, SignalSettings
from armid_ros.identification.known_payload import (
    corrected,
    drive_gains,
    payloads_of,
    with_payload,
)
import numpy as np
import pinocchio as pin
import pytest

from .conftest import multisine, recorded

GAINS = np.array([1.05, 1.08, 1.1, 1.06, 1.09, 1.07])
SIGNALS = SignalSettings()
BAGS = ['a.mcap', 'b.mcap', 'c.mcap']


@pytest.fixture(scope='module')
def ladder(arm):
    """Return recordings with 0, 1.0 and 2.6 kg in the hand, of drives whose gains are too high."""
    link = arm.robot.links[-1]
    recordings = []
    for number, mass in enumerate((0.0, 1.0, 2.6)):
        robot = arm.robot
        if mass:
            payload = pin.Inertia(mass, np.array([0.0, 0.0, -0.05]), np.zeros((3, 3)))
            robot = with_payload(robot, link, payload)
        motion = multisine(robot.joints, 30.0, 200.0, number, amplitude=0.7)
        recording = recorded(
            replace(arm, robot=robot), motion, number, torque_noise=0.05, source=BAGS[number]
        )
        recordings.append(replace(recording, tau=recording.tau * GAINS))
    return recordings


def payloads(arm, recordings):
    link = arm.robot.links[-1]
    texts = [f'b=1.0@{link}:0,0,-0.05', f'c=2.6@{link}:0,0,-0.05']
    return payloads_of(texts, recordings, arm.robot)


def test_gains_come_out_with_their_intervals_and_the_arm_as_it_is(arm, ladder):
    rng = np.random.default_rng(0)
    loaded = payloads(arm, ladder)
    gains = drive_gains(arm, ladder, loaded, SIGNALS, rng)
    sure = np.isfinite(gains.std)
    assert sure.sum() >= 5
    assert np.all(np.abs(gains.values - GAINS)[sure] < 1.5 * gains.half_width[sure])
    assert np.all(gains.std[sure] < 0.02)
    result = identify(arm, corrected(arm, ladder, loaded, gains, SIGNALS), rng=rng)
    motion = multisine(arm.robot.joints, 10.0, 100.0, 9, amplitude=0.7)
    wanted = arm.torque(motion)
    difference = np.linalg.norm(result.arm.torque(motion) - wanted) / np.linalg.norm(wanted)
    blind = identify(arm, ladder[:1], rng=rng).arm.torque(motion)
    assert difference < 0.01 < 0.05 < np.linalg.norm(blind - wanted) / np.linalg.norm(wanted)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(arm, ladder):
    """Over noise of six draws: 95 % of intervals, give or take."""
    inside = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        drawn = [
            replace(one, tau=one.tau + 0.1 * rng.normal(size=one.tau.shape)) for one in ladder
        ]
        gains = drive_gains(arm, drawn, payloads(arm, drawn), SIGNALS, rng)
        sure = np.isfinite(gains.std)
        inside += list((np.abs(gains.values - GAINS) < gains.half_width)[sure])
    assert 0.85 <= np.mean(inside) <= 1.0


def test_without_a_difference_of_payload_nothing_is_determined(arm, ladder):
    with pytest.raises(IdentificationError, match='gain of any drive'):
        drive_gains(arm, ladder[:1], {}, SIGNALS, np.random.default_rng(0))
    loaded = payloads(arm, ladder)
    with pytest.raises(IdentificationError, match='and without'):
        drive_gains(arm, ladder[2:], loaded, SIGNALS, np.random.default_rng(0))


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('b', 'BAG=KG@LINK'),
        ('b=-1@tool0', 'BAG=KG@LINK'),
        ('b=nan@tool0', 'BAG=KG@LINK'),
        ('b=1@tool0:1,2', 'BAG=KG@LINK'),
        ('d=1@tool0', 'a.mcap, b.mcap'),
        ('b=1@nowhere', "'nowhere'.*links are"),
    ],
)
def test_a_payload_that_is_none_is_refused(arm, ladder, text, said):
    with pytest.raises(IdentificationError, match=said):
        payloads_of([text], ladder, arm.robot)
