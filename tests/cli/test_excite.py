# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A plan begins where the arm stands, stays above its floor, and says what was not checked."""

import json
import shutil

import armid_ros.api.excitation as excitation_files
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import load_excitation
from armid_ros.excitation.geometry.floor import lowest_point
from armid_ros.motion import Motion
from armid_ros.recording import read_recording, read_waypoints
from armid_ros.robots import collision_model, load_robot
import numpy as np
import pytest

from tests.serial_arm import serial_arm

from .conftest import armid, DURATION, RATE, ROBOT

pytestmark = pytest.mark.slow

QUICK = ('--duration', 8, '--starts', 1, '--iterations', 3)
Z = np.array([0.0, 0.0, 1.0])


def excite(robot, out, *options, code=0):
    return armid('excite', '--robot', robot, *QUICK, *options, '--out', out, code=code)


def plan_of(robot, out):
    read = read_waypoints(out / 'trajectory', load_robot(robot).joints)
    return Motion(read.joints, read.t, read.q, read.dq, read.ddq, read.tau)


def test_an_arm_that_stands_stays_above_its_base_plane(example_robot, tmp_path):
    name, out = example_robot('ur5_robot.urdf'), tmp_path / 'plan'
    said = excite(name, out, '--seed', 2).stdout
    lowest = lowest_point(collision_model(load_robot(name)), Z, plan_of(name, out))
    assert lowest.height > 0.0099
    assert f'{lowest.height:.3f} m' in said and f'({lowest.link})' in said
    document = json.loads((out / 'excitation.json').read_text())
    assert document['floor'] == {'height': 0.0, 'source': 'base plane'}
    assert document['lowest_point']['height'] == pytest.approx(lowest.height, abs=1e-9)
    assert document['not_checked'] == [] and document['verdict'] in said.lower()


def test_the_design_is_kept_where_no_way_leads_to_it(tmp_path, monkeypatch):
    def nothing(*_, **__):
        raise TrajectoryError('walled in')

    monkeypatch.setattr(excitation_files, 'plan_run', nothing)
    refused = excite(ROBOT, tmp_path / 'plan', code=2).stderr
    assert 'excitation.yaml' in refused and 'walled in' in refused
    assert load_excitation(tmp_path / 'plan' / 'excitation.yaml').n_periods == 2


def test_a_recording_where_the_trajectory_goes_is_not_replaced(tmp_path, bags):
    out = tmp_path / 'plan'
    shutil.copytree(bags[0], out / 'trajectory')
    refused = excite(ROBOT, out, '--force', code=2).stderr
    assert str(out / 'trajectory') in refused and '--out' in refused
    assert (
        len(read_recording(out / 'trajectory', joints=load_robot(ROBOT).joints)) == DURATION * RATE
    )


@pytest.mark.parametrize(
    ('kind', 'criterion'),
    [('continuous', 'D'), ('prismatic', 'condition'), ('revolute', 'T')],
)
@pytest.mark.filterwarnings('error')
def test_an_arm_of_one_joint_is_excited(tmp_path, kind, criterion):
    urdf = tmp_path / 'hinge.urdf'
    urdf.write_text(serial_arm(f'hinge {kind} 0,1,0 0,0,0.5', centre='0.1 0 0.4'))
    options = ('--criterion', criterion)
    if criterion == 'T':
        size = ('--effect', 'quadratic_friction:quadratic_coefficient=0.05')
        options += (*size, '--effects', '', '--rival', 'viscous_friction,coulomb_friction')
    excite(urdf, tmp_path / 'plan', *options)
    motion = plan_of(urdf, tmp_path / 'plan')
    assert np.ptp(motion.q) > 0.05
    assert (tmp_path / 'plan' / 'report.html').is_file()


def test_a_report_that_fails_costs_nothing_else(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError('no picture')

    monkeypatch.setattr('armid_ros.api.excitation.excitation_report', fail)
    start = [0.3, -0.2, 0.1, 0.5, 0.0, 0.0]
    result = excite(ROBOT, tmp_path / 'plan', '--start', ','.join(map(str, start)))
    np.testing.assert_allclose(
        plan_of(ROBOT, tmp_path / 'plan').q[[0, -1]], 2 * [start], atol=1e-9
    )
    assert 'report.html' in result.stderr and 'no picture' in result.stderr
    for name in ('excitation.yaml', 'excitation.csv', 'excitation.json', 'trajectory'):
        assert (tmp_path / 'plan' / name).exists()
