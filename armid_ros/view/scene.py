# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What there is to see of a recording: poses over time, and torques as a model has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.errors import RobotError
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.regression import predictions
from armid_ros.identification.rows.signals import conditioning
from armid_ros.motion import FloatArray, read_only
from armid_ros.recording import Recording
from armid_ros.robots import Robot
from armid_ros.view.bodies import bodies, Body
import numpy as np
import pinocchio as pin

#: Poses per second that are drawn.
_POSE_RATE = 30.0


@dataclass(frozen=True, eq=False)
class Scene:
    """
    A recording, drawn.

    Attributes
    ----------
    name : str
        What it is called.
    robot : Robot
        The arm.
    bodies : tuple of Body
        What it looks like.
    marked : tuple of str
        Joints that are coloured.
    recording : Recording
        Position, velocity and torque as they were measured.
    t : ndarray, shape (M,)
        Times of what the model says [s].
    measured, predicted : ndarray, shape (M, n)
        Torque, filtered alike [N m]; no rows without a model or torque.
    pose_t : ndarray, shape (K,)
        Times of the poses [s].
    rotations, translations : ndarray, shape (K, n, 3, 3) and (K, n, 3)
        Where the frames of the joints are [m].
    notes : tuple of str
        What is not shown.

    """

    name: str
    robot: Robot
    bodies: tuple[Body, ...]
    marked: tuple[str, ...]
    recording: Recording
    t: FloatArray
    measured: FloatArray
    predicted: FloatArray
    pose_t: FloatArray
    rotations: FloatArray
    translations: FloatArray
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the arrays, and check the joints."""
        unknown = [joint for joint in self.marked if joint not in self.robot.joints]
        if unknown:
            raise RobotError(
                f"{self.robot.name} has no joint '{unknown[0]}'; its joints are "
                f'{", ".join(self.robot.joints)}'
            )
        for name in ('t', 'measured', 'predicted', 'pose_t', 'rotations', 'translations'):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted torque, shape (M, n) [N m]."""
        return self.measured - self.predicted


def make_scene(arm: ArmModel, recording: Recording, marked: Sequence[str] = ()) -> Scene:
    """
    Compute what there is to see.

    Parameters
    ----------
    arm : ArmModel
        The model.
    recording : Recording
        What the arm did; torque is predicted where it has some.
    marked : sequence of str
        Joints to be coloured.

    """
    robot = arm.robot
    drawn, notes = bodies(robot)
    empty = np.empty((0, robot.n_joints))
    t, measured, predicted = np.empty(0), empty, empty
    if recording.tau is not None:
        found = predictions(arm, [recording], conditioning([recording], SignalSettings()))
        parts = [one for one in found if one.motion.tau is not None]
        t = np.concatenate([t, *(one.motion.t for one in parts)])
        measured = np.concatenate([empty, *(np.asarray(one.motion.tau) for one in parts)])
        predicted = np.concatenate([empty, *(one.predicted for one in parts)])
    pose_t = _times(recording.t)
    rotations, translations = joint_frames(robot, _positions(recording, pose_t))
    name = Path(recording.source).name or robot.name
    return Scene(
        name,
        robot,
        drawn,
        tuple(marked),
        recording,
        t,
        measured,
        predicted,
        pose_t,
        rotations,
        translations,
        notes,
    )


def joint_frames(robot: Robot, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where the frames of the joints are, for q of shape (K, n) [rad or m]."""
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


def _times(t: FloatArray) -> FloatArray:
    count = max(2, int((t[-1] - t[0]) * _POSE_RATE) + 1)
    return np.linspace(t[0], t[-1], min(count, len(t)))


def _positions(recording: Recording, t: FloatArray) -> FloatArray:
    """Return positions at times, shape (K, n), between samples that are numbers."""
    columns = []
    for column in recording.q.T:
        known = np.isfinite(column)
        columns.append(np.interp(t, recording.t[known], column[known]) if known.any() else 0.0 * t)
    return np.column_stack(columns)
