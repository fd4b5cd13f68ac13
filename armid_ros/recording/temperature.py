# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Read and write measured temperatures of joints or of their motors in bags.

A bag has temperatures in sensor_msgs/Temperature messages, whose ``frame_id`` or topic has the
name of the joint, or in control_msgs/DynamicJointState messages of ros2_control.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import struct
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray, Temperatures
from armid_ros.recording.bag import Bag
from armid_ros.recording.message_types import header_stamp
from armid_ros.recording.recording import Recording
from armid_ros.recording.source import Topic
from armid_ros.recording.writer import BagWriter
import numpy as np

TEMPERATURE = 'sensor_msgs/msg/Temperature'
_DYNAMIC_JOINT_STATE = 'control_msgs/msg/DynamicJointState'
#: Topic of temperatures in the bags that are written.
TOPIC = '/joint_temperatures'
#: Shortest time between two temperatures of a joint that are kept [s].
_MIN_INTERVAL = 0.1


def temperatures(
    where: Sequence[str], times: Sequence[FloatArray], values: Sequence[FloatArray]
) -> Temperatures:
    """
    Interpolate temperature readings, taken at different times, on a common time base.

    Parameters
    ----------
    where : sequence of str
        File, topic or column, and joint of the readings, for error messages.
    times : sequence of ndarray, each (K_j,)
        Times [s]; empty for a joint without a sensor.
    values : sequence of ndarray, each (K_j,)
        Temperatures [degC]; nan where there is no reading.

    Raises
    ------
    RecordingError
        If no temperature of a joint is finite, or a temperature is impossible.

    """
    kept, lowest, highest = [], -40.0, 150.0  # range of a working joint [degC]
    for name, t, value in zip(where, times, values, strict=True):
        there = np.isfinite(value)
        if len(value) and not there.any():
            raise RecordingError(
                f'{name}: no temperature is a finite number; ignore temperatures with '
                '--temperature none'
            )
        t, value = t[there], value[there]
        strange = np.flatnonzero((value < lowest) | (value > highest))
        if len(strange):
            raise RecordingError(
                f'{name}: the temperature at {t[strange[0]]:.3f} s is {value[strange[0]]:g}, but '
                f'has to be from {lowest:g} to {highest:g} degC; convert temperatures to degC, or '
                'ignore temperatures with --temperature none'
            )
        _, first = np.unique(np.floor(t / _MIN_INTERVAL), return_index=True)
        kept.append((t[first], value[first]))
    every = np.unique(np.concatenate([t for t, _ in kept]))
    columns = [
        np.interp(every, t, value) if len(t) else np.full(len(every), np.nan) for t, value in kept
    ]
    return Temperatures(every, np.column_stack(columns))


def read_temperatures(bag: Bag, recording: Recording) -> Temperatures | None:
    """
    Read the temperatures of the joints of a recording from its open bag.

    Parameters
    ----------
    bag : Bag
        The open bag.
    recording : Recording
        Recording with the joints and the time base.

    Returns
    -------
    Temperatures or None
        None if the bag has no temperature of these joints.

    Raises
    ------
    RecordingError
        If the temperatures of a joint are not finite or impossible.

    """
    found: dict[str, dict[int, float]] = {joint: {} for joint in recording.joints}
    source = dict.fromkeys(recording.joints, '')
    for topic in bag.topics():
        if topic.type_name in (TEMPERATURE, _DYNAMIC_JOINT_STATE):
            for joint, stamp, value in _readings(bag, topic, recording):
                found[joint].setdefault(stamp - recording.start_ns, value)
                source[joint] = source[joint] or topic.name
    if not any(found.values()):
        return None
    return temperatures(
        [f'{bag.path}: {source[joint]}: {joint}' for joint in recording.joints],
        [1e-9 * np.array(sorted(one)) for one in found.values()],
        [np.array([one[k] for k in sorted(one)]) for one in found.values()],
    )


def _readings(bag: Bag, topic: Topic, recording: Recording) -> Iterator[tuple[str, int, float]]:
    """Yield joint, stamp [ns] and temperature [degC] from a topic, at most ten per second."""
    last: dict[bytes, int] = {}
    for block in bag.blocks(topic.name):
        for index, received in enumerate(block.log_time.tolist()):
            cdr = block.message(index)
            length = int.from_bytes(cdr[12:16], 'little' if cdr[1] & 1 else 'big')
            frame = cdr[16 : 16 + length]  # in the header
            if received - last.get(frame, -(10**18)) < 1e9 * _MIN_INTERVAL:
                continue
            last[frame] = received
            message = bag.decoded(topic, cdr)
            sent = header_stamp(cdr) if recording.clock == 'header' else 0
            for name, value in _named(message, topic, recording.joints):
                yield name, sent or received, value


def _named(message: Any, topic: Topic, joints: Sequence[str]) -> Iterator[tuple[str, float]]:
    """Yield the requested joints in a decoded message, with their temperatures [degC]."""
    if topic.type_name == TEMPERATURE:
        parts = (part.removesuffix('_temperature') for part in topic.name.split('/'))
        names = [name for name in (message.header.frame_id, *parts) if name in joints]
        yield from ((name, float(message.temperature)) for name in names[:1])
        return
    for joint, states in zip(message.joint_names, message.interface_values, strict=False):
        pairs = zip(states.interface_names, states.values, strict=False)
        own = [float(value) for name, value in pairs if 'temperature' in name]
        if joint in joints and own:
            yield joint, own[0]


def write_temperatures(
    writer: BagWriter, joints: Sequence[str], measured: Temperatures, start_ns: int
) -> None:
    """Write temperatures to a bag as sensor_msgs/Temperature, one message per joint and time."""
    writer.add_topic(TOPIC, TEMPERATURE)
    for t, row in zip(measured.t.tolist(), measured.values.tolist(), strict=True):
        stamp = start_ns + round(1e9 * t)
        for joint, value in zip(joints, row, strict=True):
            if np.isfinite(value):
                frame = joint.encode() + b'\0'
                head = struct.pack('<iII', *divmod(stamp, 10**9), len(frame)) + frame
                head += bytes(-len(head) % 8)  # numbers begin at multiples of their size
                cdr = b'\0\1\0\0' + head + struct.pack('<dd', value, 0.0)
                writer.write(TOPIC, cdr, stamp)
