# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid elastic`, from simulated bags to parameters."""

from dataclasses import replace
import json

from armid_ros.papers.elastic.identification.files import read_runs
from armid_ros.recording.elastic import write_runs
from armid_ros.robots import load_robot
from armid_ros.simulation.sensors import accelerometer_readings
import numpy as np
import pytest

from docsite.schemas import faults
from tests.cli.conftest import armid

pytestmark = pytest.mark.slow


def read(folder):
    """Return the document in a folder, and its two spring stiffnesses [N m/rad]."""
    document = json.loads((folder / 'elastic.json').read_text())
    assert faults('elastic', document) == []
    return document, [row['value'] for row in document['parameters'] if row['name'] == 'kg']


def test_experiments_without_steps_leave_out_the_tuning(runs, truth, tmp_path) -> None:
    robot = load_robot('two_link_elastic')
    places = np.outer([0.4, 0.4], [1.0, 0.0, 0.0])
    runs = [replace(x, felt=accelerometer_readings(robot, x.link, places)) for x in runs[:4]]
    write_runs(tmp_path / 'resonances', runs, robot)
    said = armid('elastic', tmp_path / 'resonances', '--out', tmp_path / 'out').stdout
    assert 'antiresonance' in said
    document, stiffness = read(tmp_path / 'out')
    assert 'tuning' not in document
    assert stiffness == pytest.approx(truth.stiffness.tolist(), rel=0.02)


@pytest.mark.parametrize(
    'arguments, message',
    [
        ([], 'no bag'),
        (['missing'], 'no bag or file'),
        (['x', '--robot', 'humanoid_arm'], 'no bag or file'),
        (['--demo', '--robot', 'humanoid_arm'], 'each joint of this arm'),
        (['x', '--model', 'model.yaml'], '--model'),
        (['x', '--gear', '50'], '--gear'),
    ],
)
def test_bad_input_is_said(arguments, message, tmp_path) -> None:
    assert message in armid('elastic', *arguments, '--out', tmp_path / 'out', code=2).stderr


@pytest.mark.parametrize(('kind', 'experiments'), [('multisine', 1), ('steps', 2)])
def test_what_shows_springs_is_followed_by_the_elastic_arm(tmp_path, kind, experiments):
    robot, plan, run = load_robot('two_link_elastic'), tmp_path / 'plan', tmp_path / 'run'
    options = '--robot', robot.name, '--kind', kind, '--duration', 7, '--seed', 1
    armid('excite', *options, '--out', plan)
    armid('simulate', '--robot', robot.name, '--trajectory', plan / 'trajectory', '--out', run)
    runs = read_runs(run, robot, [0.4, 0.4])
    assert len(runs) == experiments
    if kind == 'multisine':
        assert np.all(runs[0].motor.tau.std(axis=0) > 0.05 * robot.torque_limit)
