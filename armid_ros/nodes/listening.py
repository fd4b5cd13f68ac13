# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Base class of nodes that process the joint states of one robot."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from armid_ros.nodes.base import ArmidNode, LOOK_PERIOD
from armid_ros.nodes.messages.joint_states import (
    DISTURBANCES,
    JointSample,
    JointStateReader,
    SENDER_CONFLICTS,
)
from armid_ros.nodes.messages.timeliness import Freshness, StampDifference
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.qos import LATCHED, MatchedSubscription
from armid_ros.recording.message_types import header_stamp
from armid_ros.robots import load_robot, parse_gravity, Robot, robot_from_urdf
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState
from std_msgs.msg import String

#: Parameters of nodes that can take the robot from robot_description.
ROBOT_PARAMETERS = (
    NodeParameter(
        'robot', '', 'A shipped robot, or a path; empty: the robot of robot_description.'
    ),
    NodeParameter(
        'gravity',
        'earth',
        'earth, moon, or x,y,z in the base frame [m/s^2]; a model file has its own gravity.',
        check=parse_gravity,
    ),
    NodeParameter('joints', [''], 'Driven joints; if empty, all joints except those of grippers.'),
)


class ListeningNode(ArmidNode):
    """
    Base class of nodes that process the joint states of one robot.

    Attributes
    ----------
    robot : Robot, or None
        None until the robot is known.
    received : int
        Number of received joint states.
    last_stamp_ns : int
        Stamp of the last joint state [ns].
    freshness : Freshness
        Time since the last joint state.
    stamps : StampDifference
        Difference between stamps and clock.
    reader : JointStateReader
        Decodes joint states; set when the robot is known.
    joint_states : MatchedSubscription
        Subscription; set by `listen`.

    """

    reader: JointStateReader
    joint_states: MatchedSubscription

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Create the node; `kwargs` are the arguments of rclpy's Node."""
        super().__init__(name, **kwargs)
        self.robot: Robot | None = None
        self.received = self.last_stamp_ns = 0
        self.freshness = Freshness('joint states')
        self.stamps = StampDifference(self.get_clock())
        self._stopped = False
        self._description: str | None = None

    @abstractmethod
    def take_description(self, urdf: str) -> None:
        """Process a new robot_description."""

    @abstractmethod
    def take_sample(self, sample: JointSample) -> None:
        """Process a joint state that contains all joints of the robot."""

    def adopt(self, robot: Robot) -> None:
        """Set the robot whose joint states the node processes from now on."""
        self.robot = robot
        self.reader = JointStateReader(robot.joints, self.complaints, self.get_clock())

    def listen(self) -> None:
        """Subscribe to joint_states, and to robot_description if the robot is not known."""
        if self.robot is None:
            self.create_subscription(String, 'robot_description', self._on_description, LATCHED)
        self.joint_states = MatchedSubscription(
            self, JointState, 'joint_states', self.take_joint_states, raw=True
        )
        self.create_steady_timer(LOOK_PERIOD, self.poll)

    @property
    def hardware(self) -> str:
        """Name of the robot on /diagnostics."""
        return '' if self.robot is None else str(self.robot.name)

    @property
    def awaited(self) -> str:
        """Message on the input that the node waits for; '' if no input is missing."""
        if self.robot is None:
            return 'waiting for robot_description'
        return '' if self.received else 'no joint states so far'

    def level(self, troubled: bool) -> bytes:
        """Return the level for /diagnostics: STALE if no more joint states arrive."""
        return DiagnosticStatus.STALE if self.freshness.stopped else super().level(troubled)

    def stream_trouble(self) -> str:
        """Return a message on missing joint states or wrong time stamps; otherwise ''."""
        fresh = self.complaints.latest if self.complaints.fresh else ''
        if self.awaited:
            return self.awaited
        if self.freshness.stopped:
            return '; '.join(filter(None, (self.freshness.trouble(), fresh)))
        return '' if fresh else self.stamps.of_results(self.joint_states.topic)

    def report(self, reason: str, text: str = '') -> None:
        """
        Count and log a faulty joint state; name publishers that may be the cause.

        Parameters
        ----------
        reason : str
            A key of `DISTURBANCES`, or 'spike'.
        text : str
            Message for a reason that is not a key.

        """
        several = self.joint_states.several if reason in SENDER_CONFLICTS else ''
        parts = text or DISTURBANCES[reason], several
        self.complaints.add(reason, '; '.join(filter(None, parts)))

    def poll(self) -> None:
        """Adopt the QoS of publishers of joint states; publish whether joint states arrive."""
        self.joint_states.match()
        if self.freshness.stopped != self._stopped:
            self._stopped = self.freshness.stopped
            self.publish_diagnostics()

    def take_joint_states(self, data: bytes) -> None:
        """Decode a serialised joint state, and process it if it is valid."""
        self.received += 1
        self.freshness.mark_received()
        self.last_stamp_ns = header_stamp(data)
        self.stamps.take(self.last_stamp_ns)
        if self.robot is not None:
            sample = self.reader.read(data)
            if sample is not None:
                self.take_sample(sample)

    def described_robot(self, description: str | None) -> Robot:
        """Load the robot from a URDF text, or without text from the node parameter `robot`."""
        given = {'gravity': self.value('gravity'), 'joints': self.value('joints') or None}
        if description is None:
            return load_robot(self.value('robot'), **given)
        return robot_from_urdf(description, **given)

    def _on_description(self, message: String) -> None:
        if message.data != self._description:
            self.take_description(message.data)
            self._description = message.data
