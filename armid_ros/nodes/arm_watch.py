# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Supervise the joint states of an arm: position, age and time stamps."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from armid_ros.excitation.pose_monitor import MIN_AGREEING, PoseMonitor
from armid_ros.excitation.supervision import tracking_fault
from armid_ros.motion import FloatArray
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.messages.timeliness import StampDifference
from armid_ros.nodes.qos import publisher_names
from armid_ros.recording.joint_state.decoder import JointStateMessages
from armid_ros.robots import Robot
import numpy as np
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

#: Time for which an arm must be at rest before a run starts [s].
_REST = 0.25


class ArmWatch:
    """
    Subscriber of joint_states that supervises joint positions, message age and time stamps.

    Attributes
    ----------
    monitor : PoseMonitor
        Accepts or rejects measured positions.
    stamps : StampDifference
        Difference between the stamps and the clock of the node.
    overloads : ndarray of int, shape (n,)
        Number of the latest efforts of each joint that were too large, in a row.

    """

    def __init__(
        self, node: ArmidNode, robot: Robot, tolerance: float, on_state: Callable[[float], None]
    ) -> None:
        """
        Subscribe to joint_states.

        Parameters
        ----------
        node : ArmidNode
            Node that subscribes, with `PUBLISHER_PARAMETERS`.
        robot : Robot
            Robot with the position limits.
        tolerance : float
            Largest distance beyond a position limit at which a position is accepted [rad or m].
        on_state : callable
            Called after every message with its time of arrival [s], see `now`.

        """
        self.monitor = PoseMonitor(robot, tolerance)
        self.stamps = StampDifference(node.get_clock())
        self._efforts: dict[str, float] = {}
        self.overloads = np.zeros(robot.n_joints, dtype=int)
        self._node, self._robot, self._on_state = node, robot, on_state
        self._messages = JointStateMessages()
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._stepped_ns = 0
        self._jumps = node.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=Duration(seconds=60.0),  # the clock was set, as in simulated_arm
                min_backward=Duration(nanoseconds=-1),
                on_clock_change=False,
            ),
            post_callback=self._on_clock_step,
        )
        self._states = node.create_subscription(
            JointState, 'joint_states', self._on_joint_states, qos_profile_sensor_data, raw=True
        )

    def take_effort(self) -> FloatArray:
        """Return the latest efforts since the last call, (n,) [N m or N]; NaN if none arrived."""
        new, self._efforts = self._efforts, {}
        return np.array([new.get(joint, math.nan) for joint in self._robot.joints])

    @property
    def behind(self) -> float:
        """Age of the oldest time stamp of the present joint positions [s]; NaN without a stamp."""
        stamp, now = self.monitor.last_stamp_ns, self._node.get_clock().now().nanoseconds
        return (now - stamp) * 1e-9 if stamp else math.nan

    def now(self) -> float:
        """Return the time [s] of a steady clock, or with use_sim_time the time of /clock."""
        return self._age_clock(self._node.get_clock().now().nanoseconds)

    def catch_up(self) -> None:
        """Process joint states that arrived while the node was computing."""
        with self._states.handle:
            while (taken := self._states.handle.take_message(JointState, True)) is not None:
                self._states.callback(taken[0])

    def fault_since(self, q: FloatArray, behind: float, simulated: bool) -> str:
        """Return a message if the arm moved from `q` or sent no joint states; otherwise ''."""
        self.catch_up()
        silence = self.behind - behind
        if silence > self._node.value('state_timeout') and not simulated:
            return f'no joint state was sent for {silence:.2g} s'
        fault = self.monitor.contradiction(self.now(), 1)
        # a controller covers 0.01 rad or m before the first waypoint, within `HANDOVER_TIME`
        robot = self._robot
        moved = tracking_fault(robot.joints, robot.position_units, q, self.monitor.q, 0.01)
        return fault or moved

    def fault_on_path(self, q: FloatArray, effort: FloatArray, largest: FloatArray) -> str:
        """
        Return a message if the arm deviates from its planned position or effort; otherwise ''.

        A joint is off its planned position, or three of its efforts in a row are too large.

        Parameters
        ----------
        q : ndarray, shape (n,)
            Planned position [rad or m].
        effort : ndarray, shape (n,)
            Efforts of `take_effort` [N m or N].
        largest : ndarray, shape (n,)
            Largest planned effort of each joint [N m or N].

        """
        robot, factor = self._robot, self._node.value('effort_factor')
        large = (factor * largest > 0.0) & (np.abs(effort) > factor * largest)
        # joints may have different senders
        known = ~np.isnan(effort)
        self.overloads = np.where(known, np.where(large, self.overloads + 1, 0), self.overloads)
        tolerance, units = self._node.value('tracking_tolerance'), robot.position_units
        fault = tracking_fault(robot.joints, units, q, self.monitor.q, tolerance)
        j = int(np.argmax(self.overloads))
        if fault or self.overloads[j] < 3:
            return fault
        return (
            f"the effort of joint '{robot.joints[j]}' is {abs(effort[j]):.3g} "
            f'{robot.torque_units[j]}, more than effort_factor {factor:g} times the predicted '
            f'{largest[j]:.3g}'
        )

    def interruption(self, gap: float) -> str:
        """Return a message if the time `gap` [s] between two checks is too long; otherwise ''."""
        if gap <= self._node.value('state_timeout'):
            return ''
        return f'the arm was not supervised for {gap:.2f} s, as no joint state was processed'

    def staleness(self, timeout: float) -> str:
        """Return a message if a joint has no new position for `timeout` [s]; otherwise ''."""
        fault = self.monitor.staleness(self.now(), timeout)
        topic = self._states.topic_name
        if (
            not fault
            or self._states.get_publisher_count()
            or not self._node.count_publishers(topic)
        ):
            return fault
        return f'{fault}; the quality of service of the publisher of {topic} is incompatible'

    def fault_at_start(self, simulated: bool) -> str:
        """Return a message if a motion of the arm must not start now; otherwise ''."""
        value = self._node.value
        timeout = value('state_timeout')
        # largest difference between stamps and the clock of the node [s]
        difference = timeout if value('simulation') else 0.1 * value('stopping')
        difference = math.inf if value('zero_stamp') else difference
        topic = self._states.topic_name
        fault = self._node.missing_clock
        if fault:
            return fault
        now, monitor = self.now(), self.monitor
        fault = monitor.contradiction(now, 1) or self.staleness(timeout) or monitor.unsteady(_REST)
        if fault is None:
            fault = (
                f'fewer than {MIN_AGREEING} new joint states, or less than {_REST:g} s of them, '
                'were received: whether the arm is at rest is unknown'
            )
        if fault:
            return f'{topic}: {fault}'
        senders = publisher_names(self._node, topic)
        if len(senders) > self.monitor.sources:
            names = ', '.join(senders)
            return f'{topic}: {len(senders)} publishers for the same joints ({names}): stop one'
        late, clock = self.stamps.late, self._node.get_clock().now().nanoseconds * 1e-9
        if not abs(late) > difference:
            return ''
        # a controller with another clock begins the trajectory late, or skips its beginning
        remedy = 'set the clocks, or zero_stamp:=true'
        if simulated:
            remedy = 'use_sim_time on both nodes or on neither'
        return (
            f'stamps of {topic} are {abs(late):.3g} s {self.stamps.side(late)} '
            f'({clock - late:.3f} s and {clock:.3f} s), more than {difference:.3g} s: {remedy}'
        )

    def _age_clock(self, clock_ns: int) -> float:
        """Convert a time of the node's clock [ns] to the time [s] that `now` would return."""
        if not self._node.get_clock().ros_time_is_active:
            return float(self._steady.now().nanoseconds * 1e-9)
        return (clock_ns - self._stepped_ns) * 1e-9

    def _on_clock_step(self, jump: Any) -> None:
        self._stepped_ns += jump.delta.nanoseconds

    def _on_joint_states(self, data: bytes) -> None:
        message = self._messages.read(data)
        stamp = message.sec * 10**9 + message.nanosec
        clock_ns = self._node.get_clock().now().nanoseconds
        now = self._age_clock(clock_ns)
        self.monitor.update(message.names, message.position, message.velocity, stamp, now)
        self.stamps.take(stamp, clock_ns)
        self._efforts.update(zip(message.names, message.effort, strict=False))
        self._on_state(now)
