# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A real robot's bag: UR10, Humble, SQLite, without metadata."""

from armid_ros.recording import read_recording, read_robot_description, topics
import numpy as np
import pytest

JOINTS = (
    'shoulder_pan_joint',
    'shoulder_lift_joint',
    'elbow_joint',
    'wrist_1_joint',
    'wrist_2_joint',
    'wrist_3_joint',
)


@pytest.mark.real_data
def test_the_ur10_bag_is_read_whole(real_data):
    bag = real_data / 'ur10_ros2bag' / 'ur10_exciting_trajectory.db3'
    recording = read_recording(bag, joints=JOINTS)
    assert len(recording) == recording.report.messages == 3441
    assert recording.report.clean
    assert recording.topic == '/joint_states'
    assert recording.duration == pytest.approx(27.52, abs=1e-6)
    np.testing.assert_allclose(np.diff(recording.t), 1 / 125, atol=1e-6)
    # The velocities are those of the positions.
    moved = np.cumsum(recording.dq[:-1] * np.diff(recording.t)[:, None], axis=0)
    np.testing.assert_allclose(moved, recording.q[1:] - recording.q[0], atol=0.05)
    # Torques of a UR10, gravity on the shoulder lift most of all.
    peaks = abs(recording.tau).max(axis=0)
    assert (peaks < 330).all()
    assert peaks.argmax() == 1
    (topic,) = topics(bag)
    assert (topic.name, topic.count) == ('/joint_states', 3441)
    assert read_robot_description(bag) is None
