# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Experiments survive the way through a bag, accelerometers and all."""

from dataclasses import replace

from armid_ros.errors import RecordingError
from armid_ros.papers.elastic.identification.files import read_runs
from armid_ros.recording import BagWriter, write_joint_states
from armid_ros.recording.elastic import write_runs
from armid_ros.robots import load_robot
from armid_ros.simulation.sensors import accelerometer_readings
import numpy as np
import pytest

ROBOT = load_robot('two_link_elastic')
RADIUS = [0.4, 0.3]


@pytest.fixture
def bag(tmp_path, clean_steps):
    """Write the steps to a bag."""
    places = np.outer(RADIUS, [1.0, 0.0, 0.0])
    runs = [
        replace(run, felt=accelerometer_readings(ROBOT, run.link, places)) for run in clean_steps
    ]
    write_runs(tmp_path / 'steps', runs, ROBOT)
    return tmp_path / 'steps'


def test_runs_come_back(bag, clean_steps) -> None:
    found = read_runs(bag, ROBOT, RADIUS)
    assert len(found) == len(clean_steps)
    for ours, whole in zip(found, clean_steps, strict=True):
        moving = slice(int(np.argmax(whole.reference.any(axis=1))), None)
        motor, link = whole.motor.select(moving), whole.link.select(moving)
        np.testing.assert_allclose(ours.motor.t, motor.t - motor.t[0], atol=1e-9)
        for name in ('q', 'dq', 'tau'):
            np.testing.assert_array_equal(getattr(ours.motor, name), getattr(motor, name))
        np.testing.assert_array_equal(ours.link.q, link.q)
        np.testing.assert_array_equal(ours.reference, whole.reference[moving])
        np.testing.assert_allclose(ours.link.ddq, link.ddq, atol=1e-9)


def test_a_missing_accelerometer_is_named(tmp_path, clean_steps) -> None:
    link = clean_steps[0].link
    stamps = 10**9 + np.arange(len(link)) * 10**6
    with BagWriter(tmp_path / 'bag') as writer:
        for topic in ('/motor/joint_states', '/link/joint_states', '/reference/joint_states'):
            write_joint_states(writer, topic, ROBOT.joints, stamps, link.q, link.dq)
    with pytest.raises(RecordingError, match='/link1/imu'):
        read_runs(tmp_path / 'bag', ROBOT, RADIUS)
