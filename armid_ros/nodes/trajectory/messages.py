# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joint trajectories between messages and what the arm follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation import Reference
from builtin_interfaces.msg import Duration
import numpy as np
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def read_trajectory(message: JointTrajectory) -> Reference:
    """
    Return the waypoints of a message.

    Raises
    ------
    TrajectoryError
        If it has no points, or they do not all have the fields that the first one has, or a
        number is not finite, or time does not increase.

    """
    if not message.points:
        raise TrajectoryError('trajectory: it has no points')
    joints = tuple(message.joint_names)
    times = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in message.points]
    fields = {
        name: _field(message.points, name, len(joints))
        for name in ('positions', 'velocities', 'accelerations', 'effort')
    }
    if fields['positions'] is None:
        raise TrajectoryError('trajectory: its points have no positions')
    return Reference(
        joints,
        np.array(times),
        fields['positions'],
        fields['velocities'],
        fields['accelerations'],
        fields['effort'],
    )


def write_trajectory(motion: Motion, lead: float) -> JointTrajectory:
    """
    Return the message that holds every sample of a motion.

    Parameters
    ----------
    motion : Motion
        What the arm shall do.
    lead : float
        Time it has to get to the first sample [s].

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


def _field(points: Sequence[Any], name: str, n_joints: int) -> FloatArray | None:
    rows = [getattr(point, name) for point in points]
    if not any(len(row) for row in rows):
        return None
    for number, row in enumerate(rows):
        if len(row) != n_joints:
            raise TrajectoryError(
                f'trajectory: point {number} has {len(row)} {name}, but there are {n_joints} '
                'joint names'
            )
    return np.array(rows, dtype=np.float64)
