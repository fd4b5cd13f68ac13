# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read and write bags of arms with elastic joints, measured at motors and links."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import re
import struct

from armid_ros.errors import RecordingError
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.encoder import write_joint_states
from armid_ros.recording.message_types import BYTE_ORDERS
from armid_ros.recording.source import DEFAULT, IntArray, ReadSettings
from armid_ros.recording.writer import atomic_bag
from armid_ros.robots import Robot
import numpy as np

#: Topics of the motor positions (converted to the joint side), the link positions, and the
#: references of the control loops.
MOTOR, LINK, REFERENCE = '/joint_states', '/link/joint_states', '/reference/joint_states'
IMU = 'sensor_msgs/msg/Imu'
#: Position of the linear acceleration among the 37 numbers of an Imu message: orientation, angular
#: velocity and linear acceleration, each followed by its covariance.
_ACCELERATION = slice(25, 28)


def write_runs(path: str | Path, runs: Sequence[ElasticRun], robot: Robot) -> None:
    """
    Write experiments with an elastic arm to one bag, separated by pauses of 1 s.

    Raises
    ------
    RecordingError
        If the bag exists.

    """
    joints = robot.joints
    pause = 10**9  # [ns]
    with atomic_bag(path) as writer:
        writer.write_description(robot.urdf, pause)
        start = pause
        for run in runs:
            motor, link = run.motor, run.link
            stamps = start + np.rint((motor.t - motor.t[0]) * 1e9).astype(np.int64)
            dt = float(np.median(np.diff(motor.t)))
            reference = motor.q[0] + dt * np.cumsum(run.reference, axis=0)
            write_joint_states(writer, MOTOR, joints, stamps, motor.q, motor.dq, motor.tau)
            write_joint_states(writer, LINK, joints, stamps, link.q, link.dq)
            write_joint_states(writer, REFERENCE, joints, stamps, reference, run.reference)
            assert run.felt is not None
            for name, values in zip(robot.links, run.felt, strict=True):
                topic, frame = imu_topic(name), name.encode() + b'\0'
                head = b'\0\1\0\0' + struct.pack('<iII', 0, 0, len(frame)) + frame
                message = head.ljust(_length(len(frame)) - 37 * 8, b'\0') + bytes(37 * 8)
                raw = np.dtype((np.void, len(message)))
                messages = np.repeat(np.frombuffer(message, raw), len(stamps))
                rows = messages.view(_fields(len(message), '<'))
                rows['sec'], rows['nanosec'] = np.divmod(stamps, 10**9)
                # a covariance of -1: orientation and angular velocity are not measured
                rows['numbers'][:, [4, 16]] = -1.0
                rows['numbers'][:, _ACCELERATION] = values
                writer.add_topic(topic, IMU)
                writer.write_many(topic, messages, stamps)
            start = int(stamps[-1]) + pause


def read_accelerations(
    path: str | Path, topic: str, settings: ReadSettings = DEFAULT
) -> tuple[IntArray, FloatArray]:
    """
    Read time stamps and linear accelerations from the Imu messages of a topic.

    Returns
    -------
    stamps_ns : ndarray of int, shape (N,)
        Stamps of the headers [ns], in the order of storage.
    acceleration : ndarray, shape (N, 3)
        [m/s^2].

    Raises
    ------
    RecordingError
        If the bag or topic does not exist, or a message is not an Imu message.

    """
    with Bag(path, settings) as bag:
        topic = bag.topic_of(IMU, topic).name
        messages = [b.message(k) for b in bag.blocks(topic) for k in range(len(b))]
    if not messages:
        raise RecordingError(f'{path}: {topic} has no messages; record again')
    order = BYTE_ORDERS.get(messages[0][:2])
    if order is None or len(messages[0]) < 16:
        raise RecordingError(
            f'{path}: {topic}: the messages are not in CDR; record again with ros2 bag record'
        )
    length = _length(*struct.unpack_from(order + 'I', messages[0], 12))
    for k, message in enumerate(messages):
        if len(message) != length:
            raise RecordingError(
                f'{path}: {topic}: message {k} has {len(message)} bytes, but an Imu message with '
                f'the frame_id of the first message has {length}; record each accelerometer on a '
                'separate topic'
            )
    rows = np.frombuffer(b''.join(messages), _fields(length, order))
    stamps = rows['sec'].astype(np.int64) * 10**9 + rows['nanosec']
    return stamps, np.array(rows['numbers'][:, _ACCELERATION], dtype=float)


def _length(frame_length: int) -> int:
    """Return the size of an Imu message [bytes], for a given size of its frame_id."""
    return 4 + -(-(12 + frame_length) // 8) * 8 + 37 * 8


def _fields(length: int, order: str) -> np.dtype[np.void]:
    """Return the numpy record type of an Imu message: stamp and 37 numbers."""
    formats = [order + 'i4', order + 'u4', (order + 'f8', (37,))]
    names, offsets = ['sec', 'nanosec', 'numbers'], [4, 8, length - 37 * 8]
    return np.dtype({'names': names, 'formats': formats, 'offsets': offsets, 'itemsize': length})


def imu_topic(link: str) -> str:
    """Return a valid topic name for the accelerometer on a link."""
    name = re.sub('[^A-Za-z0-9_]', '_', link)
    return f'/{"_" if name[:1].isdigit() else ""}{name}/imu'
