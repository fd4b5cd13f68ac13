# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where joint states say that an arm is, put together when somebody asks."""

from __future__ import annotations

import math

from armid_ros.excitation import MeasuredPose
from armid_ros.motion import FloatArray
from armid_ros.recording.joint_state.message import JointStateMessages, JointStateValues
import numpy as np


class PoseReader:
    """
    Keeps the last joint state of every sender, and makes the pose of an arm of them.

    Joint states come a thousand times a second; the pose is looked at less often.

    Parameters
    ----------
    joints : tuple of str
        Those of the arm.

    """

    def __init__(self, joints: tuple[str, ...]) -> None:
        self._pose = MeasuredPose.unknown(joints)
        self._messages = JointStateMessages()
        self._waiting: dict[tuple[str, ...], tuple[JointStateValues, float]] = {}

    def take(self, data: bytes, now: float) -> JointStateValues:
        """Take in a serialised message that came now [s], and return what it says."""
        message = self._messages.read(data)
        self._waiting[message.names] = message, now
        return message

    @property
    def pose(self) -> MeasuredPose:
        """Return the pose by all that came."""
        for message, came in self._waiting.values():
            stamp = message.sec * 10**9 + message.nanosec
            self._pose = self._pose.updated(message.names, message.position, stamp, came)
        self._waiting.clear()
        return self._pose


def efforts(message: JointStateValues, joints: tuple[str, ...]) -> FloatArray:
    """Return the torques of a message in the order of the joints, NaN where there is none."""
    known = dict(zip(message.names, message.effort, strict=False))
    return np.array([known.get(joint, math.nan) for joint in joints])
