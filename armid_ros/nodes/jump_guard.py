# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps trajectories from an arm that would jump to where they begin."""

from __future__ import annotations

from armid_ros.errors import ArmidError
from armid_ros.excitation import jump_fault, MeasuredPose
from armid_ros.motion import FloatArray
from armid_ros.nodes.trajectory.messages import read_trajectory
from armid_ros.robots import robot_from_urdf
from armid_ros.simulation import Reference
import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory


class JumpGuard:
    """
    Compares the first waypoint of trajectories with where an arm is.

    Parameters
    ----------
    node : Node
        Gets a subscription to joint_states.
    tolerance : float
        How far the arm may be from a first waypoint at time 0 [rad or m].
    timeout : float
        Age at which a joint state says nothing any more [s].

    """

    def __init__(self, node: Node, tolerance: float, timeout: float) -> None:
        self.tolerance, self.timeout = tolerance, timeout
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._latest: dict[tuple[str, ...], tuple[JointState, float]] = {}
        self._limits: dict[str, float] = {}
        self._states = node.create_subscription(
            JointState, 'joint_states', self._on_joint_states, 10
        )

    @property
    def hears(self) -> bool:
        """Whether any joint state has come."""
        return bool(self._latest)

    def describe(self, cdr: bytes) -> None:
        """Take the velocity limits from a robot_description."""
        try:
            robot = robot_from_urdf(deserialize_message(cdr, String).data)
        except ArmidError:
            return  # it is not for this guard to judge descriptions
        self._limits = dict(zip(robot.joints, robot.velocity_limit.tolist(), strict=True))

    def objection(self, cdr: bytes) -> str:
        """Say why a JointTrajectory must not be sent to the arm; empty when it may."""
        try:
            reference = read_trajectory(deserialize_message(cdr, JointTrajectory))
        except ArmidError as error:
            return str(error)
        pose = MeasuredPose.unknown(reference.joints)
        for message, seen in self._latest.values():
            pose = pose.updated(message.name, message.position, 0, seen)
        lost = pose.staleness(self._now(), self.timeout)
        if lost:
            return f'trajectory: {self._states.topic_name}: {lost}; it is not known where it is'
        first = (float(reference.t[0]), reference.q[0])
        fault = jump_fault(
            reference.joints, first, pose.q, self._fastest(reference), self.tolerance
        )
        return f'trajectory: {fault}; bring the arm to its first point' if fault else ''

    def _fastest(self, reference: Reference) -> FloatArray:
        """Return velocity limits; where none are known, the top speeds of the trajectory."""
        if reference.dq is not None:
            top = np.abs(reference.dq).max(axis=0)
        elif len(reference.t) > 1:
            top = np.abs(np.diff(reference.q, axis=0) / np.diff(reference.t)[:, None]).max(axis=0)
        else:
            top = np.zeros(len(reference.joints))
        known = [self._limits.get(joint, np.inf) for joint in reference.joints]
        return np.where(np.isfinite(known), known, top)

    def _on_joint_states(self, message: JointState) -> None:
        names = tuple(message.name)
        stamp = Time.from_msg(message.header.stamp).nanoseconds
        before = self._latest.get(names)
        if before and stamp and stamp == Time.from_msg(before[0].header.stamp).nanoseconds:
            return
        self._latest[names] = (message, self._now())

    def _now(self) -> float:
        return float(self._clock.now().nanoseconds * 1e-9)
