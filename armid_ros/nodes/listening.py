# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What nodes share that make something of the joint states of one robot."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from armid_ros.nodes.base import ArmidNode, LOOK_PERIOD
from armid_ros.nodes.messages.joint_states import JointSample, JointStateReader
from armid_ros.nodes.messages.timeliness import Freshness, StampDifference
from armid_ros.nodes.qos import LATCHED, MatchedSubscription
from armid_ros.recording.message_types import header_stamp
from armid_ros.robots import Robot
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState
from std_msgs.msg import String


class ListeningNode(ArmidNode):
    """
    A node that reads the joint states of a robot, which parameters or robot_description name.

    Attributes
    ----------
    robot : Robot, or None
        None until it is known.
    received : int
        Joint states received.
    last_stamp_ns : int
        Stamp of the last one [ns].
    freshness : Freshness
        Whether joint states still come.
    stamps : StampDifference
        How far their stamps are from the clock.
    reader : JointStateReader
        Reads them, once the robot is known.
    joint_states : MatchedSubscription
        Brings them, once `listen` was called.

    """

    reader: JointStateReader
    joint_states: MatchedSubscription

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Take the keyword arguments of rclpy's Node."""
        super().__init__(name, **kwargs)
        self.robot: Robot | None = None
        self.received = self.last_stamp_ns = 0
        self.freshness = Freshness('joint states')
        self.stamps = StampDifference(self.get_clock())
        self._stopped = False
        self._description: str | None = None

    @abstractmethod
    def take_description(self, urdf: str) -> None:
        """Take the robot of robot_description, where it is another than that before."""

    @abstractmethod
    def take_sample(self, sample: JointSample) -> None:
        """Take a joint state of all joints of the robot."""

    def adopt(self, robot: Robot) -> None:
        """Read the joint states of a robot from now on."""
        self.robot = robot
        self.reader = JointStateReader(robot.joints, self.complaints, self.get_clock())

    def listen(self) -> None:
        """Subscribe to joint_states, and to robot_description while the robot is not known."""
        if self.robot is None:
            self.create_subscription(String, 'robot_description', self._on_description, LATCHED)
        self.joint_states = MatchedSubscription(
            self, JointState, 'joint_states', self.take_joint_states, raw=True
        )
        self.look_every(LOOK_PERIOD, self.look)

    @property
    def hardware(self) -> str:
        """Name of the robot."""
        return '' if self.robot is None else str(self.robot.name)

    @property
    def awaited(self) -> str:
        """What has to come before there is anything to do; empty: nothing."""
        if self.robot is None:
            return 'waiting for robot_description'
        return '' if self.received else 'no joint states so far'

    def level(self, troubled: bool) -> bytes:
        """Return STALE when joint states have stopped."""
        return DiagnosticStatus.STALE if self.freshness.stopped else super().level(troubled)

    def look(self) -> None:
        """Look at who publishes joint states, and say at once when they stop or come again."""
        self.joint_states.match()
        if self.freshness.stopped != self._stopped:
            self._stopped = self.freshness.stopped
            self.publish_diagnostics()

    def take_joint_states(self, data: bytes) -> None:
        """Take a joint state as it came, serialised."""
        self.received += 1
        self.freshness.heard()
        self.last_stamp_ns = header_stamp(data)
        self.stamps.take(self.last_stamp_ns)
        if self.robot is not None:
            for sample in self.reader.read(data):
                self.take_sample(sample)

    def _on_description(self, message: String) -> None:
        if message.data != self._description:
            self.take_description(message.data)
            self._description = message.data
