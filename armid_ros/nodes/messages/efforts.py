# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Torques in messages of several types, by joint."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from armid_ros.errors import RecordingError

#: Type of a message, and what reads {joint: torque} out of it.
Reader = Callable[[Any], Mapping[str, float]]


def effort_reader(type_name: str, joints: Sequence[str], interface: str) -> Reader:
    """
    Return what reads torques out of messages of a type.

    Parameters
    ----------
    type_name : str
        sensor_msgs/msg/JointState, control_msgs/msg/DynamicJointState or
        std_msgs/msg/Float64MultiArray.
    joints : sequence of str
        What the elements of an array are.
    interface : str
        Which of the values of a DynamicJointState is the torque, or the current.

    Raises
    ------
    RecordingError
        If messages of that type hold none.

    """
    readers: dict[str, Reader] = {
        'sensor_msgs/msg/JointState': _joint_state,
        'control_msgs/msg/DynamicJointState': lambda message: _dynamic(message, interface),
        'std_msgs/msg/Float64MultiArray': lambda message: _array(message, joints),
    }
    if type_name not in readers:
        raise RecordingError(f'{type_name} holds no efforts; those that do: {", ".join(readers)}')
    return readers[type_name]


def _joint_state(message: Any) -> Mapping[str, float]:
    if len(message.effort) != len(message.name):
        raise RecordingError(
            f'efforts: {len(message.name)} names, but {len(message.effort)} of effort'
        )
    return dict(zip(message.name, message.effort, strict=True))


def _dynamic(message: Any, interface: str) -> Mapping[str, float]:
    found = {}
    for joint, values in zip(message.joint_names, message.interface_values, strict=False):
        known = dict(zip(values.interface_names, values.values, strict=False))
        if interface in known:
            found[joint] = known[interface]
    if not found:
        there = sorted({n for values in message.interface_values for n in values.interface_names})
        raise RecordingError(
            f"efforts: no joint has the interface '{interface}'; there are {', '.join(there)}"
        )
    return found


def _array(message: Any, joints: Sequence[str]) -> Mapping[str, float]:
    if len(message.data) != len(joints):
        raise RecordingError(
            f'efforts: an array of {len(message.data)} for {len(joints)} joints '
            f'({", ".join(joints)})'
        )
    return dict(zip(joints, message.data, strict=True))
