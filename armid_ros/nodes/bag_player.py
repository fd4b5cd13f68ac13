# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bag player node: publishes the messages of a bag, in real time or along /clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
import time
from typing import Any

from armid_ros.errors import ArmidError, RecordingError
from armid_ros.excitation.supervision import jump_fault, staleness
from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.messages.classes import message_class
from armid_ros.nodes.parameters.table import NodeParameter, setting
from armid_ros.nodes.qos import offered, STREAM
from armid_ros.nodes.running.process import run
from armid_ros.recording.bag import Bag
from armid_ros.recording.message_types import JOINT_TRAJECTORY
from armid_ros.recording.source import RawMessage
from armid_ros.recording.trajectory import waypoints_of
from armid_ros.robots import robot_from_urdf
import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory


class _JumpGuard:
    """Check that recorded trajectories start at the measured joint positions."""

    def __init__(self, node: ArmidNode) -> None:
        self._node = node
        self.latest: dict[tuple[str, ...], tuple[JointState, float]] = {}
        self._limits: dict[str, float] = {}
        self._states = node.create_subscription(
            JointState, 'joint_states', self._on_joint_states, 10
        )

    def describe(self, cdr: bytes) -> None:
        """Read the velocity limits of the joints from a serialised robot_description."""
        try:
            robot = robot_from_urdf(deserialize_message(cdr, String).data)
        except ArmidError:
            return  # invalid descriptions are reported elsewhere
        self._limits = dict(zip(robot.joints, robot.velocity_limit.tolist(), strict=True))

    def objection(self, cdr: bytes) -> str:
        """Return a message if a serialised trajectory must not be sent; otherwise ''."""
        try:
            reference = waypoints_of(deserialize_message(cdr, JointTrajectory))
        except ArmidError as error:
            return str(error)
        joints, n = reference.joints, len(reference.joints)
        measured, seen = np.full(n, np.nan), np.full(n, -np.inf)
        for message, arrived in self.latest.values():
            known = dict(zip(message.name, message.position, strict=False))
            q = np.array([known.get(joint, np.nan) for joint in joints])
            new = np.isfinite(q)
            measured[new], seen[new] = q[new], arrived
        lost = staleness(joints, seen, time.monotonic(), self._node.value('state_timeout'))
        if lost:
            return f'trajectory: {self._states.topic_name}: {lost}; arm position unknown'
        speeds = reference.dq
        if speeds is None:
            speeds = np.diff(reference.q, axis=0) / np.diff(reference.t)[:, np.newaxis]
        top = np.abs(speeds).max(axis=0, initial=0.0)
        # velocity limits, or for joints without a limit the top speeds of the trajectory
        limits = [self._limits.get(joint, np.inf) for joint in joints]
        fastest = np.where(np.isfinite(limits), limits, top)
        first = (float(reference.t[0]), reference.q[0])
        # largest distance of a joint from the first point [rad or m]
        fault = jump_fault(joints, first, measured, fastest, 0.01)
        return f'trajectory: {fault}; bring the arm to its first point' if fault else ''

    def _on_joint_states(self, message: JointState) -> None:
        names = tuple(message.name)
        stamp = Time.from_msg(message.header.stamp).nanoseconds
        before = self.latest.get(names)
        if before and stamp and stamp == Time.from_msg(before[0].header.stamp).nanoseconds:
            return
        self.latest[names] = (message, time.monotonic())


