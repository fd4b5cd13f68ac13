# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Definitions and hashes of ROS 2 message types, found without ROS.

Standard types come from the Jazzy store of rosbags. Other types are given as text, or read from
share/PACKAGE/msg/TYPE.msg below AMENT_PREFIX_PATH and below the prefix of this Python.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
import os
from pathlib import Path
import struct
import sys
from typing import Any

from armid_ros.errors import RecordingError
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_idl, get_types_from_msg, get_typestore, Stores
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

JOINT_STATE = 'sensor_msgs/msg/JointState'
#: Type hash of JointState in ROS 2 (REP-2016); independent of comments in the definition.
JOINT_STATE_HASH = 'RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e'
JOINT_TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
STRING = 'std_msgs/msg/String'
#: Fields of a JointState that have one value per joint.
QUANTITIES = ('position', 'velocity', 'effort')
#: Byte order of a CDR message, by its first two bytes.
BYTE_ORDERS = {b'\x00\x00': '>', b'\x00\x01': '<'}
_BIG, _LITTLE = struct.Struct('>iI').unpack_from, struct.Struct('<iI').unpack_from


@dataclass(frozen=True)
class MessageType:
    """
    Name, definition and hash of a message type, as stored in a bag.

    Attributes
    ----------
    name : str
        Such as 'sensor_msgs/msg/JointState'.
    definition : str
        Definition of the type, followed by the definitions of the types it contains; empty if the
        bag has none.
    encoding : str
        Language of the definition: 'ros2msg', 'ros2idl', or empty.
    type_hash : str
        RIHS01 hash of the type; empty when unknown.

    """

    name: str
    definition: str = ''
    encoding: str = 'ros2msg'
    type_hash: str = ''


def message_type(name: str, definition: str | None = None) -> MessageType:
    """
    Return a message type with its hash and the definitions of all types that it contains.

    Parameters
    ----------
    name : str
        Such as 'sensor_msgs/msg/JointState'.
    definition : str, optional
        Text of the .msg file, alone or followed by its dependencies in the format of rosbag2. By
        default the type is looked up.

    Raises
    ------
    RecordingError
        If the type is not known, or the text is not a message definition.

    """
    store = get_typestore(Stores.ROS2_JAZZY)
    if definition is not None or name not in store.fielddefs:
        store = Typestore()
        _register(store, name, definition)
    text, _ = store.generate_msgdef(name, ros_version=2)
    return MessageType(name, text, 'ros2msg', store.hash_rihs01(name))


@cache
def store_for(described: MessageType) -> Typestore:
    """Return a type store that decodes messages by the message definition in their bag."""
    if not described.definition:
        store = get_typestore(Stores.ROS2_JAZZY)
        if described.name not in store.fielddefs:
            raise RecordingError(
                f'type {described.name}: the bag lacks the definition of this type; record again '
                'with ros2 bag record'
            )
        return store
    store = Typestore()
    if described.encoding == 'ros2idl':
        store.register(get_types_from_idl(described.definition))
    else:
        _register(store, described.name, described.definition)
    return store


def _register(store: Typestore, name: str, definition: str | None) -> None:
    """Add a message type to a type store, and all types that it contains."""
    # the types of the distribution take 0.1 s to load, and few bags lack a definition
    known = {} if definition is not None else get_typestore(Stores.ROS2_JAZZY).fielddefs
    if name in known:
        types = {name: known[name]}
    else:
        text = definition if definition is not None else _installed(name)
        try:
            types = dict(get_types_from_msg(text, name))
        except (TypesysError, ValueError) as error:
            raise RecordingError(f'type {name}: no valid message definition: {error}') from error
        if name not in types:
            raise RecordingError(f'type {name}: the definition defines only {", ".join(types)}')
    store.register(types)
    for _, fields in types.values():
        for _, description in fields:
            field: Any = description
            if field[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                field = field[1][0]  # type of the elements
            if field[0] == Nodetype.NAME and field[1] not in store.fielddefs:
                _register(store, field[1], None)


def _installed(name: str) -> str:
    """Return the text of a .msg file in the sourced ROS workspaces, by its type name."""
    listed = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    prefixes = [prefix for prefix in (*listed, sys.prefix) if prefix]
    package, _, rest = name.partition('/')
    for prefix in prefixes:
        path = Path(prefix, 'share', package, rest + '.msg')
        if path.is_file():
            return path.read_text(encoding='utf-8')
    raise RecordingError(
        f'type {name} is not known: give its definition, or source the workspace of {package}; '
        f'searched in {", ".join(prefixes)}'
    )


def header_stamp(data: bytes) -> int:
    """Return the header stamp of a serialised message [ns]; 0 if the sender did not set it."""
    seconds, nanoseconds = (_LITTLE if data[1] & 1 else _BIG)(data, 4)
    return int(seconds) * 10**9 + int(nanoseconds)


def string_cdr(text: str) -> bytes:
    """Serialise a text as a std_msgs/String message."""
    content = text.encode() + b'\0'
    return b'\x00\x01\x00\x00' + struct.pack('<I', len(content)) + content
