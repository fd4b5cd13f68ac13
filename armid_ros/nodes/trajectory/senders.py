# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Send trajectories to a controller by its action if available, else by topic."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.nodes.qos import STREAM
from armid_ros.nodes.trajectory.action import ANYWHERE, beside, TrajectoryAction
from rclpy.duration import Duration
from trajectory_msgs.msg import JointTrajectory


class TrajectorySenders:
    """
    Topic and action of one controller; a run uses the same one until its end.

    Attributes
    ----------
    topic : str
        Full name of the topic.
    action : TrajectoryAction or None
        None if only the topic is used, no controller has offered the action so far, or
        control_msgs is not installed.

    """

    def __init__(self, node: Any, on_end: Callable[[str], None]) -> None:
        """
        Make the publisher, and look for the action.

        Parameters
        ----------
        node : ArmidNode
            With the parameters `interface`, `action` and `zero_stamp`, and tolerances.
        on_end : callable
            Called at the end of a goal with the reason of its failure; empty if it was reached.

        Raises
        ------
        TrajectoryError
            If the action is required and control_msgs is not installed.

        """
        self._publisher = node.create_publisher(JointTrajectory, 'joint_trajectory', STREAM)
        self.topic = str(self._publisher.topic_name)
        self._node, self._on_end = node, on_end
        self._kind = node.value('interface')
        self._name = node.resolve_topic_name(node.value('action') or beside(self.topic))
        self.action: TrajectoryAction | None = None
        self._by_action, self._possible = False, self._kind != 'topic'
        if self._kind == 'action':
            self._make_action()
            if self.action is None:
                raise TrajectoryError(
                    "parameter 'interface' is action, but the package control_msgs is not "
                    'installed: apt install ros-jazzy-control-msgs, or use interface:=topic'
                )

    @property
    def readers(self) -> int:
        """Return the number of subscriptions to the topic."""
        return int(self._publisher.get_subscription_count())

    @property
    def missing(self) -> str:
        """Return why no controller can receive a trajectory; empty if one can."""
        if self._has_action:
            return ''
        if self._kind == 'action':
            return f'no controller offers the action {self._name}'
        return '' if self.readers else f'no node subscribes to {self.topic}'

    @property
    def under_way(self) -> bool:
        """Return whether a goal was sent that the controller has not ended."""
        return self._by_action and self.action.under_way

    @property
    def error(self) -> float:
        """Return the largest joint error that the controller reported [rad or m]; or NaN."""
        return float(self.action.error) if self.under_way else float('nan')

    def look(self) -> None:
        """Make a client of the action when a controller offers it."""
        if self._possible and self.action is None and self._offered:
            self._make_action()

    def begin(self, trajectory: JointTrajectory) -> str:
        """
        Send the trajectory of a run, and return the name of the receiver.

        Raises
        ------
        TrajectoryError
            If no controller can receive the trajectory.

        """
        self.look()
        if self.action is not None and self._offered:
            deadline = time.monotonic() + 1.0  # the discovery of an action takes no longer
            while not self.action.ready and time.monotonic() < deadline:
                time.sleep(0.005)
        if self.missing:
            raise TrajectoryError(f'{self.missing}; the arm is not started')
        self._by_action = self._has_action
        if self._by_action:
            names = ('tracking_tolerance', 'goal_tolerance', 'goal_time_tolerance')
            self.action.send(trajectory, *map(self._node.value, names))
            return str(self.action)
        self._publisher.publish(trajectory)
        return f'{self.readers} subscribers'

    def bring_to_rest(self, trajectory: JointTrajectory) -> None:
        """Send the trajectory that stops a run, without tolerances."""
        if self._by_action:
            self.action.send(trajectory, ANYWHERE, ANYWHERE)
        else:
            self._publisher.publish(trajectory)

    def insist(self, trajectory: JointTrajectory) -> None:
        """Send a trajectory to the controller of the present run, by action and by topic."""
        self.bring_to_rest(trajectory)
        if self._by_action:
            self._publisher.publish(trajectory)

    def trouble(self, patience: float) -> str:
        """Return the problem of the controller that lasts longer than a time [s]; or empty."""
        return self.action.trouble(patience) if self._by_action else ''

    def settle(self, patience: float) -> None:
        """Wait until sent messages have arrived, with a timeout [s]."""
        if self._by_action:
            self.action.settle(patience)
        else:
            self._publisher.wait_for_all_acked(Duration(seconds=patience))

    def close(self) -> None:
        """Close the client of the action."""
        if self.action is not None:
            self.action.close()

    def _make_action(self) -> None:
        try:
            self.action = TrajectoryAction(self._node, self._name, self._on_end)
        except ImportError:
            self._possible = False

    @property
    def _offered(self) -> bool:
        return bool(self._node.count_publishers(f'{self._name}/_action/feedback'))

    @property
    def _has_action(self) -> bool:
        return self.action is not None and self.action.ready
