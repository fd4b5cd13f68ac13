# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Client of the action of a trajectory controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import time
from typing import Any
from uuid import uuid4

from action_msgs.msg import GoalStatus, GoalStatusArray
from armid_ros.nodes.qos import LATCHED
from builtin_interfaces.msg import Duration
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory
from unique_identifier_msgs.msg import UUID

#: Tolerance that permits any joint position; zero means the default of the controller.
ANYWHERE = -1.0
#: Timeout of the answer to a goal [s]; a controller first checks every waypoint.
_ANSWER = 5.0
#: Error code of an accepted goal that another goal replaced.
_REPLACED = -1
#: Texts of the error codes of control_msgs/action/FollowJointTrajectory.
_ERRORS = {
    _REPLACED: 'the goal is not valid',
    -2: 'the joints are not those of the controller',
    -3: 'the stamp is in the past: where clocks differ, use zero_stamp',
    -4: 'a joint was outside its path tolerance',
    -5: 'the goal was not reached within its tolerance',
}


@dataclass
class _Goal:
    """Goal that was sent, with the time of sending [s] and a flag for cancelling."""

    sent: float
    handle: ClientGoalHandle | None = None
    unwanted: bool = False


class TrajectoryAction:
    """
    The action follow_joint_trajectory of a controller.

    Attributes
    ----------
    name : str
        Full name of the action.
    error : float
        Largest joint error in the last feedback of the controller [rad or m]; NaN before the first
        feedback.

    """

    def __init__(self, node: Any, name: str, on_end: Callable[[str], None]) -> None:
        """
        Make the client; no goal is sent.

        Parameters
        ----------
        node : ArmidNode
            Node of the client.
        name : str
            Name of the action, relative or absolute.
        on_end : callable
            Called at the end of a goal with the reason of its failure; empty if it was reached.

        Raises
        ------
        ImportError
            If the package control_msgs is not installed.

        """
        from control_msgs.action import FollowJointTrajectory
        from control_msgs.msg import JointTolerance

        self.name = node.resolve_topic_name(name)
        self.error = math.nan
        self._node, self._on_end = node, on_end
        self._action, self._tolerance = FollowJointTrajectory, JointTolerance
        self._client = ActionClient(node, FollowJointTrajectory, self.name)
        node.create_subscription(
            GoalStatusArray, f'{self.name}/_action/status', self._on_status, LATCHED
        )
        self._goal: _Goal | None = None
        self._known: set[bytes] = set()
        self._requests: list[Future] = []
        self._seen = -math.inf

    def __str__(self) -> str:
        """Return the name of the receiver for messages."""
        return f'the action {self.name}'

    @property
    def ready(self) -> bool:
        """Return whether a controller accepts goals."""
        return bool(self._client.server_is_ready())

    @property
    def under_way(self) -> bool:
        """Return whether a goal was sent that the controller has not ended."""
        return self._goal is not None

    def send(
        self, trajectory: JointTrajectory, path: float, end: float, late: float = 0.0
    ) -> None:
        """
        Send a goal that replaces the present one.

        A controller of ros2_control replaces the old goal by itself. The old goal is cancelled as
        well, since other controllers do not replace it.

        Parameters
        ----------
        trajectory : JointTrajectory
            Motion for the arm.
        path, end : float
            Tolerance of each joint on the path, and at its end [rad or m]. 0: default of the
            controller, `ANYWHERE`: no limit.
        late : float
            Largest delay of the end [s]; 0: default of the controller.

        """
        before, self._goal = self._goal, _Goal(time.monotonic())
        goal, self.error, self._seen = self._goal, math.nan, time.monotonic()
        message = self._action.Goal(trajectory=trajectory)
        for joint in trajectory.joint_names:
            message.path_tolerance.append(self._tolerance(name=joint, position=path))
            message.goal_tolerance.append(self._tolerance(name=joint, position=end))
        seconds, nanoseconds = divmod(round(late * 1e9), 10**9)
        message.goal_time_tolerance = Duration(sec=seconds, nanosec=nanoseconds)
        identifier = uuid4().bytes
        self._known.add(identifier)
        future = self._client.send_goal_async(
            message,
            goal_uuid=UUID(uuid=list(identifier)),
            feedback_callback=self._guarded(lambda said: self._on_feedback(goal, said)),
        )
        self._ask(future, lambda handle: self._on_answer(goal, handle))
        if before is not None:
            self._cancel(before)

    def trouble(self, patience: float) -> str:
        """Return a text if the controller is gone or does not answer for a time [s]; or empty."""
        goal, now = self._goal, time.monotonic()
        if goal is None:
            return ''
        if self.ready:
            self._seen = now
        if now - self._seen > patience:
            return f'{self.name} is gone: its controller was stopped or restarted'
        if goal.handle is None and now - goal.sent > _ANSWER:
            return f'{self.name} did not answer the goal within {_ANSWER:g} s'
        return ''

    def settle(self, patience: float) -> None:
        """Spin the node until all calls are answered, with a timeout [s]."""
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
        """Destroy the client."""
        self._client.destroy()

    def _cancel(self, goal: _Goal) -> None:
        """Cancel a goal at once, or when it is accepted."""
        goal.unwanted = True
        if goal.handle is not None:
            self._ask(goal.handle.cancel_goal_async(), lambda _: None)

    def _on_answer(self, goal: _Goal, handle: ClientGoalHandle) -> None:
        if not handle.accepted:
            reason = 'see its log; its joints and clock have to be those of this node'
            self._end(goal, f'{self.name} refused the trajectory; {reason}')
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
        elif status == GoalStatus.STATUS_CANCELED or result.error_code == _REPLACED:
            self._end(goal, self._taken_over())
        else:
            why = _ERRORS.get(result.error_code, 'without a reason')
            detail = f' ({result.error_string})' if result.error_string else ''
            self._end(goal, f'{self.name} gave up the trajectory: {why}{detail}')

    def _on_status(self, message: GoalStatusArray) -> None:
        """End the present goal if the controller has accepted a later one."""
        active = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING)
        goals = {
            bytes(s.goal_info.goal_id.uuid) for s in message.status_list if s.status in active
        }
        goal = self._goal
        if goal is None or goal.handle is None:
            self._known |= goals
        elif goals - self._known:
            self._end(goal, self._taken_over())

    def _taken_over(self) -> str:
        """Return a text that the goal was replaced by another client, with its name."""
        node, service = self._node, f'{self.name}/_action/send_goal'
        found = []
        for name, space in node.get_node_names_and_namespaces():
            if (name, space) == (node.get_name(), node.get_namespace()):
                continue
            clients = node.get_client_names_and_types_by_node(name, space)
            if any(client == service for client, _ in clients):
                found.append(f'{space.rstrip("/")}/{name}')
        who = ', '.join(sorted(found)) or 'another client'
        return f'the goal of {self.name} was cancelled or replaced by {who}'

    def _end(self, goal: _Goal, reason: str) -> None:
        if goal is self._goal:
            self._goal = None
            self._on_end(reason)

    def _on_feedback(self, goal: _Goal, message: Any) -> None:
        if goal is self._goal:
            errors = [abs(error) for error in message.feedback.error.positions]
            self.error = max(errors, default=math.nan)

    def _ask(self, future: Future, then: Callable[[Any], None]) -> None:
        def done(future: Future) -> None:
            self._requests.remove(future)
            then(future.result())

        self._requests.append(future)
        future.add_done_callback(self._guarded(done))

    def _guarded(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        guarded: Callable[[Any], None] = self._node.surviving(callback, self.name)
        return guarded


def beside(topic: str) -> str:
    """Return the name of the action in the namespace of a topic joint_trajectory."""
    return f'{topic.rpartition("/")[0]}/follow_joint_trajectory'
