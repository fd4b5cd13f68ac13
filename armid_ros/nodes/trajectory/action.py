# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory controller as an action: goals that it accepts, reports on, and can be stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import time
from typing import Any
from uuid import uuid4

from action_msgs.msg import GoalStatus, GoalStatusArray
from armid_ros.nodes.complaints import surviving
from armid_ros.nodes.qos import LATCHED
from builtin_interfaces.msg import Duration
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory
from unique_identifier_msgs.msg import UUID

#: What a tolerance is that lets a joint be wherever it is; zero leaves it to the controller.
ANYWHERE = -1.0
#: How often it is looked whether a controller is known [s].
_GLANCE = 0.005
#: How long an answer to a goal may take [s]: a controller checks every waypoint before.
_ANSWER = 5.0
#: Error code of a goal that another one replaced, once it was accepted.
_REPLACED = -1
#: What control_msgs/action/FollowJointTrajectory calls its error codes.
_ERRORS = {
    _REPLACED: 'the goal is not valid',
    -2: 'the joints are not those of the controller',
    -3: 'the stamp is in the past: where clocks differ, use zero_stamp',
    -4: 'a joint was outside its path tolerance',
    -5: 'the goal was not reached within its tolerance',
}


@dataclass
class _Goal:
    """A goal that was sent: since when it is unanswered [s], and whether it is to be cancelled."""

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
        Largest distance of a joint from where the controller wants it, of the last feedback
        [rad or m]; NaN before.

    """

    def __init__(self, node: Any, name: str, on_end: Callable[[str], None]) -> None:
        """
        Look for the action; nothing is sent.

        Parameters
        ----------
        node : ArmidNode
            Whose executor brings the answers.
        name : str
            Of the action, relative to the namespace of the node or not.
        on_end : callable
            Told why the goal under way ended before it was reached; empty when it was reached.

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
        """Say what is sent to."""
        return f'the action {self.name}'

    @property
    def ready(self) -> bool:
        """Whether there is a controller that takes goals."""
        return bool(self._client.server_is_ready())

    def wait(self, patience: float) -> None:
        """Wait until a controller that offers it is known, at most a time [s]."""
        deadline = time.monotonic() + patience
        while not self.ready and time.monotonic() < deadline:
            time.sleep(_GLANCE)

    @property
    def under_way(self) -> bool:
        """Whether a goal was sent that the controller has not ended."""
        return self._goal is not None

    def send(
        self, trajectory: JointTrajectory, path: float, end: float, late: float = 0.0
    ) -> None:
        """
        Send a goal in the place of the one under way.

        A controller of ros2_control goes from the old goal to the new one; the old one is
        cancelled all the same, for others do not.

        Parameters
        ----------
        trajectory : JointTrajectory
            What the arm shall do.
        path, end : float
            Tolerance of each joint on the way, and at its end [rad or m]; 0 leaves it to the
            controller, `ANYWHERE`: none.
        late : float
            How long after its time the end may be reached [s]; 0 leaves it to the controller.

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
        """Say that the controller has been gone for a time [s], or is silent; empty: neither."""
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
        """Wait until all is answered, at most a time [s], where nobody spins the node any more."""
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
        """End the client."""
        self._client.destroy()

    def _cancel(self, goal: _Goal) -> None:
        """Cancel a goal, or as soon as it is accepted."""
        goal.unwanted = True
        if goal.handle is not None:
            self._ask(goal.handle.cancel_goal_async(), lambda _: None)

    def _on_answer(self, goal: _Goal, handle: ClientGoalHandle) -> None:
        if not handle.accepted:
            reason = 'see its log; its joints and clock have to be those of this node'
            self._end(goal, f'{self.name} refused the trajectory; {reason}')
            return
        goal.handle = handle
        # not among what `settle` waits for: it comes when the arm is there
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
        """End the goal under way where the controller has accepted another one since."""
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
        """Return that the controller is another client's, and whose."""
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
        return surviving(callback, self.name, self._node)


def beside(topic: str) -> str:
    """Return the action that a controller has beside its topic joint_trajectory."""
    return f'{topic.rpartition("/")[0]}/follow_joint_trajectory'
