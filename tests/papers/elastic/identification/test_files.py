# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Experiments survive the way through a bag, accelerometers and all."""

from __future__ import annotations

from armid_ros.errors import RecordingError
from armid_ros.papers.elastic.identification.files import Accelerometers, read_runs
from armid_ros.recording import BagWriter, write_joint_states
from armid_ros.recording.elastic import write_runs
from armid_ros.robots import load_robot
import numpy as np
import pytest

ROBOT = load_robot('two_link_elastic')
SENSORS = Accelerometers.on(ROBOT, [0.4, 0.3])


@pytest.fixture
def bag(tmp_path, clean_steps):
    """Write the steps to a bag."""
    write_runs(tmp_path / 'steps', clean_steps, ROBOT, SENSORS.on_links(ROBOT))
    return tmp_path / 'steps'


def test_runs_come_back(bag, clean_steps) -> None:
    found = read_runs(bag, ROBOT, SENSORS)
    assert len(found) == len(clean_steps)
    for ours, theirs in zip(found, clean_steps, strict=True):
        np.testing.assert_allclose(ours.motor.t, theirs.motor.t, atol=1e-9)
        for name in ('q', 'dq', 'tau'):
            np.testing.assert_array_equal(getattr(ours.motor, name), getattr(theirs.motor, name))
        np.testing.assert_array_equal(ours.link.q, theirs.link.q)
        np.testing.assert_array_equal(ours.reference, theirs.reference)
        np.testing.assert_allclose(ours.link.ddq, theirs.link.ddq, atol=1e-9)


def test_accelerometers_measure_what_geometry_says() -> None:
    """Numerical second derivative of where the sensor is, in the frame of its link."""
    t = np.arange(-2, 3) * 1e-4
    q = np.array([0.4, -0.9]) + np.outer(t, [1.3, -0.7]) + np.outer(t**2 / 2, [5.0, 8.0])
    first, total = q[:, 0], q.sum(axis=1)
    elbow = 0.5 * np.column_stack([np.cos(first), np.sin(first)])
    tip = elbow + 0.3 * np.column_stack([np.cos(total), np.sin(total)])
    world = (tip[1] - 2.0 * tip[2] + tip[3]) / 1e-8
    c, s = np.cos(total[2]), np.sin(total[2])
    from armid_ros.motion import Motion

    link = Motion(
        ROBOT.joints, np.zeros(1), q[2:3], np.array([[1.3, -0.7]]), np.array([[5.0, 8.0]])
    )
    reading = SENSORS.on_links(ROBOT).readings(link)[1][0]
    np.testing.assert_allclose(reading[:2], [[c, s], [-s, c]] @ world, atol=1e-5)


def test_a_missing_accelerometer_is_named(tmp_path, clean_steps) -> None:
    link = clean_steps[0].link
    stamps = 10**9 + np.arange(len(link)) * 10**6
    with BagWriter(tmp_path / 'bag') as writer:
        for topic in ('/motor/joint_states', '/link/joint_states', '/reference/joint_states'):
            write_joint_states(writer, topic, ROBOT.joints, stamps, link.q, link.dq)
    with pytest.raises(RecordingError, match='/link1/imu'):
        read_runs(tmp_path / 'bag', ROBOT, SENSORS)
