# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert motions to JointTrajectory messages."""

from __future__ import annotations

from armid_ros.motion import Motion
from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def write_trajectory(motion: Motion, lead: float) -> JointTrajectory:
    """
    Convert a motion to a message with one point per sample.

    Parameters
    ----------
    motion : Motion
        Motion for the arm.
    lead : float
        Time from the start to the first sample [s].

    """
    message = JointTrajectory(joint_names=list(motion.joints))
    for row, t in enumerate(motion.t - motion.t[0] + lead):
        seconds, nanoseconds = divmod(round(float(t) * 1e9), 10**9)
        message.points.append(
            JointTrajectoryPoint(
                positions=motion.q[row].tolist(),
                velocities=motion.dq[row].tolist(),
                accelerations=motion.ddq[row].tolist(),
                time_from_start=Duration(sec=seconds, nanosec=nanoseconds),
            )
        )
    return message
