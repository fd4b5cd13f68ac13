# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""std_msgs/String as CDR, and the robot description that travels in it."""

from __future__ import annotations

from pathlib import Path
import struct

from armid_ros.errors import RecordingError
from armid_ros.recording.bag import Bag
from armid_ros.recording.message_types import BYTE_ORDERS, STRING
from armid_ros.recording.settings import DEFAULT, ReadSettings


def string_cdr(text: str) -> bytes:
    """Serialise a std_msgs/String."""
    content = text.encode() + b'\0'
    return b'\x00\x01\x00\x00' + struct.pack('<I', len(content)) + content


def read_robot_description(path: str | Path, settings: ReadSettings = DEFAULT) -> str | None:
    """
    Return the robot description a bag holds.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory, or a bare file.
    settings : ReadSettings
        Whether checksums are compared, and how much memory to take.

    Returns
    -------
    str or None
        The last one published on a std_msgs/String topic whose name ends in 'robot_description';
        None when there is none.

    Raises
    ------
    RecordingError
        The bag cannot be read, or holds several descriptions on topics of several robots.

    """
    with Bag(path, settings) as bag:
        texts: dict[str, str] = {}
        for topic in bag.topics():
            if topic.type_name != STRING or not topic.name.endswith('robot_description'):
                continue
            for block in bag.blocks(topic.name):
                cdr = block.message(len(block) - 1)
                order = BYTE_ORDERS.get(cdr[:2])
                if order is None or len(cdr) < 8:
                    continue
                (length,) = struct.unpack_from(order + 'I', cdr, 4)
                text = cdr[8 : 8 + length].rstrip(b'\0').decode('utf-8', 'replace')
                if text and length <= len(cdr) - 8:
                    texts[topic.name] = text
    if len(set(texts.values())) > 1:
        raise RecordingError(
            f'{path}: holds the descriptions of several robots ({", ".join(texts)}); '
            'save the one meant as a URDF file'
        )
    return next(iter(texts.values()), None)
