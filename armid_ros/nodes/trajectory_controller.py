# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Send trajectories to a controller: as goals of an action if it offers one, else by topic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import time
from typing import Any
from uuid import uuid4

from action_msgs.msg import GoalStatus, GoalStatusArray
from armid_ros.errors import TrajectoryError
from armid_ros.motion import Motion
from armid_ros.nodes.qos import LATCHED, publisher_names, STREAM
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from unique_identifier_msgs.msg import UUID

#: Tolerance that permits any joint position; 0 means the default of the controller.
NO_TOLERANCE = -1.0
#: Timeout of the answer to a goal [s]; a controller first checks every waypoint.
_ANSWER_TIMEOUT = 5.0
#: Messages for the error codes of control_msgs/action/FollowJointTrajectory.
_ERRORS = {
    -1: 'the goal is not valid',
    -2: 'the joints are not those of the controller',
    -3: 'the stamp is in the past: where clocks differ, use zero_stamp',
    -4: 'a joint was outside its path tolerance',
    -5: 'the goal was not reached within its tolerance',
}


def write_trajectory(motion: Motion) -> JointTrajectory:
    """Convert a motion to a JointTrajectory message with one waypoint per sample."""
    message = JointTrajectory(joint_names=list(motion.joints))
    for row, t in enumerate(motion.t):
        message.points.append(
            JointTrajectoryPoint(
                positions=motion.q[row].tolist(),
                velocities=motion.dq[row].tolist(),
                accelerations=motion.ddq[row].tolist(),
                time_from_start=Duration(nanoseconds=round(float(t) * 1e9)).to_msg(),
            )
        )
    return message


@dataclass
class _Goal:
    """Goal for the controller: time of sending [s], handle, and whether to cancel the goal."""

    sent: float
    handle: ClientGoalHandle | None = None
    unwanted: bool = False


