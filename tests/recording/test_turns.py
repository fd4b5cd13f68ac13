# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Angles within one turn become continuous; messages without a time and rubbish are left out."""

from armid_ros.recording import Recording
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.reader import read_recording
from armid_ros.recording.series import unwrapped
import numpy as np
import pytest

from .conftest import messages_of

JOINTS = ('turntable', 'elbow')


def motion(samples=2000):
    t = np.arange(samples) * 0.005
    return t, np.column_stack([2.5 + 1.5 * np.sin(t), 0.5 * np.cos(2.0 * t)])


def as_table(folder, t, q, tau):
    values = np.column_stack([t, q, tau])
    head = 't,' + ','.join(f'{what}_{joint}' for what in ('pos', 'tau') for joint in JOINTS)
    np.savetxt(folder / 'run.csv', values, delimiter=',', header=head, comments='')
    return folder / 'run.csv'


@pytest.mark.parametrize(('lowest', 'degrees'), [(-np.pi, False), (-np.pi, True), (0.0, False)])
def test_a_joint_kept_within_one_turn_is_continuous_and_said_once(lowest, degrees, tmp_path):
    t, q = motion()
    wrapped = q.copy()
    wrapped[:, 0] = (q[:, 0] - lowest) % (2.0 * np.pi) + lowest
    path = as_table(tmp_path, t, np.rad2deg(wrapped) if degrees else wrapped, q)
    read = read_recording(path, joints=JOINTS, columns=ColumnSettings(degrees=degrees))
    off = (read.q[:, 0] - q[:, 0]) / (2.0 * np.pi)
    assert np.ptp(off) < 1e-12 and off[0] == pytest.approx(round(off[0]), abs=1e-9)
    np.testing.assert_allclose(read.q[:, 1], q[:, 1], atol=1e-12)
    jumps = np.abs(np.diff(wrapped[:, 0])).max() > 6.0
    assert read.report.unwrapped == (('turntable',) if jumps else ())
    assert read.report.unharmed
    assert read.report.describe().count('turntable') == jumps


@pytest.mark.parametrize('jump', [3.5, 5.0, 7.5, 12.0])
def test_a_jump_that_is_no_whole_turn_stays(jump):
    _, q = motion()
    q[700:900, 0] += jump
    same, joints = unwrapped(q)
    assert same is q and joints == []


@pytest.mark.parametrize('table', [False, True])
def test_messages_before_the_first_stamp_are_left_out(table, tmp_path, write_bag):
    """Simulation time is zero before /clock, of the driver and of the recorder alike."""
    t, q = motion(4001)
    late = np.arange(4001) >= 150
    if table:
        path = as_table(tmp_path, np.where(late, t + 1.7e9, 0.0), q, q)
    else:
        recording = Recording(joints=JOINTS, t=t, q=q, tau=q)
        stamps = np.where(late, 10**18 + np.round(t * 1e9).astype(np.int64), 0)
        path = write_bag(messages_of(recording, stamps, log=stamps))
    read = read_recording(path, joints=JOINTS)
    assert (len(read), read.report.unstamped, read.clock) == (3851, 150, 'header')
    np.testing.assert_allclose(read.q, q[150:])


@pytest.mark.parametrize('value', [1e300, 1e157, -1e18])
def test_values_beyond_all_quantities_are_no_numbers(value, tmp_path):
    t, q = motion()
    tau = q.copy()
    tau[[3, 70], 1] = value
    read = read_recording(as_table(tmp_path, t, q, tau), joints=JOINTS)
    assert read.report.nan == 2 and 'elbow' in read.report.not_finite[0]
    assert np.abs(read.tau).max() < 10.0
