# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the joints of an arm are, and what a model makes of a recording, over time."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.regression import predictions
from armid_ros.identification.rows.signals import conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

#: Poses per second that are drawn.
_POSE_RATE = 30.0


def joint_frames(robot: Robot, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return where the frames of the joints are.

    Parameters
    ----------
    robot : Robot
        The arm.
    q : ndarray, shape (K, n)
        Poses [rad or m].

    Returns
    -------
    rotations : ndarray, shape (K, n, 3, 3)
    translations : ndarray, shape (K, n, 3)
        [m].

    """
    data = robot.model.createData()
    rotations = np.empty((*q.shape, 3, 3))
    translations = np.empty((*q.shape, 3))
    for k, pose in enumerate(q):
        pin.forwardKinematics(robot.model, data, pose)
        for j in range(robot.n_joints):
            rotations[k, j] = data.oMi[j + 1].rotation
            translations[k, j] = data.oMi[j + 1].translation
    return rotations, translations


def joint_axes(robot: Robot) -> FloatArray:
    """Return the axis of each joint in its own frame, shape (n, 3)."""
    axes = np.empty((robot.n_joints, 3))
    for j in range(robot.n_joints):
        joint = robot.model.joints[j + 1]
        data = joint.createData()
        joint.calc(data, np.zeros(joint.nq))
        motion = np.asarray(data.S).ravel()
        axes[j] = motion[:3] + motion[3:]  # along it, or about it
    return axes


def poses(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Return times, shape (K,) [s], and poses, (K, n), some thirty a second, without NaN."""
    t = recording.t
    count = max(2, int((t[-1] - t[0]) * _POSE_RATE) + 1)
    at = np.linspace(t[0], t[-1], min(count, len(t)))
    columns = []
    for column in recording.q.T:
        known = np.isfinite(column)
        columns.append(np.interp(at, t[known], column[known]) if known.any() else 0.0 * at)
    return at, np.column_stack(columns)


def torques(
    arm: ArmModel, recording: Recording
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return times (M,) and torques (M, n), measured and predicted, filtered alike; or None."""
    if recording.tau is None:
        return None
    fits = predictions(arm, [recording], conditioning([recording], SignalSettings()))
    return (
        np.concatenate([fit.motion.t for fit in fits]),
        np.concatenate([fit.tau for fit in fits]),
        np.concatenate([fit.predicted for fit in fits]),
    )