class TrajectoryController:
    """
    Client that sends trajectories to one controller, as action goals or messages.

    All trajectories of a run use the same interface.

    Attributes
    ----------
    topic : str
        Full name of the topic.
    action : str
        Full name of the action.
    client : ActionClient or None
        None if only the topic is used, or control_msgs is not installed.
    taken : bool
        Whether another client has sent a goal since the last one of this node.

    """

    def __init__(self, node: Any, on_end: Callable[[str], None]) -> None:
        """
        Create publisher and action client.

        Parameters
        ----------
        node : ArmidNode
            Node with the parameters `interface`, `action`, `zero_stamp` and the tolerances.
        on_end : callable
            Called at the end of a goal with the reason of its failure; empty after success.

        Raises
        ------
        TrajectoryError
            If the action is required and control_msgs is not installed.

        """
        self._publisher = node.create_publisher(JointTrajectory, 'joint_trajectory', STREAM)
        self.topic = str(self._publisher.topic_name)
        default = f'{self.topic.rpartition("/")[0]}/follow_joint_trajectory'
        self.action = node.resolve_topic_name(node.value('action') or default)
        self.client: ActionClient | None = None
        self._node, self._on_end = node, on_end
        self._kind = node.value('interface')
        self._by_action = False
        self._goal: _Goal | None = None
        self.taken = False
        self._error, self._seen = math.nan, -math.inf
        self._known: set[bytes] = set()
        self._requests: list[Future] = []
        if self._kind != 'topic':
            self._make_client()
        if self._kind == 'action' and self.client is None:
            raise TrajectoryError(
                "the parameter 'interface' is action, but the package control_msgs is not "
                'installed: apt install ros-jazzy-control-msgs, or use interface:=topic'
            )

    @property
    def readers(self) -> int:
        """Number of subscribers to the topic joint_trajectory."""
        return int(self._publisher.get_subscription_count())

    @property
    def _rivals(self) -> str:
        """Text that names other nodes that publish trajectories on the topic; otherwise ''."""
        names = {*publisher_names(self._node, self.topic)}
        others = ', '.join(sorted(names - {self._node.get_fully_qualified_name()}))
        return f'; {others} can also move the arm by {self.topic}' if others else ''

    @property
    def missing(self) -> str:
        """Message if no controller, or more than one, can receive a trajectory; otherwise ''."""
        servers = self._servers if self.client is not None else 0
        if servers > 1:  # a goal would move the arms of all
            return f'{servers} controllers offer the action {self.action}: stop the others'
        if self._ready:
            return ''
        if self._kind == 'action':
            return f'no controller offers the action {self.action}'
        return '' if self.readers else f'no node subscribes to {self.topic}'

    @property
    def under_way(self) -> bool:
        """Whether the controller still executes an action goal of this node."""
        return self._by_action and self._goal is not None

    @property
    def error(self) -> float:
        """Largest tracking error that the controller reported [rad or m]; NaN without report."""
        return self._error if self.under_way else math.nan

    def discover(self) -> None:
        """
        Wait up to one second for a controller that accepts goals.

        Raises
        ------
        TrajectoryError
            If no controller can receive a trajectory.

        """
        if self.client is not None and self._servers:
            deadline = time.monotonic() + 1.0  # the discovery of an action takes at most this long
            while not self._ready and time.monotonic() < deadline:
                time.sleep(0.005)
        if self.missing:
            raise TrajectoryError(f'the arm is not started: {self.missing}')

    def begin(self, trajectory: JointTrajectory) -> str:
        """Send the trajectory of a run; return the name of the receiver."""
        self._by_action = self._ready
        if self._by_action:
            names = ('tracking_tolerance', 'goal_tolerance', 'goal_time_tolerance')
            self._send_goal(trajectory, *map(self._node.value, names))
            return f'the action {self.action}{self._rivals}'
        self._publisher.publish(trajectory)
        return f'{self.readers} subscribers{self._rivals}'

    def send_stop(self, trajectory: JointTrajectory, again: bool = False) -> None:
        """Send a stop by the interface of the run; send a repeated stop also as a message."""
        if self._by_action:
            self._send_goal(trajectory, NO_TOLERANCE, NO_TOLERANCE)
        if again or not self._by_action:
            self._publisher.publish(trajectory)

    def trouble(self, patience: float) -> str:
        """Return a message if the action is gone for `patience` [s] or did not answer; else ''."""
        goal, now = self._goal, time.monotonic()
        if goal is None or not self._by_action:
            return ''
        if self._ready:
            self._seen = now
        if now - self._seen > patience:
            return f'the controller of {self.action} was stopped or restarted'
        if goal.handle is None and now - goal.sent > _ANSWER_TIMEOUT:
            return f'{self.action} did not answer the goal within {_ANSWER_TIMEOUT:g} s'
        return ''

    def settle(self, patience: float) -> None:
        """Wait up to `patience` [s] until messages have arrived and calls are answered."""
        if not self._by_action:
            self._publisher.wait_for_all_acked(Duration(seconds=patience))
            return
        executor = SingleThreadedExecutor(context=self._node.context)
        before, deadline = self._node.executor, time.monotonic() + patience
        executor.add_node(self._node)
        try:
            while self._requests and time.monotonic() < deadline:
                executor.spin_once(timeout_sec=max(deadline - time.monotonic(), 0.0))
        finally:
            executor.remove_node(self._node)
            executor.shutdown()
            if before is not None:
                before.add_node(self._node)

    def close(self) -> None:
        """Destroy the action client."""
        if self.client is not None:
            self.client.destroy()

    @property
    def _servers(self) -> int:
        """Number of controllers that offer the action."""
        return int(self._node.count_publishers(f'{self.action}/_action/feedback'))

    @property
    def _ready(self) -> bool:
        return self.client is not None and bool(self.client.server_is_ready())

    def _make_client(self) -> None:
        """Create the action client if control_msgs is installed."""
        try:
            from control_msgs.action import FollowJointTrajectory
            from control_msgs.msg import JointTolerance
        except ImportError:
            return
        self._kind_of_goal, self._tolerance = FollowJointTrajectory.Goal, JointTolerance
        self.client = ActionClient(self._node, FollowJointTrajectory, self.action)
        self._node.create_subscription(
            GoalStatusArray, f'{self.action}/_action/status', self._on_status, LATCHED
        )

    def _send_goal(
        self, trajectory: JointTrajectory, path: float, end: float, late: float = 0.0
    ) -> None:
        """
        Send an action goal that replaces the present goal.

        Controllers of ros2_control replace the old goal. It is also cancelled, because other
        controllers do not replace it.

        Parameters
        ----------
        trajectory : JointTrajectory
            Motion for the arm.
        path, end : float
            Tolerance of each joint on the path, and at its end [rad or m]. 0: default of the
            controller, `NO_TOLERANCE`: no limit.
        late : float
            Largest delay of the end [s]; 0: default of the controller.

        """
        assert self.client is not None
        before, self._goal = self._goal, _Goal(time.monotonic())
        goal, self._error, self._seen = self._goal, math.nan, time.monotonic()
        self.taken = False
        message = self._kind_of_goal(trajectory=trajectory)
        for joint in trajectory.joint_names:
            message.path_tolerance.append(self._tolerance(name=joint, position=path))
            message.goal_tolerance.append(self._tolerance(name=joint, position=end))
        message.goal_time_tolerance = Duration(nanoseconds=round(late * 1e9)).to_msg()
        identifier = uuid4().bytes
        self._known.add(identifier)
        future = self.client.send_goal_async(
            message,
            goal_uuid=UUID(uuid=list(identifier)),
            feedback_callback=self._guarded(lambda message: self._on_feedback(goal, message)),
        )
        self._await(future, lambda handle: self._on_answer(goal, handle))
        if before is not None:
            self._cancel(before)

    def _cancel(self, goal: _Goal) -> None:
        """Cancel a goal now, or once the controller accepts it."""
        goal.unwanted = True
        if goal.handle is not None:
            self._await(goal.handle.cancel_goal_async(), lambda _: None)

    def _on_answer(self, goal: _Goal, handle: ClientGoalHandle) -> None:
        if not handle.accepted:
            reason = 'see its log; its joints and clock have to be those of this node'
            self._end(goal, f'{self.action} refused the trajectory; {reason}')
            return
        goal.handle = handle
        # `settle` does not wait for the result, which comes at the end of the motion
        result = handle.get_result_async()
        result.add_done_callback(self._guarded(lambda f: self._on_result(goal, f.result())))
        if goal.unwanted:
            self._cancel(goal)

    def _on_result(self, goal: _Goal, response: Any) -> None:
        status, result = response.status, response.result
        if status == GoalStatus.STATUS_SUCCEEDED and not result.error_code:
            self._end(goal, '')
        elif status == GoalStatus.STATUS_CANCELED or result.error_code == -1:  # replaced
            self._end(goal, self._replacement_message())
        else:
            why = _ERRORS.get(result.error_code, 'without a reason')
            detail = f' ({result.error_string})' if result.error_string else ''
            self._end(goal, f'{self.action} gave up the trajectory: {why}{detail}')

    def _on_status(self, message: GoalStatusArray) -> None:
        """End the present goal if the controller has accepted a later goal of another client."""
        active = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING)
        goals = {
            bytes(s.goal_info.goal_id.uuid) for s in message.status_list if s.status in active
        }
        goal, new = self._goal, goals - self._known
        if goal is None or goal.handle is None:
            self._known |= goals
            self.taken = self.taken or (goal is None and bool(new))
        elif new:
            self.taken = True
            self._end(goal, self._replacement_message())

    def _replacement_message(self) -> str:
        """Return a message that names the clients that may have replaced the goal."""
        node, service = self._node, f'{self.action}/_action/send_goal'
        found = []
        for name, space in node.get_node_names_and_namespaces():
            if (name, space) == (node.get_name(), node.get_namespace()):
                continue
            clients = node.get_client_names_and_types_by_node(name, space)
            if any(client == service for client, _ in clients):
                found.append(f'{space.rstrip("/")}/{name}')
        names = ', '.join(sorted(found)) or 'another client'
        return f'the goal of {self.action} was cancelled or replaced by {names}'

    def _end(self, goal: _Goal, reason: str) -> None:
        if goal is self._goal:
            self._goal = None
            self._on_end(reason)

    def _on_feedback(self, goal: _Goal, message: Any) -> None:
        if goal is self._goal:
            errors = [abs(error) for error in message.feedback.error.positions]
            self._error = max(errors, default=math.nan)

    def _await(self, future: Future, then: Callable[[Any], None]) -> None:
        def done(future: Future) -> None:
            self._requests.remove(future)
            then(future.result())

        self._requests.append(future)
        future.add_done_callback(self._guarded(done))

    def _guarded(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a callback whose exceptions are logged and stop the arm."""
        guarded: Callable[[Any], None] = self._node.guarded(callback, self.action)
        return guarded
