# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A trajectory controller as the documents of ros2_control describe it, with faults.

It begins a trajectory at its stamp, or at once where the stamp is zero; refuses one whose end is
past; replaces what is under way by what comes; interpolates between waypoints; and stays at the
last one. The arm behind it is where it is told to be, and takes the torque of a model.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.motion import Motion
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.trajectories import read_trajectory
from builtin_interfaces.msg import Time
import numpy as np
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

SECOND = 10**9


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
    torque : float
        Factor on the torques.

    """

    stuck: int | None = None
    deaf: bool = False
    late: float = 0.0
    lost: int = 0
    torque: float = 1.0


class Controller:
    """The controller and the arm behind it, on the clock of a test bench."""

    def __init__(self, bench, robot, q, quality=LATCHED):
        self.faults = Faults()
        self.accepted, self.refused = [], []
        self.now, self.q = 100.0, np.array(q, dtype=float)
        self._bench, self._robot, self._model = bench, robot, ArmModel(robot)
        self._begun, self._curve, self._count = 0.0, None, 0
        self._publisher = bench.probe.create_publisher(JointState, 'joint_states', 10)
        bench.probe.create_subscription(
            JointTrajectory, 'joint_trajectory', self._on_trajectory, quality
        )

    def restart(self):
        """Forget what is under way, and stay where the arm is."""
        self._curve = None

    def state(self, t):
        """Return where the arm is at a time, at rest before and after a trajectory."""
        if self._curve is None:
            return Motion(self._robot.joints, [t], [self.q], np.zeros((1, 6)), np.zeros((1, 6)))
        return self._curve.sample(np.array([t - self._begun]))

    def run(self, until, step=0.1):
        """Let time go on, and publish joint states."""
        self._bench.spin_until(self._publisher.get_subscription_count, 'a subscriber')
        while self.now < until - 1e-9:
            self.now = round(self.now + step, 6)
            self._bench.tick(round(self.now * SECOND))
            self._publish()
            self._bench.settle()

    def _publish(self):
        self._count += 1
        if self.faults.lost and self._count % self.faults.lost == 0:
            return
        t = self.now - self.faults.late
        state = self.state(t)
        q = np.array(state.q[0])
        if self.faults.stuck is not None:
            q[self.faults.stuck] = self.q[self.faults.stuck]
        self.q = q
        motion = Motion(self._robot.joints, state.t, q[None], state.dq, state.ddq)
        message = JointState(name=list(self._robot.joints), position=q.tolist())
        message.effort = (self.faults.torque * self._model.joint_torque(motion)[0]).tolist()
        nanoseconds = round(t * SECOND)
        message.header.stamp = Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)
        self._publisher.publish(message)

    def _on_trajectory(self, message):
        if self.faults.deaf:
            return
        reference = read_trajectory(message).for_robot(self._robot)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        begin = stamp or self.now
        if begin + reference.duration < self.now:
            self.refused.append(message)
            return
        before = self.state(self.now)
        self.accepted.append(message)
        self._curve = reference.after(before.q[0], before.dq[0], before.ddq[0])
        self._begun = begin
