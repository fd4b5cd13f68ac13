# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decode and check joint states, and sort their values in the joint order of the robot."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import NamedTuple

from armid_ros.errors import RecordingError
from armid_ros.identification.samples.joint_merge import joint_places
from armid_ros.motion import FloatArray
from armid_ros.nodes.complaints import Complaints
from armid_ros.recording.joint_state.decoder import JointStateMessages
from armid_ros.recording.joint_state.layout import MalformedMessage
import numpy as np
import numpy.typing as npt
from rclpy.clock import Clock
from rclpy.time import Time

#: Messages about faulty sequences of joint states, by reason.
DISTURBANCES = {
    'out_of_order': 'joint states whose stamp is not after the previous one are skipped',
    'impossible': 'joint states with values that no arm can reach are skipped',
    'stamp': 'joint states with a single wrong stamp are skipped',
    'erratic': 'joint states that agree neither with earlier nor with later ones are skipped',
    'no_velocity': 'joint states without velocity are skipped: measured_velocity requires it',
    'jump_back': 'joint states jump back in time: their processing restarts',
    'position_step': 'positions step, as after a step of the clock or the zeroing of an encoder: '
    'the filters restart',
    'missing': 'joint states are missing: the history of the publisher is shorter than a second, '
    'or the computer is overloaded',
    'dropout': 'joint states are missing for longer than max_gap: the filters restart',
    'frozen': 'positions stay constant while efforts change: check whether the driver still reads '
    'the encoders',
}
#: Reasons that two publishers of the same joints can cause.
SENDER_CONFLICTS = frozenset(
    {'out_of_order', 'stamp', 'erratic', 'jump_back', 'position_step', 'spike'}
)


class JointSample(NamedTuple):
    """
    Positions, velocities and torques of a joint state, in the robot's joint order.

    Attributes
    ----------
    t : float
        Time since the full second before the first sample [s].
    q, tau : ndarray, shape (n,)
        Position [rad or m], torque [N m or N]; no torques if the reader reads none.
    dq : ndarray, shape (n,), or None
        Velocity; None where the message has none.

    """

    t: float
    q: FloatArray
    dq: FloatArray | None
    tau: FloatArray


class JointStateReader:
    """
    Decoder of the JointState messages of a robot; it counts and logs invalid messages.

    Parameters
    ----------
    joints : tuple of str
        Joints to read, in this order.
    complaints : Complaints
        Logs skipped messages.
    clock : Clock
        Clock for the time of reception of messages without a stamp.
    topic : str
        Topic that the logged messages name; empty for the only topic of a node.
    torque : bool
        Whether the messages have to contain torques.

    """

    def __init__(
        self,
        joints: tuple[str, ...],
        complaints: Complaints,
        clock: Clock,
        topic: str = '',
        torque: bool = True,
    ) -> None:
        self._joints = joints
        self._complaints = complaints
        self._clock = clock
        self._topic, self._torque = topic, torque
        self._messages = JointStateMessages()
        self._names: Sequence[str] | None = None
        self._order: npt.NDArray[np.intp]
        self._epoch: int | None = None

    def read(self, data: bytes) -> JointSample | None:
        """Decode a serialised message; return None for an invalid or incomplete joint state."""
        try:
            message = self._messages.read(data)
            if message.names is not self._names and message.names != self._names:
                self._find_joints(message.names)
            stamp = self._time(message.sec, message.nanosec)
            q = self._values(message.names, message.position, 'position')
            dq = None
            if len(message.velocity):
                dq = self._ordered(message.names, message.velocity, 'velocity')
                # joint_state_broadcaster publishes NaN for velocities that are not measured
                dq = dq if math.isfinite(sum(dq.tolist())) else None
            tau = np.empty(0)
            if self._torque:
                tau = self._values(message.names, message.effort, 'effort')
        except (MalformedMessage, RecordingError) as error:
            text = f'{self._topic}: {error}' if self._topic else str(error)
            self._complaints.add(self._topic or 'joint_states', text)
            return None
        return JointSample(stamp, q, dq, tau)

    def _find_joints(self, names: Sequence[str]) -> None:
        """Store the index of each robot joint among the joint names of a message."""
        self._names = None
        try:
            self._order = joint_places(self._joints, names)
        except RecordingError as error:
            missing, some = set(self._joints) - set(names), set(self._joints) & set(names)
            merge = '; the node joint_state_merger merges several senders'
            hint = merge if missing and some else ''
            raise RecordingError(f'{error}{hint}') from error
        self._names = names

    def stamp(self, t: float) -> Time:
        """Convert the time `t` [s] of a decoded sample to a ROS time stamp."""
        return Time(nanoseconds=(self._epoch or 0) * 10**9 + round(t * 1e9))

    def _time(self, sec: int, nanosec: int) -> float:
        if sec == 0 and nanosec == 0:
            self._complaints.add(
                'stamp', 'joint states have no stamp: the time of reception is used'
            )
            sec, nanosec = divmod(self._clock.now().nanoseconds, 10**9)
        if sec < 0 or nanosec >= 10**9:
            raise RecordingError(
                f'joint states with an invalid stamp, {sec} s and {nanosec} ns, are skipped'
            )
        if self._epoch is None:
            self._epoch = sec
        return float(sec - self._epoch) + 1e-9 * nanosec

    def _ordered(self, names: Sequence[str], field: FloatArray, name: str) -> FloatArray:
        if len(field) != len(names):
            hint = '; identification needs measured torque' if name == 'effort' else ''
            raise RecordingError(
                f'joint states have {len(names)} joint names, but {len(field)} values of '
                f'{name}{hint}'
            )
        return field[self._order]

    def _values(self, names: Sequence[str], field: FloatArray, name: str) -> FloatArray:
        """Return the values of a field in joint order; RecordingError for a missing value."""
        values = self._ordered(names, field, name)
        # a sum is faster than isfinite; skipped joints may be NaN
        if not math.isfinite(sum(values.tolist())) and not np.all(np.isfinite(values)):
            bad = int(np.argmin(np.isfinite(values)))
            raise RecordingError(
                f"the {name} of '{self._joints[bad]}' in joint states is not a number"
            )
        return values
