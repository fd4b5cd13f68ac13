# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an arm with elastic joints publishes in addition to its joint states."""

from __future__ import annotations

from armid_ros.nodes.qos import SAMPLES
from armid_ros.recording.elastic import imu_topic, LINK, REFERENCE
from armid_ros.simulation.simulated_arm import LinkSample, SimulatedArm
from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Imu, JointState


class ElasticTopics:
    """
    Publishers of link/joint_states, reference/joint_states and an imu topic for every link.

    Parameters
    ----------
    node : Node
        Whose topics they are.
    arm : SimulatedArm
        The arm, with springs.

    """

    def __init__(self, node: Node, arm: SimulatedArm) -> None:
        def publisher(kind: type, topic: str) -> tuple:  # type: ignore[type-arg]
            return node.create_publisher(
                kind,
                topic.lstrip('/'),
                SAMPLES,
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )

        self._link = publisher(JointState, LINK), JointState(name=list(arm.joints))
        self._reference = publisher(JointState, REFERENCE), JointState(name=list(arm.joints))
        self._imus = []
        for link in arm.plant.robot.links:
            message = Imu()
            message.header.frame_id = link
            message.orientation_covariance[0] = message.angular_velocity_covariance[0] = -1.0
            self._imus.append((publisher(Imu, imu_topic(link)), message))

    def publish(self, sample: LinkSample, stamp: Time) -> None:
        """Publish a sample."""
        for (publisher, message), q, dq in (
            (self._link, sample.q, sample.dq),
            (self._reference, sample.asked_q, sample.asked_dq),
        ):
            message.header.stamp = stamp
            message.position = q.tolist()
            message.velocity = dq.tolist()
            publisher.publish(message)
        for (publisher, message), felt in zip(
            self._imus, sample.acceleration.tolist(), strict=True
        ):
            message.header.stamp = stamp
            acceleration = message.linear_acceleration
            acceleration.x, acceleration.y, acceleration.z = felt
            publisher.publish(message)
