# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm in rerun while it moves, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
from armid_ros.view.bodies import bodies
from armid_ros.view.rerun_log import log_arm, part, rerun, shown, style_curves, TIMELINE
from armid_ros.view.scene import joint_frames
import numpy as np
from scipy.spatial.transform import Rotation

#: Poses per second that are drawn; curves have every sample.
_POSE_PERIOD = 1.0 / 30.0


class LiveLog:
    """
    Logs what an arm does as it comes.

    Parameters
    ----------
    robot : Robot
        The arm.
    stream : rerun.RecordingStream
        Where to.
    marked : sequence of str
        Joints that are coloured.

    Attributes
    ----------
    notes : tuple of str
        What is not drawn.

    """

    def __init__(self, robot: Robot, stream: Any, marked: Sequence[str] = ()) -> None:
        self._rr, self._robot, self._stream = rerun(), robot, stream
        pieces, self.notes = bodies(robot)
        log_arm(robot, pieces, marked, stream)
        style_curves(robot.joints, stream)
        stream.send_blueprint(shown(robot.joints, marked))
        self._parts = [part(joint) for joint in robot.joints]
        self._drawn = -np.inf

    def measured(self, t: float, q: FloatArray, dq: FloatArray | None, tau: FloatArray) -> None:
        """Log what sensors read at a time [s], each of shape (n,)."""
        self._at(t)
        self._curves('position/{}', q)
        if dq is not None:
            self._curves('velocity/{}', dq)
        self._curves('torque/{}/measured', tau)
        if not 0.0 <= t - self._drawn < _POSE_PERIOD and np.all(np.isfinite(q)):
            self._drawn = t
            self._pose(q)

    def predicted(self, t: float, tau: FloatArray) -> None:
        """Log the torque of a model, shape (n,)."""
        self._at(t)
        self._curves('torque/{}/predicted', tau)

    def residual(self, t: float, tau: FloatArray) -> None:
        """Log what the model does not explain, shape (n,)."""
        self._at(t)
        self._curves('residual/{}', tau)

    def close(self) -> None:
        """Write what is not written yet."""
        self._stream.flush()
        self._stream.disconnect()

    def _at(self, t: float) -> None:
        self._stream.set_time(TIMELINE, duration=t)

    def _curves(self, entity: str, values: FloatArray) -> None:
        for name, value in zip(self._parts, values, strict=True):
            if np.isfinite(value):
                self._stream.log(entity.format(name), self._rr.Scalars(float(value)))

    def _pose(self, q: FloatArray) -> None:
        rotations, translations = joint_frames(self._robot, q[np.newaxis])
        turned = Rotation.from_matrix(rotations[0]).as_quat()
        for j, name in enumerate(self._parts):
            pose = self._rr.Transform3D(
                translation=translations[0, j], quaternion=self._rr.Quaternion(xyzw=turned[j])
            )
            self._stream.log(f'arm/{name}', pose)
