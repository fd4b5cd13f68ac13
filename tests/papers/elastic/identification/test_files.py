# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Experiments survive the way through a bag, accelerometers and all."""

from __future__ import annotations

from armid_ros.errors import RecordingError
from armid_ros.papers.elastic.identification.files import Accelerometers, read_runs
from armid_ros.recording import BagWriter, read_recording, write_joint_states
from armid_ros.recording.elastic import read_accelerations, write_accelerations, write_runs
from armid_ros.robots import load_robot
import numpy as np
import pytest
from rosbags.typesys import get_typestore, Stores

from tests.recording.conftest import iter_raw

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


def test_the_bag_is_a_recording_like_any_other(bag, clean_steps) -> None:
    recording = read_recording(bag, joints=ROBOT.joints, topic='/joint_states')
    assert len(recording) == sum(len(run.motor) for run in clean_steps)
    assert len(recording.report.gaps) == len(clean_steps) - 1


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


def test_imu_messages_are_what_ros_reads(tmp_path) -> None:
    acceleration = np.arange(12.0).reshape(4, 3)
    with BagWriter(tmp_path / 'imu') as writer:
        write_accelerations(writer, '/imu', 'a_link', [1, 10**9, 2 * 10**9, 3], acceleration)
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = [
        store.deserialize_cdr(m.cdr, 'sensor_msgs/msg/Imu') for m in iter_raw(tmp_path / 'imu')
    ]
    found = np.array(
        [
            [m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z]
            for m in messages
        ]
    )
    np.testing.assert_array_equal(np.sort(found, axis=0), acceleration)
    assert {m.header.frame_id for m in messages} == {'a_link'}
    assert {m.orientation_covariance[0] for m in messages} == {-1.0}
    assert {m.angular_velocity_covariance[0] for m in messages} == {-1.0}
    stamps, again = read_accelerations(tmp_path / 'imu', '/imu')
    np.testing.assert_array_equal(stamps, [1, 10**9, 2 * 10**9, 3])
    np.testing.assert_array_equal(again, acceleration)


def test_a_missing_accelerometer_is_named(tmp_path, clean_steps) -> None:
    link = clean_steps[0].link
    stamps = 10**9 + np.arange(len(link)) * 10**6
    with BagWriter(tmp_path / 'bag') as writer:
        for topic in ('/motor/joint_states', '/link/joint_states', '/reference/joint_states'):
            write_joint_states(writer, topic, ROBOT.joints, stamps, link.q, link.dq)
    with pytest.raises(RecordingError, match='/link1/imu'):
        read_runs(tmp_path / 'bag', ROBOT, SENSORS)
