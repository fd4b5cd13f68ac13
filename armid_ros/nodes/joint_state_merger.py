# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joint state merger node: merges positions and torques of several topics into one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
import math
from typing import Any

from armid_ros.errors import RecordingError
from armid_ros.identification.samples.joint_merge import JointMerger
from armid_ros.motion import FloatArray
from armid_ros.nodes.base import ArmidNode, LOOK_PERIOD
from armid_ros.nodes.messages.classes import message_class
from armid_ros.nodes.parameters.table import NodeParameter, ParameterError
from armid_ros.nodes.qos import LATCHED, MatchedSubscription, SAMPLES
from armid_ros.nodes.running.process import run
from armid_ros.recording.columns import per_joint
from armid_ros.robots import robot_from_urdf
import numpy as np
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String

#: Types of messages that hold torques.
_EFFORTS = (
    'sensor_msgs/msg/JointState',
    'control_msgs/msg/DynamicJointState',
    'std_msgs/msg/Float64MultiArray',
)


class JointStateMergerNode(ArmidNode):
    """
    Node that merges joint states and torques of several topics into one topic.

    Positions may come from several topics, each with some of the joints. Torques may come from a
    separate topic, as efforts or as currents that are multiplied by gains. All values are
    interpolated at the stamps of the position of the first joint.

    """

    table = (
        NodeParameter(
            'joints',
            [''],
            'Joints to publish, in this order; empty: the driven joints of robot_description.',
        ),
        NodeParameter(
            'position_topics', ['joint_states'], 'JointState topics with positions of joints.'
        ),
        NodeParameter(
            'effort_topic',
            '',
            'Topic with torques or currents: JointState, control_msgs/DynamicJointState such as '
            'dynamic_joint_states, or std_msgs/Float64MultiArray with one number a joint; empty: '
            'the effort of the position topics.',
        ),
        NodeParameter(
            'effort_interface', 'effort', 'DynamicJointState interface, such as effort or current.'
        ),
        NodeParameter(
            'effort_joints',
            [''],
            'Names of the joints on effort_topic, in the order of joints; empty: the '
            'names in joints.',
        ),
        NodeParameter(
            'gains',
            [1.0],
            'Torque per unit of the received values, N m/A for currents: one for all joints, or '
            'one per joint; negative for an opposite sign.',
        ),
    )

    def __init__(self, **kwargs: Any) -> None:
        """Create the node; `kwargs` are the arguments of rclpy's Node."""
        super().__init__('joint_state_merger', **kwargs)
        self.joints: tuple[str, ...] = ()
        self._published = 0
        self._lag_ns, self._epoch_ns = 0, 0
        self._efforts: MatchedSubscription | None = None
        self._states = self.create_publisher(JointState, '~/joint_states', SAMPLES)
        self._topics = self.value('position_topics')
        if not self._topics:
            raise ParameterError("the parameter 'position_topics' is empty: name a topic")
        own = not self.value('effort_topic')
        self._positions = [
            MatchedSubscription(self, JointState, topic, partial(self._on_positions, own))
            for topic in self._topics
        ]
        if self.value('joints'):
            self._set_joints(self.value('joints'))
        else:
            self.create_subscription(
                String,
                'robot_description',
                lambda message: self._set_joints(robot_from_urdf(message.data).joints),
                LATCHED,
            )
        self.create_steady_timer(LOOK_PERIOD, self.poll)

    def poll(self) -> None:
        """Subscribe to those input topics that have publishers."""
        for subscription in self._positions:
            subscription.match()
        topic = self.value('effort_topic')
        if self._efforts is not None:
            self._efforts.match()
        elif topic and self.joints:
            full = self.resolve_topic_name(topic)
            types = dict(self.get_topic_names_and_types()).get(full, [])
            if types:
                if types[0] not in _EFFORTS:
                    raise RecordingError(
                        f'{full} has the type {types[0]}, which contains no torques; use one of '
                        f'{", ".join(_EFFORTS)}'
                    )
                self._efforts = MatchedSubscription(
                    self, message_class(types[0]), topic, self._on_efforts
                )

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return a message on joints without data, and the number of published messages."""
        values: dict[str, object] = {'published': self._published}
        if not self.joints:
            return 'waiting for robot_description', values
        if self._published:
            return '', values
        n = len(self.joints)
        missing = self._merger.missing
        positions = [self.joints[k] for k in missing if k < n]
        torques = [self.joints[k - n] for k in missing if k >= n]
        lacking = [
            f'no {kind} of {", ".join(joints)} so far'
            for kind, joints in (('position', positions), ('torque', torques))
            if joints
        ]
        return '; '.join(lacking) or 'the senders do not share their time', values

    def _set_joints(self, joints: Sequence[str]) -> None:
        if tuple(joints) == self.joints:
            return
        others = self.value('effort_joints')
        if len(others) not in (0, len(joints)):
            raise ParameterError(
                f"the parameter 'effort_joints' has {len(others)} names, but there are "
                f'{len(joints)} joints: {", ".join(joints)}'
            )
        self._gains = per_joint(self.value('gains'), joints, "parameter 'gains'")
        self.joints = tuple(joints)
        self._effort_names = others or self.joints
        self._merger = JointMerger(2 * len(joints))  # first positions, then torques

    def _on_positions(self, with_effort: bool, message: JointState) -> None:
        stamp = self._stamp_ns(message.header.stamp)
        if not self.joints:
            return
        self._lag_ns = self.get_clock().now().nanoseconds - stamp
        rows = {
            name: (position, velocity)
            for name, position, velocity in zip(
                message.name,
                message.position,
                message.velocity or [math.nan] * len(message.name),
                strict=False,
            )
            if math.isfinite(position)
        }
        some = tuple(k for k, joint in enumerate(self.joints) if joint in rows)
        if some:
            self._merge(some, stamp, np.array([rows[self.joints[k]] for k in some]).T)
        if with_effort and message.effort:
            known = dict(zip(message.name, message.effort, strict=False))
            self._merge_torques(stamp, known, self.joints)

    def _on_efforts(self, message: Any) -> None:
        header = getattr(message, 'header', None)
        now = self.get_clock().now().nanoseconds - self._lag_ns
        stamp = now if header is None else self._stamp_ns(header.stamp)
        if hasattr(message, 'interface_values'):
            interface, parts = self.value('effort_interface'), message.interface_values
            known = {
                joint: part.values[list(part.interface_names).index(interface)]
                for joint, part in zip(message.joint_names, parts, strict=False)
                if interface in part.interface_names
            }
            if not known:
                there = sorted({name for part in parts for name in part.interface_names})
                raise RecordingError(
                    f"no joint of effort_topic has the interface '{interface}'; set "
                    f'effort_interface to {" or ".join(there)}'
                )
        else:
            names, values = self._effort_names, getattr(message, 'data', None)
            if isinstance(message, JointState):
                names, values = message.name, message.effort
            if len(values) != len(names):
                raise RecordingError(
                    f'a message of effort_topic has {len(values)} values for {len(names)} '
                    f'joints: {", ".join(names)}'
                )
            known = dict(zip(names, values, strict=True))
        self._merge_torques(stamp, known, self._effort_names)

    def _merge_torques(
        self, stamp: int, known: Mapping[str, float], called: Sequence[str]
    ) -> None:
        """Merge the torques or currents of the joints named `called`, measured at `stamp` [ns]."""
        n = len(self.joints)
        some = [k for k, name in enumerate(called) if math.isfinite(known.get(name, math.nan))]
        if not some:
            raise RecordingError(
                f'torques were received for {", ".join(known)}, but not for the joints '
                f'{", ".join(called)}; correct the parameter effort_joints or joints'
            )
        torques = np.array([known[called[k]] for k in some]) * self._gains[some]
        self._merge(tuple(n + k for k in some), stamp, np.vstack([torques, torques]))

    def _merge(self, signals: tuple[int, ...], stamp: int, values: FloatArray) -> None:
        """Merge new values of signals (n positions, then n torques); publish complete samples."""
        n = len(self.joints)
        # a float has too few digits for seconds since 1970
        self._epoch_ns = self._epoch_ns or stamp
        for t, merged in self._merger.take(signals, (stamp - self._epoch_ns) * 1e-9, values):
            q, dq, tau = merged[0, :n], merged[1, :n], merged[0, n:]
            message = JointState(name=list(self.joints), position=q.tolist(), effort=tau.tolist())
            if np.isfinite(dq).all():
                message.velocity = dq.tolist()
            message.header.stamp = Time(nanoseconds=self._epoch_ns + round(t * 1e9)).to_msg()
            self._states.publish(message)
            self._published += 1

    def _stamp_ns(self, stamp: Any) -> int:
        """Return the time stamp of a message [ns], or the present time if the stamp is zero."""
        return stamp.sec * 10**9 + stamp.nanosec or self.get_clock().now().nanoseconds


main = partial(run, JointStateMergerNode)
