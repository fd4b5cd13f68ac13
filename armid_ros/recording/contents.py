# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a bag has of joints, before one knows which of them to read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.decoder import JointStateDecoder
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.settings import DEFAULT, ReadSettings

#: This many messages tell which joints a topic names.
_PEEK = 1000


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
                _joints(bag, topic.name) if topic.type_name == JOINT_STATE else (),
            )
            for topic in bag.topics()
        )


def _joints(bag: Bag, name: str) -> tuple[str, ...]:
    decoder = JointStateDecoder(())
    for block in bag.blocks(name):
        for _ in decoder.decode(block):
            pass
        if decoder.messages >= _PEEK:
            break
    return decoder.names_seen