class BagPlayerNode(ArmidNode):
    """
    Node that publishes the messages of a bag, unchanged.

    A JointTrajectory is sent only if no joint of the arm on joint_states would jump. It is not
    latched, so a controller that starts later does not move the arm. The end of the node does not
    stop the arm.

    If the bag also has joint_states, its trajectories are sent only if no other node publishes
    joint_states. With use_sim_time, the bag is played along the time of /clock.

    Attributes
    ----------
    published : Counter of str
        Number of published messages of each topic.

    """

    table = (
        NodeParameter('bag', '', 'Bag to play: a rosbag2 directory, or a .mcap or .db3 file.'),
        NodeParameter('topics', [''], 'Topics to play; all if empty.'),
        setting(
            'rate', 1.0, 'Bag time per real time, without use_sim_time.', limits=(0.001, 1000.0)
        ),
        setting('loop', False, 'Play again from the beginning at the end of the bag.'),
        setting(
            'clock_rate', 0.0, 'Rate of bag time on /clock; 0: never.', 'Hz', limits=(0.0, 10000.0)
        ),
        setting(
            'subscriber_timeout',
            2.0,
            'How long to wait for a subscriber of every topic, and for joint states of the arm '
            'that follows a trajectory.',
            's',
            limits=(0.0, 3600.0),
        ),
        setting(
            'state_timeout',
            0.5,
            'Largest age of a usable joint state.',
            's',
            limits=(0.01, 60.0),
        ),
    )

    def __init__(self, **kwargs: Any) -> None:
        """Open the bag that the parameter `bag` names."""
        super().__init__('bag_player', **kwargs)
        if not self.value('bag'):
            raise RecordingError("the parameter 'bag' is empty: name a bag with -p bag:=PATH")
        self._bag = Bag(self.value('bag'))
        self._lock_step = bool(self.value('use_sim_time'))
        self.check({'clock_rate': self.value('clock_rate')})
        self._wanted = {self.resolve_topic_name(name) for name in self.value('topics')}
        self._refused = ''
        self._topics = self._make_publishers()
        types = {t.name: t.type_name for t in self._bag.topics() if t.name in self._topics}
        self._trajectories = {n for n, kind in types.items() if kind == JOINT_TRAJECTORY}
        self._descriptions = {n for n in types if n.endswith('robot_description')}
        self._states = self.resolve_topic_name('joint_states')
        self._has_states = any(self.resolve_topic_name(n) == self._states for n in types)
        self._guard = _JumpGuard(self) if self._trajectories else None
        self._messages = self._read_messages()
        self._next: RawMessage | None = None
        self._read_next()
        self._first = self._next.log_time_ns if self._next else 0
        self._position = self._clock_due = self._first
        self._anchor: int | None = None
        self._made = time.monotonic()
        self.published: Counter[str] = Counter()
        self._clock_publisher: Publisher | None = None
        self._set_clock_rate()
        pace = self.get_clock() if self._lock_step else Clock(clock_type=ClockType.STEADY_TIME)
        self._pace = pace
        self._timer = self.create_timer(0.001, self.play, clock=pace)

    @property
    def finished(self) -> bool:
        """Whether all messages of the bag have been published."""
        return self._next is None

    @property
    def failure(self) -> str:
        """Reason why a recorded trajectory was not sent; '' if all trajectories were sent."""
        return self._refused

    @property
    def waiting(self) -> bool:
        """Whether the node waits for subscribers or for /clock."""
        return self._anchor is None and not self.finished

    @property
    def position(self) -> float:
        """Time of the playback since the first message of the bag [s]."""
        return (self._position - self._first) * 1e-9

    def play(self) -> None:
        """Publish all messages up to the present time of the playback."""
        now = self._pace.now().nanoseconds
        if self._anchor is None:
            if (self._lock_step and now == 0) or not self._ready():
                return
            self._anchor = now
        rate = 1.0 if self._lock_step else self.value('rate')
        if now < self._anchor:  # the clock was set back
            self._anchor = now
        self._position += round((now - self._anchor) * rate)
        self._anchor = now
        for _ in range(1000):  # services are answered between the calls of the timer
            if self._next is None or self._next.log_time_ns > self._position:
                break
            self._publish(self._next)
            self._read_next()
            if self._next is None and self.value('loop'):
                self._messages = self._read_messages()
                self._next = next(self._messages, None)
                self._position = self._clock_due = self._first
        if self._clock_publisher is not None and self._clock_period:
            if self._position >= self._clock_due:
                stamp = Time(nanoseconds=self._position).to_msg()
                self._clock_publisher.publish(ClockMessage(clock=stamp))
                self._clock_due = self._position + self._clock_period
        if self.finished:
            self._timer.cancel()

    def check(self, values: Mapping[str, Any]) -> None:
        """Raise a RecordingError if the node would both follow and publish /clock."""
        if self.value('use_sim_time') and values.get('clock_rate'):
            raise RecordingError(
                'a node with use_sim_time follows /clock and cannot publish it: set use_sim_time '
                'or clock_rate, not both'
            )

    def changed(self, names: frozenset[str]) -> None:
        """Apply a changed rate of /clock."""
        if 'clock_rate' in names:
            self._set_clock_rate()

    def _set_clock_rate(self) -> None:
        rate = self.value('clock_rate')
        self._clock_period = int(1e9 / rate) if rate else 0
        if rate and self._clock_publisher is None:
            self._clock_publisher = self.create_publisher(ClockMessage, '/clock', 10)

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return missing subscribers, and values: published messages and playback time."""
        values = {
            'messages': self.published.total(),
            'position': self.position,
        }
        return ('waiting for subscribers' if self.waiting else ''), values

    def close(self) -> None:
        """Close the bag, and wait until sent trajectories have arrived."""
        self._bag.close()
        if self._guard is not None and self.context.ok():
            for topic in self._trajectories:
                self._topics[topic].wait_for_all_acked(Duration(seconds=1.0))

    def _make_publishers(self) -> dict[str, Publisher]:
        topics = {self.resolve_topic_name(t.name): t for t in self._bag.topics()}
        unknown = self._wanted - set(topics)
        if unknown:
            raise RecordingError(
                f'{self._bag.path} has no topic {", ".join(sorted(unknown))}; '
                f'its topics are {", ".join(sorted(topics))}'
            )
        publishers = {}
        for name, topic in topics.items():
            if (self._wanted and name not in self._wanted) or name == '/clock':
                continue
            # a controller that starts later must not move the arm
            moves = topic.type_name == JOINT_TRAJECTORY
            try:
                publishers[topic.name] = self.create_publisher(
                    message_class(topic.type_name),
                    topic.name,
                    STREAM if moves else offered(topic.qos),
                )
            except RecordingError as error:
                self.complaints.add('topic', f'{name} is not played: {error}')
        if not publishers:
            raise RecordingError(f'{self._bag.path}: the bag has no topic that can be played')
        return publishers

    def _read_messages(self) -> Iterator[RawMessage]:
        """Yield the messages of the played topics, from the start of the bag."""
        return (m for m in self._bag.messages() if m.topic in self._topics)

    def _ready(self) -> bool:
        everyone = all(p.get_subscription_count() for p in self._topics.values())
        if self._guard is not None and not self._has_states:
            everyone = everyone and bool(self._guard.latest)
        return everyone or time.monotonic() > self._made + self.value('subscriber_timeout')

    def _publish(self, message: RawMessage) -> None:
        guard = self._guard
        if guard is not None and message.topic in self._descriptions:
            guard.describe(message.cdr)
        if guard is not None and message.topic in self._trajectories:
            publisher = self._topics[message.topic]
            if not self._has_states and not publisher.get_subscription_count():
                self._refused = f'trajectory: no node subscribes to {publisher.topic_name}'
            elif not self._has_states:
                self._refused = guard.objection(message.cdr) or self._refused
            elif self.count_publishers(self._states) > 1:
                self._refused = (
                    f'trajectory: another node publishes {self._states}, as this bag does: the '
                    'arm may not be where the recorded arm was'
                )
            if self._refused:
                self.complaints.add('trajectory', self._refused)
                return
        self._topics[message.topic].publish(message.cdr)
        self.published[message.topic] += 1

    def _read_next(self) -> None:
        """Read the next message; at the end of the bag, log any damage of the bag."""
        self._next = next(self._messages, None)
        if self._next is None and self._bag.damage:
            self.complaints.add('damage', f'{self.value("bag")}: {self._bag.damage}')


main = partial(run, BagPlayerNode)
