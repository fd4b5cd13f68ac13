# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reference motions in bags."""

from armid_ros.errors import RecordingError
from armid_ros.motion import Motion
from armid_ros.recording import (
    BagWriter,
    read_robot_description,
    read_waypoints,
    topics,
    write_joint_trajectory,
    write_recording,
)
from armid_ros.recording.message_types import JOINT_TRAJECTORY
from armid_ros.recording.trajectory import joint_trajectory_cdr
from armid_ros.robots.reference import Reference
import numpy as np
import pytest
from rosbags.typesys import get_typestore, Stores


@pytest.fixture
def motion():
    """Return a motion of two joints, 201 samples."""
    t = np.linspace(0.0, 2.0, 201)
    phase = np.outer(t, [1.0, 3.0])
    return Motion(('a', 'b'), t, np.sin(phase), np.cos(phase) * [1, 3], -np.sin(phase) * [1, 9])


def test_a_trajectory_is_read_back_exactly_in_the_order_asked(motion, tmp_path):
    write_joint_trajectory(tmp_path / 'bag', motion, robot_description='<robot/>')
    back = read_waypoints(tmp_path / 'bag', ('b', 'a'))
    assert back.joints == ('b', 'a')
    np.testing.assert_allclose(back.t, motion.t, atol=1e-9)
    for quantity in ('q', 'dq', 'ddq'):
        np.testing.assert_array_equal(
            getattr(back, quantity), getattr(motion, quantity)[:, [1, 0]]
        )
    assert back.tau is None
    assert read_robot_description(tmp_path / 'bag') == '<robot/>'
    assert {topic.type_name for topic in topics(tmp_path / 'bag')} >= {JOINT_TRAJECTORY}


def test_efforts_are_written_and_what_is_not_known_is_left_out(motion, tmp_path):
    waypoints = Reference(('a', 'b'), motion.t, motion.q, None, None, 5.0 * motion.q)
    write_joint_trajectory(tmp_path / 'bag', waypoints)
    back = read_waypoints(tmp_path / 'bag', ('b', 'a'))
    assert back.dq is None and back.ddq is None
    np.testing.assert_array_equal(back.tau, 5.0 * motion.q[:, [1, 0]])


def test_the_last_of_several_trajectories_counts(motion, tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/goal', JOINT_TRAJECTORY)
        writer.write('/goal', joint_trajectory_cdr(motion), 1)
        writer.write('/goal', joint_trajectory_cdr(motion.select(slice(0, 50))), 2)
    assert len(read_waypoints(tmp_path / 'bag', ('a', 'b')).t) == 50


def changed(motion, **fields):
    """Return a trajectory message with fields of a point changed."""
    store = get_typestore(Stores.ROS2_JAZZY)
    message = store.deserialize_cdr(joint_trajectory_cdr(motion), JOINT_TRAJECTORY)
    for name, value in fields.items():
        setattr(message.points[7], name, value)
    return bytes(store.serialize_cdr(message, JOINT_TRAJECTORY))


def test_trajectories_that_are_not_valid_are_refused(motion, tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    duration = store.types['builtin_interfaces/msg/Duration']
    still = changed(motion, time_from_start=duration(sec=0, nanosec=0))
    cases = [
        (changed(motion, positions=np.zeros(1)), 'point 7.*1 positions.*2 joint'),
        (still, 'time_from_start.*point 7'),
        (joint_trajectory_cdr(motion.select(slice(0, 1))), 'points'),
        (joint_trajectory_cdr(motion)[:-9], 'decoded'),
        (None, 'messages'),
    ]
    for number, (cdr, fact) in enumerate(cases):
        with BagWriter(tmp_path / f'bag{number}') as writer:
            writer.add_topic('/goal', JOINT_TRAJECTORY)
            if cdr is not None:
                writer.write('/goal', cdr, 1)
        with pytest.raises(RecordingError, match=f'bag{number}: /goal.*{fact}'):
            read_waypoints(tmp_path / f'bag{number}', ('a', 'b'))


def test_a_missing_trajectory_or_joint_is_refused_with_what_there_is(motion, swinging, tmp_path):
    write_joint_trajectory(tmp_path / 'bag', motion)
    with pytest.raises(RecordingError, match=r'c;.*a, b'):
        read_waypoints(tmp_path / 'bag', ('a', 'c'))
    write_recording(tmp_path / 'states', swinging)
    with pytest.raises(RecordingError, match=JOINT_TRAJECTORY):
        read_waypoints(tmp_path / 'states', ('a', 'b'))
