# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read and write reference motions as trajectory_msgs/JointTrajectory messages in bags."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armid_ros.errors import RecordingError, TrajectoryError
from armid_ros.files import reading
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording.bag import Bag
from armid_ros.recording.message_types import JOINT_TRAJECTORY
from armid_ros.recording.metadata import LATCHED
from armid_ros.recording.source import DEFAULT, ReadSettings
from armid_ros.recording.writer import atomic_bag
from armid_ros.robots.reference import Reference
import numpy as np
from rosbags.typesys import get_typestore, Stores


def joint_trajectory_cdr(motion: Motion | Reference) -> bytes:
    """
    Serialise a motion as one trajectory_msgs/JointTrajectory message.

    Parameters
    ----------
    motion : Motion or Reference
        Motion to serialise. Its times become time_from_start. The header stamp is 0, so that
        controllers start at once.

    """
    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    duration = types['builtin_interfaces/msg/Duration']
    nothing = np.empty((len(motion.t), 0))
    dq, ddq, tau = (
        nothing if values is None else values for values in (motion.dq, motion.ddq, motion.tau)
    )
    points = [
        types['trajectory_msgs/msg/JointTrajectoryPoint'](
            positions=motion.q[sample],
            velocities=dq[sample],
            accelerations=ddq[sample],
            effort=tau[sample],
            time_from_start=duration(*divmod(time, 10**9)),
        )
        for sample, time in enumerate(np.rint(motion.t * 1e9).astype(np.int64).tolist())
    ]
    header = types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](0, 0), '')
    message = types[JOINT_TRAJECTORY](header, list(motion.joints), points)
    return bytes(store.serialize_cdr(message, JOINT_TRAJECTORY))


def write_joint_trajectory(
    path: str | Path,
    motion: Motion | Reference,
    *,
    robot_description: str | None = None,
) -> None:
    """
    Write a reference motion to a new bag, as one JointTrajectory message.

    Parameters
    ----------
    path : str or Path
        Bag directory to create; it must not exist.
    motion : Motion or Reference
        Motion to write. Its torque, if any, is a feedforward effort.
    robot_description : str, optional
        URDF to be written to /robot_description.

    Raises
    ------
    RecordingError
        If the bag exists.

    """
    topic, log_time = '/joint_trajectory', 10**9  # [ns]
    with atomic_bag(path) as writer:
        if robot_description is not None:
            writer.write_description(robot_description, log_time)
        writer.add_topic(topic, JOINT_TRAJECTORY, qos=[LATCHED])
        writer.write(topic, joint_trajectory_cdr(motion), log_time)


def read_waypoints(
    path: str | Path,
    joints: Sequence[str],
    *,
    settings: ReadSettings = DEFAULT,
) -> Reference:
    """
    Return the reference motion in the last JointTrajectory message of a bag.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory, or a bare file.
    joints : sequence of str
        Joints to read, in this order.
    settings : ReadSettings
        Whether checksums are compared, and the memory limit.

    Returns
    -------
    Reference
        Waypoints of the message; velocities, accelerations and efforts are None if the message has
        none.

    Raises
    ------
    RecordingError
        If the bag has no or several trajectories, or the trajectory is not valid or lacks a joint.

    """
    with Bag(path, settings) as bag:
        chosen = bag.topic_of(JOINT_TRAJECTORY)
        cdr = b''
        for block in bag.blocks(chosen.name):
            cdr = block.message(len(block) - 1)
    where = f'{path}: {chosen.name}'
    if not cdr:
        raise RecordingError(f'{where}: the topic has no messages; record again')
    with reading(where, RecordingError):
        found = waypoints_of(bag.decoded(chosen, cdr))
    missing = [joint for joint in joints if joint not in found.joints]
    if missing:
        raise RecordingError(
            f'{where}: the trajectory lacks the joints {", ".join(missing)}; its joints are '
            f'{", ".join(found.joints)}'
        )
    if len(found.t) < 2:
        raise RecordingError(f'{where}: a trajectory needs two points, not {len(found.t)}')
    return found.of_joints(tuple(joints))


def waypoints_of(message: Any) -> Reference:
    """
    Return the waypoints of a decoded JointTrajectory message as a reference motion.

    Raises
    ------
    TrajectoryError
        If the trajectory has no points, its points differ in their fields, a number is not finite,
        or time does not increase.

    """
    points, joints = message.points, tuple(message.joint_names)
    if not len(points):
        raise TrajectoryError('the JointTrajectory message has no points')

    def quantity(name: str) -> FloatArray | None:
        rows = [getattr(point, name) for point in points]
        if not any(len(row) for row in rows):
            return None
        for number, row in enumerate(rows):
            if len(row) != len(joints):
                raise TrajectoryError(
                    f'point {number} of the trajectory has {len(row)} {name}, but the message has '
                    f'{len(joints)} joint names'
                )
        return np.array(rows, np.float64)

    t = np.array([p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in points])
    q = quantity('positions')
    if q is None:
        raise TrajectoryError('the points of the JointTrajectory message have no positions')
    rates = quantity('velocities'), quantity('accelerations')
    return Reference(joints, t, q, *rates, quantity('effort'))
