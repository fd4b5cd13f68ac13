# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read and write recordings of arms, and the rosbag2 bags that contain them.

This is the only package that depends on file formats. ``read_recording`` reads a bag with
JointState messages, and ``write_recording`` writes one. ``BagWriter`` and ``Bag`` write and read
raw messages for the nodes. ROS is not needed.

"""

from armid_ros.recording.copying import copy_bag
from armid_ros.recording.joint_state.encoder import (
    joint_state_cdr,
    write_joint_states,
    write_recording,
)
from armid_ros.recording.reader import read_recording, read_robot_description, topics
from armid_ros.recording.recording import (
    given_twice,
    ReadReport,
    recorded_together,
    Recording,
    require_once,
)
from armid_ros.recording.source import ReadSettings, Topic
from armid_ros.recording.trajectory import read_waypoints, write_joint_trajectory
from armid_ros.recording.writer import BagWriter

__all__ = [
    'Recording',
    'ReadReport',
    'ReadSettings',
    'recorded_together',
    'given_twice',
    'require_once',
    'read_recording',
    'read_robot_description',
    'write_recording',
    'BagWriter',
    'write_joint_trajectory',
    'read_waypoints',
    'copy_bag',
    'write_joint_states',
    'joint_state_cdr',
    'Topic',
    'topics',
]
