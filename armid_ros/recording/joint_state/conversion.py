# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read JointState messages of a topic, also from inside messages of other types."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
import re

from armid_ros.errors import RecordingError
from armid_ros.recording.bag import Bag
from armid_ros.recording.message_types import JOINT_STATE, JOINT_STATE_HASH, MessageType, store_for
from armid_ros.recording.source import MessageBlock, Topic

_JOINT_STATE_FIELD = re.compile(r'^\s*sensor_msgs/(?:msg/)?JointState\s+(\w+)', re.MULTILINE)


def holds_joint_state(topic: Topic) -> bool:
    """Return whether a topic has JointState messages, or messages with a JointState field."""
    return topic.type_name == JOINT_STATE or bool(_inside(topic.message_type))


def joint_state_blocks(bag: Bag, topic: Topic) -> Iterator[MessageBlock]:
    """
    Yield the messages of a topic, converted to serialised JointState messages.

    Raises
    ------
    RecordingError
        If messages are not in CDR, or the bag defines JointState in another way than ROS 2.

    """
    where = f'{bag.path}: {topic.name}'
    if topic.encoding != 'cdr':
        raise RecordingError(
            f"{where}: the messages are serialised as '{topic.encoding}', but only CDR can be "
            'read; record again with ros2 bag record'
        )
    if not _standard(topic.message_type):
        raise RecordingError(
            f'{where}: the definition of {JOINT_STATE} in the bag differs from that of ROS 2; '
            'record messages of the package sensor_msgs'
        )
    if topic.type_name == JOINT_STATE:
        yield from bag.blocks(topic.name)
        return
    inside, store = _inside(topic.message_type), store_for(topic.message_type)
    for block in bag.blocks(topic.name):
        messages = []
        for at in range(len(block)):
            try:
                state = getattr(bag.decoded(topic, block.message(at)), inside)
                messages.append(bytes(store.serialize_cdr(state, JOINT_STATE)))
            except RecordingError:
                messages.append(bytes(4))  # the decoder counts such messages as malformed
        yield MessageBlock.joined(messages, block.log_time, block.publish_time)


def _inside(described: MessageType) -> str:
    """Return the name of the JointState field of a message type; '' if there is none."""
    own = described.definition.split('\n===', 1)[0]
    found = _JOINT_STATE_FIELD.findall(own)
    return next((name for name in found if 'measured' in name), found[0] if found else '')


@cache
def _standard(described: MessageType) -> bool:
    """Return whether the definition of JointState in a bag equals the definition of ROS 2."""
    stated = described.type_hash if described.name == JOINT_STATE else ''
    if not described.definition or stated == JOINT_STATE_HASH:
        return True
    return bool(store_for(described).hash_rihs01(JOINT_STATE) == JOINT_STATE_HASH)
