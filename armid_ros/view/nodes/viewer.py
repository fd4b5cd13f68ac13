# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The viewer: joint states, and what the online identifier makes of them, in rerun."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from armid_ros.nodes.listening import ListeningNode
from armid_ros.nodes.messages.joint_states import JointSample
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.qos import DEPTH
from armid_ros.nodes.running.process import run
from armid_ros.robots import load_robot, Robot, robot_from_urdf
from armid_ros.view.live import LiveLog
from armid_ros.view.rerun_log import open_stream
import numpy as np
from sensor_msgs.msg import JointState


class ViewerNode(ListeningNode):
    """
    Shows an arm while it moves.

    Attributes
    ----------
    log : LiveLog, or None
        None until a robot is known.

    """

    table = (
        NodeParameter('robot', '', 'Name or path; empty: robot_description.'),
        NodeParameter('joints', [''], 'Driven joints; without names, all but those of grippers.'),
        NodeParameter('mark', [''], 'Joints to be coloured.'),
        NodeParameter('out', '', 'File to write, .rrd; empty: a window.'),
    )

    def __init__(self, stream: Any = None, **kwargs: Any) -> None:
        """Take the stream to log to; by default a window or a file, as the parameters say."""
        super().__init__('viewer', **kwargs)
        self.log: LiveLog | None = None
        self._stream = stream
        if self.value('robot'):
            self._show(load_robot(self.value('robot'), joints=self._joints()))
        self.listen()
        for topic, kind in (('predicted_joint_states', 'predicted'), ('residual', 'residual')):
            self.create_subscription(
                JointState, f'online_identifier/{topic}', self._on_effort(kind), DEPTH
            )

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Say what is shown."""
        return self.awaited, {'received': self.received}

    def close(self) -> None:
        """Write what is not written yet."""
        if self.log is not None:
            self.log.close()

    def _joints(self) -> tuple[str, ...] | None:
        return tuple(filter(None, self.value('joints'))) or None

    def take_description(self, urdf: str) -> None:
        """Show the robot of the first description."""
        if self.log is None:
            self._show(robot_from_urdf(urdf, joints=self._joints()))

    def take_sample(self, sample: JointSample) -> None:
        """Show a joint state."""
        if self.log is not None:
            self.log.measured(*sample)

    def _on_effort(self, kind: str) -> Callable[[JointState], None]:
        def take(message: JointState) -> None:
            if self.log is None or self.robot is None or message.name != list(self.robot.joints):
                return
            show = self.log.predicted if kind == 'predicted' else self.log.residual
            show(self._time(message), np.array(message.effort))

        return take

    def _time(self, message: JointState) -> float:
        """Return the time of a message as the joint states count it [s]."""
        stamp = message.header.stamp
        zero = self.reader.stamp(0.0).nanoseconds
        return 1e-9 * (stamp.sec * 10**9 + stamp.nanosec - zero)

    def _show(self, robot: Robot) -> None:
        out = Path(self.value('out')) if self.value('out') else None
        stream = self._stream or open_stream(robot.name, out)
        self.adopt(robot)
        self.log = LiveLog(robot, stream, tuple(filter(None, self.value('mark'))))
        for note in self.log.notes:
            self.get_logger().warning(note)


def show_topics(parameters: Mapping[str, Any], namespace: str = '') -> None:
    """
    Show what is on the topics until told to end.

    Parameters
    ----------
    parameters : mapping of str to str or sequence of str
        Of the node, where they are not as by default.
    namespace : str
        Of the topics; empty for none.

    """
    from rclpy.parameter import Parameter

    overrides = [Parameter(name, value=value) for name, value in parameters.items() if value]
    run(lambda: ViewerNode(parameter_overrides=overrides, namespace=namespace), [])
