# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of two days of real machines are read as their authors describe them."""

from collections.abc import Sequence

from armid_ros.recording import Recording
import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from benchmarks.real_days import DAYS, pushes
from tests.hidden.lived.chain import Chain

pytestmark = [pytest.mark.real_data, pytest.mark.slow]


def fit(chain: Chain, recordings: Sequence[Recording]) -> tuple[np.ndarray, np.ndarray]:
    """Fit bodies, dry and viscous friction at 6 Hz; the dry friction, and R2 of the joints."""
    rows, torques = [], []
    for recording in recordings:
        t = np.arange(0.0, recording.t[-1], 4e-3)
        low = butter(4, 6.0, fs=250.0, output='sos')
        q, tau = (
            sosfiltfilt(low, [np.interp(t, recording.t, c) for c in x.T], axis=1).T
            for x in (recording.q, recording.tau)
        )
        dq = np.gradient(q, 4e-3, axis=0)
        sign = sosfiltfilt(low, np.tanh(dq / 0.1), axis=0)
        ddq = np.gradient(dq, 4e-3, axis=0)
        keep = slice(50, -50, 5)
        one = np.eye(chain.n_joints)
        friction = [x[keep, :, np.newaxis] * one for x in (sign, dq, np.ones_like(q))]
        columns = chain.columns(q[keep], dq[keep], ddq[keep])
        rows.append(np.concatenate([columns, *friction], axis=2))
        torques.append(tau[keep])
    tau = np.concatenate(torques)
    design = np.concatenate(rows).reshape(tau.size, -1)
    size = np.linalg.norm(design, axis=0) + 1e-9
    values = np.linalg.lstsq(design / size, tau.ravel(), rcond=1e-4)[0] / size
    left = tau - (design @ values).reshape(tau.shape)
    n = chain.n_joints
    return values[10 * n : 11 * n], 1.0 - (left**2).sum(axis=0) / (tau**2).sum(axis=0)


@pytest.mark.parametrize('name', DAYS)
def test_every_question_has_recordings_of_two_days(name, real_data, tmp_path):
    days = DAYS[name](real_data, tmp_path)
    assert days.day_1
    assert days.day_2
    for recording in (*days.day_1, *days.day_2, *days.held_out):
        assert recording.joints == days.robot.joints
        assert recording.t[0] == 0.0
        assert np.all(np.diff(recording.t) > 0.0)
        assert np.all(np.isfinite(recording.tau))
        assert recording.t[-1] > 3.0


def test_friction_of_the_double_pendulum_doubles_from_build_to_build(real_data, tmp_path):
    days = DAYS['builds'](real_data, tmp_path)
    chain = Chain.of(days.robot)
    before, fitted = fit(chain, days.day_1)
    after, again = fit(chain, [*days.day_2, *days.held_out])
    assert np.all(fitted > [0.7, 0.9])
    assert np.all(again > [0.7, 0.9])
    assert np.all(after / before > 1.6)
    np.testing.assert_allclose(before, [0.1, 0.08], atol=0.03)


def test_pushes_are_in_what_was_measured_and_not_in_what_was_commanded(real_data, tmp_path):
    commanded = pushes(real_data, tmp_path)
    measured = pushes(real_data, tmp_path, 'tau_meas')
    assert commanded.push is not None
    assert measured.push is None
    outside = measured.day_2[0].tau - commanded.day_2[0].tau
    for joint in range(2):
        push = commanded.push[:, joint]
        assert 0.2 < np.abs(push).max() < 0.8
        assert np.corrcoef(push, outside[:, joint])[0, 1] > 0.4


def test_a_bob_of_another_mass_hangs_at_the_same_length(real_data, tmp_path):
    """With the friction that is known: the torque of the swing-up is collinear with it."""
    days = DAYS['payload'](real_data, tmp_path)
    moments = []
    for recording in (days.day_1[0], days.day_2[0]):
        rate = (len(recording.t) - 1) / recording.t[-1]
        low = butter(4, 6.0, fs=rate, output='sos')
        q, dq, tau = (
            sosfiltfilt(low, x[:, 0]) for x in (recording.q, recording.dq, recording.tau)
        )
        fast = np.abs(dq) > 0.5
        columns = np.column_stack([tau - 0.14 * np.tanh(dq / 0.1), -np.sin(q)])[fast]
        per_inertia, gravity = np.linalg.lstsq(columns, np.gradient(dq)[fast] * rate)[0]
        moments.append([1.0 / per_inertia, gravity / per_inertia])
    (inertia, weight), (inertia_1, weight_1) = moments
    assert weight_1 / weight == pytest.approx(2.07, rel=0.1)
    assert weight_1 / inertia_1 == pytest.approx(weight / inertia, rel=0.05)
