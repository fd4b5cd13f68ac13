# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever fields a driver leaves empty, the bytes that ROS 2 makes are read."""

from itertools import product

from armid_ros.recording.joint_state.layout import JointStateLayout
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState


@pytest.mark.parametrize('frame', ['', 'base', 'world_1'])
def test_any_field_may_be_empty(frame):
    for counts in product([0, 1, 6], repeat=3):
        for length in range(1, 9):
            fields = [[1.5] * count for count in counts]
            message = JointState(
                name=['j' * length], position=fields[0], velocity=fields[1], effort=fields[2]
            )
            message.header.frame_id = frame
            assert JointStateLayout.of(serialize_message(message)).counts == counts
