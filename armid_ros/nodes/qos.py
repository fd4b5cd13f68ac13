# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Quality of service (QoS) of the nodes, and subscriptions that match their publishers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from armid_ros.recording.metadata import VOLATILE
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosbags.interfaces import Qos, QosDurability, QosReliability

#: Profile of commands, /clock and diagnostics.
STREAM = QoSProfile(depth=10)
#: Profile that keeps the latest value for late subscribers: descriptions, models, estimates.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: Number of messages that a subscription holds while its node is busy: 1 s at 1 kHz.
DEPTH = 1000
#: Profile of joint states, without losses. While a subscriber is not scheduled, shared memory
#: holds 512 messages, half a second at 1 kHz. Later messages are sent again from the history of
#: the publisher, of this depth.
SAMPLES = QoSProfile(depth=DEPTH)


def matching(publishers: Sequence[TopicEndpointInfo], depth: int) -> QoSProfile:
    """
    Return the strictest QoS profile that all publishers of a topic satisfy.

    The profile is reliable if all publishers are reliable, and transient local if all are
    transient local. Otherwise the weaker policy is used, which matches every publisher.

    """
    profiles = [publisher.qos_profile for publisher in publishers]
    reliable = all(p.reliability == ReliabilityPolicy.RELIABLE for p in profiles)
    latched = all(p.durability == DurabilityPolicy.TRANSIENT_LOCAL for p in profiles)
    return _profile(depth, reliable, latched)


def recorded(publishers: Sequence[TopicEndpointInfo]) -> tuple[Qos, ...]:
    """Return the QoS profiles of a topic's publishers, in the format of a bag."""
    return tuple(
        VOLATILE._replace(
            reliability=QosReliability[publisher.qos_profile.reliability.name],
            durability=QosDurability[publisher.qos_profile.durability.name],
        )
        for publisher in publishers
    )


def offered(profiles: Sequence[Qos]) -> QoSProfile:
    """Return the QoS profile for the playback of a topic: the weakest recorded profile."""
    best_effort = any(p.reliability is QosReliability.BEST_EFFORT for p in profiles)
    latched = {p.durability for p in profiles} == {QosDurability.TRANSIENT_LOCAL}
    return _profile(DEPTH, not best_effort, latched)


def _profile(depth: int, reliable: bool, latched: bool) -> QoSProfile:
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def publisher_names(node: Node, topic: str) -> list[str]:
    """Return the sorted full names of the nodes that publish a topic."""
    found = node.get_publishers_info_by_topic(topic)
    return sorted(f'{p.node_namespace.rstrip("/")}/{p.node_name}' for p in found)


class MatchedSubscription:
    """
    Subscription that starts once the topic has publishers, with the QoS of the publishers.

    A reliable subscription does not match a best-effort publisher. A best-effort subscription
    loses messages that a reliable publisher would send again. The QoS therefore depends on the
    publishers.

    Attributes
    ----------
    topic : str
        Full name of the topic, remapped.
    subscription : Subscription, or None
        None while the topic has no publisher.

    """

    def __init__(
        self,
        node: Node,
        message_type: type,
        topic: str,
        callback: Callable[[Any], None],
        *,
        raw: bool = False,
        depth: int = DEPTH,
    ) -> None:
        """Subscribe now if the topic has publishers; otherwise `match` subscribes later."""
        self._node = node
        self._message_type = message_type
        self._callback = callback
        self._raw = raw
        self._depth = depth
        self._profile: QoSProfile | None = None
        self.topic = node.resolve_topic_name(topic)
        self.subscription: Subscription | None = None
        self.match()

    @property
    def publishers(self) -> int:
        """Number of connected publishers."""
        return int(self.subscription.get_publisher_count()) if self.subscription else 0

    @property
    def several(self) -> str:
        """Message with the publishers of the topic if there are at least two; otherwise ''."""
        names = publisher_names(self._node, self.topic)
        if len(names) < 2:
            return ''
        return f'{len(names)} nodes publish {self.topic}: {", ".join(names)}; stop one'

    def match(self) -> None:
        """Subscribe if the topic has publishers; subscribe again after a change of their QoS."""
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        if not publishers:
            return
        profile = matching(publishers, self._depth)
        if profile == self._profile:
            return
        self.close()
        self._profile = profile
        self.subscription = self._node.create_subscription(
            self._message_type, self.topic, self._callback, profile, raw=self._raw
        )

    def close(self) -> None:
        """End the subscription."""
        if self.subscription is not None:
            self._node.destroy_subscription(self.subscription)
        self.subscription = None
        self._profile = None
