# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Doubles of ros2_control's trajectory controller and joint state broadcaster, with faults.

They follow the sources of joint_trajectory_controller (JTC) and joint_state_broadcaster (JSB) of
ROS 2 Jazzy with position commands. Each behaviour names its function in the repository
ros-controls/ros2_controllers: JTC.x is a method of src/joint_trajectory_controller.cpp of
joint_trajectory_controller, Trajectory.x of its src/trajectory.cpp, tolerances of its
tolerances.hpp, and JSB.x of joint_state_broadcaster/src/joint_state_broadcaster.cpp.

The arm behind them is where it is commanded to be, and takes the torque of a model.

"""

from dataclasses import dataclass
import gc

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.motion import Motion
from armid_ros.nodes.qos import STREAM
from armid_ros.recording.trajectory import waypoints_of
from builtin_interfaces.msg import Time
from control_msgs.action import FollowJointTrajectory
import numpy as np
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import GoalEvent
from scipy.interpolate import BPoly
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

SECOND = 10**9
NAME = 'follow_joint_trajectory'
#: Fastest that a trajectory may end [rad/s]; JTC.validate_trajectory_msg: the epsilon of a float.
AT_REST = 1.2e-7
#: Time between results and feedback [s]; JTC.goal_accepted_callback: action_monitor_rate, 20 Hz.
MONITOR = 0.05
Result = FollowJointTrajectory.Result


@dataclass
class Faults:
    """
    Faults of the arm, of its driver and of the controller.

    Attributes
    ----------
    stuck : int or None
        A joint that stays where it is.
    deaf : bool
        Whether no trajectory is taken any more, and the arm goes on.
    late : float
        Age of the joint states that are published [s].
    lost : int
        Every so many joint states get lost; 0: none.
    silent : bool
        Whether no joint states come any more.
    torque : float
        Factor on the torques.
    lag : float
        Delay of the arm behind its command [s].
    overdue : bool
        Whether a replaced goal gets its result with the end of the next one, as canceled: all
        releases before the pull request 2422 of June 2026 (issue 1519 of ros2_controllers).

    """

    stuck: int | None = None
    deaf: bool = False
    late: float = 0.0
    lost: int = 0
    silent: bool = False
    torque: float = 1.0
    lag: float = 0.0
    overdue: bool = False


@dataclass
class Goal:
    """A goal of the action, its tolerances by joint, and what the next monitoring sends."""

    handle: object
    path: np.ndarray
    goal: np.ndarray
    goal_time: float
    feedback: object = None
    result: tuple = ()

    def send(self):
        """Send the result: 'succeed', 'abort' or 'canceled', with a code and a text."""
        how, code, text = self.result

        def finish(handle):
            if how == 'canceled' and not handle.is_cancel_requested:
                # rclcpp_action, ~ServerGoalHandle: cancelled although nobody asked for it
                handle._update_state(GoalEvent.CANCEL_GOAL)
            getattr(handle, how)()
            return Result(error_code=code, error_string=text)

        self.handle.execute(finish)


@dataclass
class Course:
    """
    A trajectory that is being followed; Trajectory.sample.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Times of the waypoints on the clock of the controller [s].
    points : list of list of ndarray, shape (n,)
        Position, velocity and acceleration of each waypoint, as far as the message has them.

    """

    t: np.ndarray
    points: list

    @classmethod
    def of(cls, message, robot, now, before):
        """Take a message, from a state at a time on."""
        reference = waypoints_of(message).for_robot(robot)
        # Trajectory.sample: a stamp of zero is the time of the first sample
        start = seconds_of(message.header.stamp) or now
        rows = (x for x in (reference.q, reference.dq, reference.ddq) if x is not None)
        points = [list(point) for point in zip(*rows, strict=True)]
        t = start + reference.t
        if now < t[0]:
            # Trajectory.sample: one curve from the state before to the first waypoint, which
            # begins now, however late the stamp is. A curve of which waypoints are past is
            # entered between two of them, wherever the arm is.
            return cls(np.append(now, t), [before, *points])
        return cls(t, points)

    def sample(self, t):
        """Return position, velocity and acceleration at a time."""
        k = int(np.searchsorted(self.t, t, side='right')) - 1
        if not 0 <= k < len(self.t) - 1:
            rest = self.points[0][:1] if k < 0 else self.points[-1]
            return [*rest, *(3 - len(rest)) * [np.zeros(len(rest[0]))]]
        # Trajectory.interpolate_between_points: linear, cubic or quintic, by what both ends have
        order = min(len(self.points[k]), len(self.points[k + 1]))
        ends = [point[:order] for point in self.points[k : k + 2]]
        curve = BPoly.from_derivatives(self.t[k : k + 2], ends)
        return [curve.derivative(m)(t) if m else curve(t) for m in range(3)]


class Controller:
    """
    The controller, the broadcaster and the arm behind them, on the clock of a test bench.

    Attributes
    ----------
    accepted : list of JointTrajectory
        Trajectories by topic and by action.
    goals : list of FollowJointTrajectory.Goal
        Accepted goals.
    ends : list of str
        How goals ended: 'succeed', 'abort' or 'canceled'.

    """

    def __init__(self, bench, robot, q, quality=STREAM, *, action=False, now=99.4):
        self.faults = Faults()
        self.accepted, self.goals, self.ends = [], [], []
        self.now, self.q = now, np.array(q, dtype=float)
        self._bench, self._robot, self._model = bench, robot, ArmModel(robot)
        self._course, self._count, self._goal = None, 0, None
        self._held = True
        self._tolerances = (np.zeros(len(self.q)), np.zeros(len(self.q)), 0.0)
        self._results, self._replaced, self._monitored = [], [], self.now
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

    def leave(self):
        """Take the action away, as a controller that is unloaded does."""
        if self._server is not None:
            self._server.destroy()
        self._server = self._goal = None
        self._results, self._replaced = [], []
        gc.collect()  # server and goals hold each other, and the action lives as long

    def state(self, t):
        """Return where the arm should be at a time."""
        if self._course is None:
            rows = [self.q, *2 * [np.zeros(len(self.q))]]
        else:
            rows = self._course.sample(t)
        return Motion(self._robot.joints, [t], *(row[None] for row in rows))

    def run(self, until, step=0.1):
        """Let time go on, and publish joint states."""
        self._bench.spin_until(self._publisher.get_subscription_count, 'a subscriber')
        while self.now < until - 1e-9:
            self.now = round(self.now + step, 6)
            self._bench.tick(round(self.now * SECOND))
            self._publish()
            self._watch()
            if self.now >= self._monitored + MONITOR - 1e-9:
                self._monitor()
            self._bench.settle()

    def _publish(self):
        """Publish a joint state; JSB.update."""
        self._count += 1
        self.q = self._where(self.now, self.q)
        if self.faults.silent or (self.faults.lost and self._count % self.faults.lost == 0):
            return
        t = self.now - self.faults.late
        state, q = self.state(t - self.faults.lag), self._where(t, self.q)
        motion = Motion(self._robot.joints, state.t, q[None], state.dq, state.ddq)
        values = {
            'position': q,
            'velocity': self._velocity(t),
            'effort': self.faults.torque * self._model.joint_torque(motion)[0],
        }
        # joints in alphabetical order, all with the three fields
        order = np.argsort(self._robot.joints)
        message = JointState(name=[self._robot.joints[k] for k in order])
        for name, value in values.items():
            setattr(message, name, value[order].tolist())
        message.header.stamp = stamp_of(t)
        self._publisher.publish(message)

    def _where(self, t, before):
        """Return where the arm is at a time, given where it was before."""
        q = np.array(self.state(t - self.faults.lag).q[0])
        if self.faults.stuck is not None:
            q[self.faults.stuck] = before[self.faults.stuck]
        return q

    def _velocity(self, t):
        dq = np.array(self.state(t - self.faults.lag).dq[0])
        if self.faults.stuck is not None:
            dq[self.faults.stuck] = 0.0
        return dq

    def _watch(self):
        """Compare the arm with its trajectory; JTC.update."""
        if self._course is None or self._held:
            return
        path, goal, goal_time = self._tolerances
        error = self.state(self.now).q[0] - self.q
        past_end = self.now - self._course.t[-1]
        allowed = path if past_end < 0.0 else goal
        # tolerances: zero is not enforced
        outside = (np.abs(error) > allowed) & (allowed > 0.0)
        name = self._robot.joints[int(np.argmax(outside))]
        if past_end < 0.0 and outside.any():
            self._finish('abort', Result.PATH_TOLERANCE_VIOLATED, f'{name} is too far away')
        elif past_end >= 0.0 and not outside.any():
            if self._goal is not None:
                self._held = True  # JTC.set_success_trajectory_point: without tolerances
                self._end('succeed')
        elif 0.0 < goal_time < past_end:
            self._finish('abort', Result.GOAL_TOLERANCE_VIOLATED, f'{name} is too far away')
        if self._goal is not None:
            feedback = FollowJointTrajectory.Feedback(joint_names=list(self._robot.joints))
            feedback.header.stamp = stamp_of(self.now)
            feedback.error.positions = error.tolist()
            self._goal.feedback = feedback

    def _finish(self, *why):
        """Hold the arm where it is, and end the goal if there is one."""
        self._hold()
        if self._goal is not None:
            self._end(*why)

    def _hold(self):
        """Command the measured position at once, without a ramp; JTC.set_hold_position."""
        self._course, self._held = None, True

    def _end(self, how, code=Result.SUCCESSFUL, text=''):
        goal, self._goal = self._goal, None
        goal.result = (how, code, text)
        self._results += [goal, *self._replaced]
        self._replaced = []

    def _monitor(self):
        """Send results and feedback; realtime_tools, RealtimeServerGoalHandle.runNonRealtime."""
        self._monitored = self.now
        if self._goal is not None and self._goal.feedback is not None:
            self._goal.handle.publish_feedback(self._goal.feedback)
        while self._results:
            goal = self._results.pop(0)
            self.ends.append(goal.result[0])
            goal.send()

    def _on_goal(self, goal):
        if self.faults.deaf or not self._valid(goal.trajectory):
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _on_accepted(self, handle):
        """Replace the goal; JTC.goal_accepted_callback and JTC.preempt_active_goal."""
        request = handle.request
        if self._goal is not None and self.faults.overdue:
            self._goal.result = ('canceled', Result.SUCCESSFUL, '')
            self._replaced.append(self._goal)
        elif self._goal is not None:
            self._end('abort', Result.INVALID_GOAL, 'cancelled due to new incoming action')
            self._monitor()
        self.goals.append(request)
        self._take(request.trajectory)
        self._tolerances = (
            self._resolved(request.path_tolerance),
            self._resolved(request.goal_tolerance),
            max(seconds_of(request.goal_time_tolerance), 0.0),
        )
        self._goal = Goal(handle, *self._tolerances)

    def _resolved(self, tolerances):
        """Return those of a goal by joint; tolerances.get_segment_tolerances: -1 is none."""
        asked = {tolerance.name: max(tolerance.position, 0.0) for tolerance in tolerances}
        return np.array([asked.get(joint, 0.0) for joint in self._robot.joints])

    def _on_cancel(self, handle):
        """Hold the arm where it is; JTC.goal_cancelled_callback, which accepts all requests."""
        if self.faults.deaf:
            return CancelResponse.REJECT
        if self._goal is not None and handle.goal_id == self._goal.handle.goal_id:
            self._hold()
            self._end('canceled')
            # the result follows once the answer has made it a goal that is being cancelled
            self._bench.executor.create_task(self._monitor)
        return CancelResponse.ACCEPT

    def _on_trajectory(self, message):
        """Take a trajectory of the topic; JTC.topic_callback, which ends no goal."""
        if not self.faults.deaf and self._valid(message):
            self._take(message)

    def _valid(self, message):
        """Judge a trajectory; JTC.validate_trajectory_msg."""
        joints, points = message.joint_names, message.points
        if len(joints) != len(self._robot.joints) or set(joints) != set(self._robot.joints):
            return False
        if not points or np.any(np.abs(points[-1].velocities) > AT_REST):
            return False
        start = seconds_of(message.header.stamp)
        t = [seconds_of(point.time_from_start) for point in points]
        if (start and start + t[-1] < self.now) or np.any(np.diff(t) <= 0.0):
            return False
        try:
            return waypoints_of(message).tau is None  # no efforts
        except ArmidError:
            return False

    def _take(self, message):
        """Begin a trajectory instead of the one before; JTC.update and Trajectory.update."""
        self.accepted.append(message)
        before = [self.q, self._velocity(self.now)]
        self._course = Course.of(message, self._robot, self.now, before)
        self._held = False


def seconds_of(stamp):
    """Return a stamp or a duration in seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec


def stamp_of(seconds):
    """Return a time as a stamp."""
    nanoseconds = round(seconds * SECOND)
    return Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)


def joint_state(seconds, names, q, dq=(), tau=()):
    """Return a joint state with a stamp."""
    values = {'position': q, 'velocity': dq, 'effort': tau}
    fields = {field: np.asarray(x, dtype=float).tolist() for field, x in values.items()}
    state = JointState(name=list(names), **fields)
    state.header.stamp = stamp_of(seconds)
    return state
