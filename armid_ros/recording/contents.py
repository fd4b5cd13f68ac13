# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a bag has of joints, before one knows which of them to read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.conversion import holds_joint_state
from armid_ros.recording.reader import named_joints
from armid_ros.recording.settings import DEFAULT, ReadSettings


@dataclass(frozen=True)
class TopicContent:
    """
    One topic of a bag.

    Attributes
    ----------
    name, type_name : str
        Such as '/joint_states' and 'sensor_msgs/msg/JointState'.
    count : int
        Messages.
    joints : tuple of str
        Joints that its first messages name; empty for other types.

    """

    name: str
    type_name: str
    count: int
    joints: tuple[str, ...] = ()


def bag_contents(path: str | Path, settings: ReadSettings = DEFAULT) -> tuple[TopicContent, ...]:
    """
    Return the topics of a bag, with the joints that those of JointState name.

    Raises
    ------
    RecordingError
        There is no bag that can be read.

    """
    with Bag(path, settings) as bag:
        return tuple(
            TopicContent(
                topic.name,
                topic.type_name,
                topic.count,
                named_joints(bag, topic) if holds_joint_state(topic) else (),
            )
            for topic in bag.topics()
        )
