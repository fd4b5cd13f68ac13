# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Readings of accelerometers on the links of an arm."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin


@dataclass(frozen=True, eq=False)
class LinkAccelerometers:
    """
    Accelerometers with three axes, one on every link, aligned with the frame of its joint.

    Attributes
    ----------
    robot : Robot
        The arm.
    places : ndarray, shape (n, 3)
        Positions of the accelerometers in the frames of the joints [m]; by default the centroids
        of the links.

    """

    robot: Robot
    places: npt.ArrayLike | None = None
    _model: pin.Model = field(init=False, repr=False)
    _data: pin.Data = field(init=False, repr=False)
    _frames: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the places, or choose the default places."""
        model = self.robot.model
        places = self.places
        if places is None:
            places = [inertia.lever for inertia in list(model.inertias)[1:]]
        array = read_only(places)
        if array.shape != (self.robot.n_joints, 3):
            raise RobotError(
                f'{self.robot.name}: accelerometers need three coordinates for each of '
                f'{self.robot.n_joints} links, got an array of shape {array.shape}'
            )
        model = pin.Model(model)
        frames = [
            model.addFrame(
                pin.Frame(
                    f'{link}_accelerometer',
                    joint,
                    pin.SE3(np.eye(3), place),
                    pin.FrameType.SENSOR,
                )
            )
            for joint, (link, place) in enumerate(zip(self.robot.links, array, strict=True), 1)
        ]
        object.__setattr__(self, '_model', model)
        object.__setattr__(self, '_data', model.createData())
        object.__setattr__(self, '_frames', tuple(frames))

    def read(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the readings in one state, shape (n, 3) [m/s^2]; at rest gravity, upwards."""
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, q, dq, ddq)
        up = -model.gravity.linear
        readings = np.empty((len(self._frames), 3))
        for joint, frame in enumerate(self._frames, 1):
            felt = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL).linear
            readings[joint - 1] = felt + up.dot(data.oMi[joint].rotation)
        return readings

    def readings(self, link: Motion) -> FloatArray:
        """Return the readings along a motion of the links, shape (n, N, 3) [m/s^2]."""
        rows = [self.read(*row) for row in zip(link.q, link.dq, link.ddq, strict=True)]
        return np.asarray(np.stack(rows, axis=1))
