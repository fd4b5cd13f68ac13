# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories, runs and their files."""

import csv
from dataclasses import replace

from armid_ros.errors import TrajectoryError
from armid_ros.excitation import Excitation, FourierTrajectory, load_excitation, save_excitation
import numpy as np
import pytest


@pytest.fixture
def trajectory():
    rng = np.random.default_rng(7)
    return FourierTrajectory(
        ('a', 'b'), 10.0, rng.normal(size=2), rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
    )


def test_trajectory_is_periodic_within_its_bounds_and_may_be_shifted_and_stretched(trajectory):
    motion = trajectory.one_period(2000)
    np.testing.assert_allclose(motion.q.mean(axis=0), trajectory.q0, atol=1e-12)
    assert np.all(np.abs(motion.ddq) <= trajectory.acceleration_bound())
    again = trajectory.motion(motion.t + 10.0)
    later, moved = trajectory.shifted(1.3).motion(motion.t), trajectory.motion(motion.t + 1.3)
    slow = trajectory.stretched(25.0).motion(2.5 * motion.t)
    for one, other in (again.q, motion.q), (later.q, moved.q), (later.ddq, moved.ddq):
        np.testing.assert_allclose(one, other, atol=1e-12)
    np.testing.assert_allclose(slow.q, motion.q, atol=1e-12)
    np.testing.assert_allclose(slow.dq, motion.dq / 2.5, atol=1e-12)


def test_velocity_and_acceleration_are_the_derivatives_of_position(trajectory):
    motion = Excitation(trajectory, 2, 2.0).motion(1000.0)
    inner = slice(2, -2)
    dq = np.gradient(motion.q, motion.t, axis=0)
    ddq = np.gradient(motion.dq, motion.t, axis=0)
    np.testing.assert_allclose(dq[inner], motion.dq[inner], atol=2e-5)
    np.testing.assert_allclose(ddq[inner], motion.ddq[inner], atol=5e-4)


def test_run_along_the_orbit_visits_no_new_pose(trajectory):
    run = Excitation(trajectory, 1, 2.0).motion(50.0).q
    orbit = trajectory.one_period(4000).q
    nearest = [np.abs(orbit - q).max(axis=1).min() for q in run]
    assert max(nearest) < 0.01


def test_rate_that_does_not_fit_the_period_is_refused_with_one_that_does(trajectory):
    with pytest.raises(TrajectoryError, match=r'0\.3 Hz'):
        Excitation(trajectory).motion(0.33)


def test_file_holds_the_run_to_the_last_bit(trajectory, tmp_path):
    run = Excitation(trajectory, 3, 1.5)
    save_excitation(run, tmp_path / 'run.yaml')
    back = load_excitation(tmp_path / 'run.yaml')
    motion, read = run.motion(10.0), back.motion(10.0)
    assert back.joints == run.joints
    np.testing.assert_array_equal(read.q, motion.q)
    np.testing.assert_array_equal(read.ddq, motion.ddq)


@pytest.mark.parametrize('first', ["=cmd|'/C calc'!A0", '+a', '-a', '@a', '#a', "'a", 'a,"b"'])
def test_a_name_is_no_formula_of_a_spreadsheet(trajectory, first, tmp_path):
    joints = (first, *trajectory.joints[1:])
    save_excitation(Excitation(replace(trajectory, joints=joints)), tmp_path / 'run.csv')
    with open(tmp_path / 'run.csv', newline='') as stream:
        cells = [row[0] for row in csv.reader(stream) if not row[0].startswith('# ')]
    assert not cells[1].startswith(('=', '+', '-', '@', '#'))


@pytest.mark.parametrize(
    ('name', 'text', 'message'),
    [
        ('run.yaml', 'a: 1', 'armid/excitation/1'),
        ('run.yaml', 'schema: armid/excitation/1\nperiod: 3', 'joints'),
        ('run.txt', '', '.yaml'),
    ],
)
def test_bad_file_is_refused_with_its_name(name, text, message, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(TrajectoryError, match=message) as error:
        load_excitation(path)
    assert name in str(error.value)


def test_coefficients_that_are_no_numbers_are_refused_with_the_joint():
    with pytest.raises(TrajectoryError, match='elbow'):
        FourierTrajectory(('elbow',), 1.0, np.zeros(1), np.full((1, 2), np.nan), np.zeros((1, 2)))


@pytest.mark.parametrize(
    ('old', 'new', 'message'),
    [
        *(('run_in:', f'start: {start}\nrun_in:', 'start pose') for start in ('[0.5]', '0.5')),
        *(
            ('n_periods: 2', f'n_periods: {number}', r'run\.yaml: .*')
            for number in ('1e12', '10000000000000', '2.5', '.nan', '2001-01-01', '0')
        ),
    ],
)
def test_a_run_from_another_pose_or_of_an_impossible_length_is_refused(
    tmp_path, old, new, message
):
    series = FourierTrajectory(('a',), 4.0, np.zeros(1), np.ones((1, 2)), np.ones((1, 2)))
    path = tmp_path / 'run.yaml'
    save_excitation(Excitation(series, 2, 1.0), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(TrajectoryError, match=message):
        load_excitation(path)
