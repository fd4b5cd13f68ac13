# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joint states as numbers in the order of the robot, whatever order and rubbish they come in."""

from __future__ import annotations

import math
from typing import NamedTuple

from armid_ros.errors import RecordingError
from armid_ros.identification.joint_order import JointOrder
from armid_ros.motion import FloatArray
from armid_ros.nodes.complaints import Complaints
import numpy as np
import numpy.typing as npt
from rclpy.clock import Clock
from rclpy.time import Time
from sensor_msgs.msg import JointState


class JointSample(NamedTuple):
    """
    One joint state in the order of the robot.

    Attributes
    ----------
    t : float
        Time since the second in which the first sample came [s].
    q, tau : ndarray, shape (n,)
        Position [rad or m], torque [N m or N].
    dq : ndarray, shape (n,), or None
        Velocity; None where the message has none.

    """

    t: float
    q: FloatArray
    dq: FloatArray | None
    tau: FloatArray


class JointStateReader:
    """
    Reads JointState messages, and complains of those that cannot be read.

    Parameters
    ----------
    joints : tuple of str
        The joints that are wanted, in their order.
    complaints : Complaints
        Told of what is left out.
    clock : Clock
        Gives the time of reception, for messages without a stamp.

    """

    def __init__(self, joints: tuple[str, ...], complaints: Complaints, clock: Clock) -> None:
        self._joints = JointOrder(joints)
        self._complaints = complaints
        self._clock = clock
        self._names: list[str] | None = None
        self._order: npt.NDArray[np.intp] | slice = slice(None)
        self._epoch: int | None = None

    def read(self, message: JointState) -> JointSample | None:
        """Return the sample of a message, None when it cannot be used."""
        try:
            if message.name != self._names:
                self._order = self._joints.map(message.name)
                self._names = list(message.name)
            q = self._values(message, 'position')
            dq = self._values(message, 'velocity') if message.velocity else None
            tau = self._values(message, 'effort')
        except RecordingError as error:
            self._complaints.say('joint_states', str(error))
            return None
        return JointSample(self._time(message), q, dq, tau)

    def stamp(self, t: float) -> Time:
        """Return the stamp of a time of this reader."""
        return Time(nanoseconds=(self._epoch or 0) * 10**9 + round(t * 1e9))

    def _time(self, message: JointState) -> float:
        stamp = message.header.stamp
        if stamp.sec == 0 and stamp.nanosec == 0:
            self._complaints.say(
                'stamp', 'joint states without a stamp: the time of reception is used'
            )
            stamp = self._clock.now().to_msg()
        if self._epoch is None:
            self._epoch = stamp.sec
        return float(stamp.sec - self._epoch) + 1e-9 * stamp.nanosec

    def _values(self, message: JointState, name: str) -> FloatArray:
        field = getattr(message, name)
        if len(field) != len(message.name):
            hint = '; identification needs measured torque' if name == 'effort' else ''
            raise RecordingError(
                f'joint states with {len(message.name)} names but {len(field)} of {name}{hint}'
            )
        values = np.frombuffer(field)[self._order]
        # a plain sum of a few numbers is quicker than numpy; joints left out may well be NaN
        if not math.isfinite(sum(field)) and not np.all(np.isfinite(values)):
            joint = self._joints.joints[int(np.argmin(np.isfinite(values)))]
            raise RecordingError(f"joint states where the {name} of '{joint}' is not a number")
        return values
