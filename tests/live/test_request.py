# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A window is diagnosed from when the arm changed on."""

from dataclasses import replace

from armid_ros.diagnosis import known_misfit
from armid_ros.identification.online.onset import onset
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import Motion
from armid_ros.nodes.live import DiagnosisRequest
from armid_ros.nodes.live.request import answer, WAITING
import numpy as np
import pytest


def test_what_changed_is_named_from_what_came_since(answered):
    _, said = answered
    assert said.named[0] == ('viscous_friction', ('elbow_pitch',))
    assert abs(said.findings[0].values[0] - 0.3) < 0.05
    assert 11.0 < said.window.duration < 13.0
    elbow = said.arm.robot.index('elbow_pitch')
    assert said.gap.after[elbow] < said.gap.before[elbow]


def test_a_healthy_arm_is_consistent(known_arm, healthy):
    said, _ = answer(DiagnosisRequest(known_arm, healthy))
    assert (said.verdict, said.named) == ('consistent', ())
    assert said.arm is known_arm


@pytest.mark.long
def test_a_gap_is_told_from_the_misfit_that_was_learned(known_arm, healthy, changed):
    learned = (known_arm, healthy)
    said, found = answer(DiagnosisRequest(known_arm, changed, healthy=learned))
    assert said.named[0] == ('viscous_friction', ('elbow_pitch',))
    assert 'misfit' in found.baseline
    assert answer(DiagnosisRequest(known_arm, healthy, healthy=learned))[0].verdict == 'consistent'


def test_too_little_motion_since_a_change_waits_for_more(known_arm, changed):
    early = changed.select(changed.t < 13.0)
    said, diagnosis = answer(DiagnosisRequest(known_arm, early))
    assert (said.verdict, diagnosis) == (WAITING, None)


def test_a_window_that_cannot_be_diagnosed_is_bad_data(known_arm, healthy):
    still = type(healthy)(
        joints=healthy.joints, t=healthy.t, q=np.ones_like(healthy.q) * healthy.q[0],
        dq=np.zeros_like(healthy.q), tau=healthy.tau, source='still',
    )  # fmt: skip
    said, _ = answer(DiagnosisRequest(known_arm, still))
    assert said.verdict == 'bad_data'
    assert said.summary


def test_the_misfit_of_a_right_model_is_the_noise_of_the_torque_in_a_band(known_arm, healthy):
    """White noise of 0.05 N m at 200 Hz; each decimation passes 0.4 of the new rate."""
    for decimation in (4, 8, 16):
        misfit = known_misfit(known_arm, [], Conditioning(200.0, 12.0, decimation), [healthy])
        noise = 0.05 * np.sqrt(2.0 * 0.4 / decimation)
        assert set(misfit.rms) == set(healthy.joints)
        np.testing.assert_allclose(list(misfit.rms.values()), noise, rtol=0.35)


def test_what_friction_holds_at_rest_is_no_misfit(known_arm, healthy):
    count = 1200
    still = np.repeat(healthy.q[:1], count, axis=0)
    held = known_arm.torque(
        Motion(healthy.joints, np.arange(count) / 200.0, still, 0 * still, 0 * still)
    )
    rested = replace(
        healthy,
        t=np.r_[np.arange(count) / 200.0, count / 200.0 + healthy.t],
        q=np.vstack([still, healthy.q]),
        dq=np.vstack([0.0 * still, healthy.dq]),
        tau=np.vstack([held + 0.15, healthy.tau]),
    )
    filters = Conditioning(200.0, 12.0, 8)
    moving, both = (known_misfit(known_arm, [], filters, [part]).rms for part in (healthy, rested))
    np.testing.assert_allclose(list(both.values()), list(moving.values()), rtol=0.3)


def test_what_came_before_a_change_is_left_out_and_the_change_itself(known_arm, changed):
    """However long ago it was: a window is seldom cut where blocks begin."""
    for end in (8.6, 9.3, 12.2, 17.9):
        assert onset(known_arm, changed.select(changed.t < end)) >= 8.0
    assert onset(known_arm, changed) < 9.0
