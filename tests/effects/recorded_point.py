# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An anchor of springs that was recorded: what a wearer of an exoskeleton is to it."""

from armid_ros.model import point_motion
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline


class RecordedPoint:
    """
    A point of another chain as an anchor, from that chain's recorded motion.

    Parameters
    ----------
    robot : Robot
        The other chain; its base frame has to be that of the arm.
    motion : Motion
        Its motion, on the time base of the arm's.
    joint : str
        The joint that moves the link with the point.
    offset : array_like, shape (3,)
        The point in the frame of that joint [m].

    """

    def __init__(
        self, robot: Robot, motion: Motion, joint: str, offset: npt.ArrayLike = (0.0, 0.0, 0.0)
    ) -> None:
        position, jacobian = point_motion(robot, joint, offset, motion.q)
        velocity = np.einsum('nxj,nj->nx', jacobian, motion.dq)
        self._curve = CubicHermiteSpline(motion.t, position, velocity)

    def __call__(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return position and velocity at times of shape (N,), each of shape (N, 3)."""
        return np.asarray(self._curve(t)), np.asarray(self._curve(t, 1))
