# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A trajectory controller as the documents of ros2_control describe it, with faults.

It begins a trajectory at its stamp, or at once where the stamp is zero; refuses one whose end is
past, and leaves out the waypoints that are past; replaces what is under way by what comes;
interpolates between waypoints; and stays at the last one. As an action it also refuses joints that
are not its own and ends in motion, aborts a goal that is outside its tolerances or replaced, and
holds the arm where it is when a goal is cancelled. The arm behind it is where it is told to be,
and takes the torque of a model.

"""

from __future__ import annotations

from dataclasses import dataclass
import gc

from armid_ros.arm import ArmModel
from armid_ros.motion import Motion
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.trajectory.messages import read_trajectory
from armid_ros.simulation import Reference
from builtin_interfaces.msg import Time
from control_msgs.action import FollowJointTrajectory
import numpy as np
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

SECOND = 10**9
NAME = 'follow_joint_trajectory'
#: Fastest that a trajectory may end [rad/s]: the resolution of a float.
AT_REST = 1.2e-7


@dataclass
class Faults:
    """
    What is wrong with it.

    Attributes
    ----------
    stuck : int or None
        A joint that stays where it is.
    deaf : bool
        Whether it takes no trajectory any more, and goes on.
    late : float
        Age of the joint states that it publishes [s].
    lost : int
        Every so many of its joint states get lost; 0: none.
    silent : bool
        Whether no joint states come any more.
    torque : float
        Factor on the torques.
    lag : float
        How far the arm is behind what it is told [s].

    """

    stuck: int | None = None
    deaf: bool = False
    late: float = 0.0
    lost: int = 0
    silent: bool = False
    torque: float = 1.0
    lag: float = 0.0


@dataclass
class Goal:
    """A goal of the action, its tolerances by joint, and what became of it."""

    handle: object
    path: np.ndarray
    goal: np.ndarray
    goal_time: float

    def ended(self, how, code=0, text=''):
        """End it: 'succeed', 'abort' or 'canceled'."""

        def finish(handle):
            getattr(handle, how)()
            return FollowJointTrajectory.Result(error_code=code, error_string=text)

        self.handle.execute(finish)


class Controller:
    """
    The controller and the arm behind it, on the clock of a test bench.

    Attributes
    ----------
    accepted, refused : list of JointTrajectory
        What came.
    goals : list of FollowJointTrajectory.Goal
        What was accepted as a goal.
    ends : list of str
        How goals ended.

    """

    def __init__(self, bench, robot, q, quality=LATCHED, *, action=False):
        self.faults = Faults()
        self.accepted, self.refused, self.goals, self.ends = [], [], [], []
        self.now, self.q = 100.0, np.array(q, dtype=float)
        self._bench, self._robot, self._model = bench, robot, ArmModel(robot)
        self._begun, self._curve, self._count, self._goal = 0.0, None, 0, None
        self._publisher = bench.probe.create_publisher(JointState, 'joint_states', 10)
        bench.probe.create_subscription(
            JointTrajectory, 'joint_trajectory', self._on_trajectory, quality
        )
        self._server = None
        if action:
            self._server = ActionServer(
                bench.probe,
                FollowJointTrajectory,
                NAME,
                execute_callback=lambda handle: None,
                goal_callback=self._on_goal,
                handle_accepted_callback=self._on_accepted,
                cancel_callback=self._on_cancel,
            )

    def restart(self):
        """Forget what is under way, and stay where the arm is."""
        self._curve = self._goal = None

    def leave(self):
        """Take the action away, as a controller that is stopped does."""
        if self._server is not None:
            self._server.destroy()
        self._server = self._goal = None
        gc.collect()  # server and goals hold each other, and the action lives as long

    def state(self, t):
        """Return where the arm should be at a time, at rest before and after a trajectory."""
        if self._curve is None:
            n = len(self._robot.joints)
            still = np.zeros((1, n))
            return Motion(self._robot.joints, [t], [self.q], still, still)
        return self._curve.sample(np.array([t - self._begun]))

    def run(self, until, step=0.1):
        """Let time go on, and publish joint states."""
        self._bench.spin_until(self._publisher.get_subscription_count, 'a subscriber')
        while self.now < until - 1e-9:
            self.now = round(self.now + step, 6)
            self._bench.tick(round(self.now * SECOND))
            self._publish()
            self._watch()
            self._bench.settle()

    def _publish(self):
        self._count += 1
        self.q = self._where(self.now, self.q)
        if self.faults.silent or (self.faults.lost and self._count % self.faults.lost == 0):
            return
        t = self.now - self.faults.late
        state, q = self.state(t - self.faults.lag), self._where(t, self.q)
        motion = Motion(self._robot.joints, state.t, q[None], state.dq, state.ddq)
        message = JointState(name=list(self._robot.joints), position=q.tolist())
        message.effort = (self.faults.torque * self._model.joint_torque(motion)[0]).tolist()
        message.header.stamp = stamp_of(t)
        self._publisher.publish(message)

    def _where(self, t, before):
        """Return where the arm is at a time, given where it was before."""
        q = np.array(self.state(t - self.faults.lag).q[0])
        if self.faults.stuck is not None:
            q[self.faults.stuck] = before[self.faults.stuck]
        return q

    def _watch(self):
        """Hold the goal under way against its tolerances, as at every update."""
        goal = self._goal
        if goal is None:
            return
        error = self.state(self.now).q[0] - self.q
        feedback = FollowJointTrajectory.Feedback(joint_names=list(self._robot.joints))
        feedback.header.stamp = stamp_of(self.now)
        feedback.error.positions = error.tolist()
        goal.handle.publish_feedback(feedback)
        left = self._begun + self._curve.duration - self.now
        allowed = goal.path if left > 0.0 else goal.goal
        outside = (np.abs(error) > allowed) & (allowed > 0.0)
        joint = self._robot.joints[int(np.argmax(outside))]
        if left > 0.0:
            if outside.any():
                self._abort(FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED, joint)
        elif not outside.any():
            self._end('succeed')
        elif 0.0 < goal.goal_time < -left:
            self._abort(FollowJointTrajectory.Result.GOAL_TOLERANCE_VIOLATED, joint)

    def _abort(self, code, joint):
        self._curve = None  # the arm is held where it is
        self._end('abort', code, f'{joint} is too far away')

    def _end(self, how, *why):
        self.ends.append(how)
        goal, self._goal = self._goal, None
        goal.ended(how, *why)

    def _on_goal(self, goal):
        joints, points = goal.trajectory.joint_names, goal.trajectory.points
        fits = set(joints) == set(self._robot.joints) and points
        fits = fits and not np.any(np.abs(points[-1].velocities) > AT_REST)
        if self.faults.deaf or not fits or not self._take(goal.trajectory):
            return GoalResponse.REJECT
        self.goals.append(goal)
        return GoalResponse.ACCEPT

    def _on_accepted(self, handle):
        if self._goal is not None:
            self._end('abort', FollowJointTrajectory.Result.INVALID_GOAL, 'replaced')
        request = handle.request
        order = [request.trajectory.joint_names.index(j) for j in self._robot.joints]
        path, goal = (
            np.array([tolerances[k].position for k in order])
            for tolerances in (request.path_tolerance, request.goal_tolerance)
        )
        time = request.goal_time_tolerance
        self._goal = Goal(handle, path, goal, time.sec + 1e-9 * time.nanosec)

    def _on_cancel(self, handle):
        if self.faults.deaf or self._goal is None or handle.goal_id != self._goal.handle.goal_id:
            return CancelResponse.REJECT
        self._curve = None
        goal, self._goal = self._goal, None
        self.ends.append('canceled')
        # once the answer has made it one that is being cancelled
        self._bench.executor.create_task(lambda: goal.ended('canceled'))
        return CancelResponse.ACCEPT

    def _on_trajectory(self, message):
        if not self.faults.deaf:
            self._take(message)

    def _take(self, message):
        reference = read_trajectory(message).for_robot(self._robot)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        begin = stamp or self.now
        if begin + reference.duration < self.now:
            self.refused.append(message)
            return False
        before = self.state(self.now)
        self.accepted.append(message)
        self._curve = left(reference, self.now - begin).after(
            before.q[0], before.dq[0], before.ddq[0]
        )
        self._begun = max(begin, self.now)
        return True


def left(reference, late):
    """Return what is still to come of waypoints, counted from now, or all of a later start."""
    future = reference.t > late
    parts = (None if x is None else x[future] for x in (reference.dq, reference.ddq))
    return Reference(
        reference.joints, reference.t[future] - max(late, 0.0), reference.q[future], *parts
    )


def stamp_of(seconds):
    """Return a time as a stamp."""
    nanoseconds = round(seconds * SECOND)
    return Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)
