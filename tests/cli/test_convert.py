# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A table becomes a bag, or is identified as it is; guesses are shown first."""

from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest

from .conftest import armid, ROBOT


@pytest.fixture(scope='module')
def recording(bags):
    """Return what the first bag holds."""
    return read_recording(bags[0], joints=load_robot(ROBOT).joints)


@pytest.fixture
def csv(recording, tmp_path):
    """Write it as a table, in degrees, with currents of 50 mN m/A."""
    names = [f'{name}{k}' for name in ('pos', 'current') for k in range(1, 7)]
    values = [recording.t, np.degrees(recording.q), recording.tau / 0.05]
    head = ','.join(['time', *names])
    path = tmp_path / 'run.csv'
    np.savetxt(path, np.column_stack(values), delimiter=',', header=head, comments='')
    return path


def test_a_dry_run_shows_and_writes_nothing(csv, tmp_path):
    text = armid('convert', csv, '--robot', ROBOT, '--dry-run', '--out', tmp_path / 'bag').stdout
    words = ' '.join(text.split())
    assert "'current{}'" in words and '--current-gain' in words and '--degrees' in words
    assert not (tmp_path / 'bag').exists()
    assert all(len(line) <= 80 for line in text.splitlines()[1:-1])


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('{csv}', '--robot', ROBOT, '--effort', 'torque{}'), "'torque{}'"),
        (('{csv}', '--rename', 'fer'), "--rename 'fer'"),
        (('{csv}', '--rename', 'a=b', 'c=d'), "--rename 'a:b'"),
        (('{csv}', '--gear', '3', '--coupling', '5'), 'MOTOR,JOINT'),
        (('{csv}', '{bag}'), 'tables'),
        (('{bag}',), 'ROS 2'),
        (('{bag}', '--rename', 'a:b'), '--rename'),
        (('{bag}', '--rename', 'a:b', '--degrees'), '--degrees'),
        (('{csv}', '--episode', '1', '--position', 'x'), "'x'"),
    ],
)
def test_what_cannot_be_done_is_said(arguments, message, csv, bags, tmp_path):
    filled = [text.replace('{csv}', str(csv)).replace('{bag}', str(bags[0])) for text in arguments]
    result = armid('convert', *filled, '--out', tmp_path / 'bag', code=2)
    assert message in result.stderr
    assert result.stderr.count('\n') == 1


def test_a_table_has_no_description_and_that_is_said(csv, tmp_path):
    error = armid('identify', csv, '--robot', '-', '--out', tmp_path / 'o', code=2).stderr
    assert '/robot_description' in error and '--robot' in error
