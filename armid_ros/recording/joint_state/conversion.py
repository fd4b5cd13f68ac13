# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert messages that contain a JointState to CDR of sensor_msgs/JointState."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
import re
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.recording.bag import Bag
from armid_ros.recording.message_types import JOINT_STATE, MessageType, QUANTITIES, store_for
from armid_ros.recording.source import MessageBlock, Topic
import numpy as np
from rosbags.typesys import get_typestore, Stores

_INSIDE = re.compile(r'^\s*sensor_msgs/(?:msg/)?JointState\s+(\w+)', re.MULTILINE)


def holds_joint_state(topic: Topic) -> bool:
    """Return whether the messages of a topic are, or contain, a JointState."""
    return topic.type_name == JOINT_STATE or bool(_inside(topic.message_type))


def is_plain(topic: Topic) -> bool:
    """Return whether the messages of a topic are JointState of ROS 2 in CDR."""
    described = topic.message_type
    return topic.encoding == 'cdr' and described.name == JOINT_STATE and _standard(described)


def joint_state_blocks(bag: Bag, topic: Topic) -> Iterator[MessageBlock]:
    """
    Yield the messages of a topic as JointState in CDR, in the order of storage.

    Raises
    ------
    RecordingError
        If the schema in the bag lacks header, names or positions, or messages are not in CDR.

    """
    convert = _converter(f'{bag.path}: {topic.name}', topic)
    if convert is None:
        yield from bag.blocks(topic.name)
        return
    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    for block in bag.blocks(topic.name):
        messages = []
        for at in range(len(block)):
            try:
                found = convert(block.message(at))
                stamp = found.header.stamp
                header = types['std_msgs/msg/Header'](
                    types['builtin_interfaces/msg/Time'](stamp.sec, stamp.nanosec), ''
                )
                values = [np.array(getattr(found, name, []), np.float64) for name in QUANTITIES]
                state = types[JOINT_STATE](header, list(found.name), *values)
                messages.append(bytes(store.serialize_cdr(state, JOINT_STATE)))
            except Exception:  # the decoder counts it as malformed
                messages.append(bytes(4))
        yield MessageBlock.joined(messages, block.log_time, block.publish_time)


def _converter(where: str, topic: Topic) -> Callable[[bytes], Any] | None:
    """Return a function that decodes a JointState; None if no conversion is needed."""
    described = topic.message_type
    if topic.encoding != 'cdr':
        raise RecordingError(
            f"{where} is serialised as '{topic.encoding}'; CDR of ROS 2 can be read: record it "
            'with ros2 bag record'
        )
    if is_plain(topic):
        return None
    store = store_for(described)
    fields = {name for name, _ in store.fielddefs[JOINT_STATE][1]}
    lacking = {'header', 'name', 'position'} - fields
    if lacking:
        raise RecordingError(
            f'{where}: its schema of {JOINT_STATE} has {", ".join(sorted(fields))}, and no '
            f'{", ".join(sorted(lacking))}; record the type of sensor_msgs'
        )
    if described.name == JOINT_STATE:
        return lambda data: store.deserialize_cdr(data, JOINT_STATE)
    inside = _inside(described)
    return lambda data: getattr(store.deserialize_cdr(data, described.name), inside)


def _inside(described: MessageType) -> str:
    """Return the JointState field of a type, the measured one of several; '' if none."""
    own = described.definition.split('\n===', 1)[0]
    found = _INSIDE.findall(own)
    return next((name for name in found if 'measured' in name), found[0] if found else '')


@cache
def _standard(described: MessageType) -> bool:
    """Return whether a bag defines JointState as ROS 2 does."""
    if not described.definition:
        return True
    standard, store = get_typestore(Stores.ROS2_JAZZY), store_for(described)
    return store.hash_rihs01(JOINT_STATE) == standard.hash_rihs01(JOINT_STATE)
