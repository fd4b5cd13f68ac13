# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The current reference of a simulated arm: hold still, or follow the latest trajectory."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
from armid_ros.simulation.reference import Reference
import numpy as np

#: Largest distance of the first point of a trajectory that begins at once from the desired
#: position [rad or m], and largest velocity at its beginning and end [rad/s or m/s].
START_TOLERANCE = 0.01
REST_TOLERANCE = 1e-3


class Course:
    """
    The reference of an arm over the steps of its plant.

    Parameters
    ----------
    robot : Robot
        Robot with the limits to keep.
    dt : float
        Step of the plant [s].

    """

    def __init__(self, robot: Robot, dt: float) -> None:
        self._robot = robot
        self._dt = dt
        self.follow(Reference(robot.joints, np.zeros(1), np.zeros((1, robot.n_joints))), 0)

    @property
    def ends_at(self) -> float:
        """Time at which the trajectory ends, or has ended [s]."""
        return self._start * self._dt + self._reference.duration

    def follow(self, reference: Reference, steps: int) -> None:
        """Follow a reference from a step on, wherever the arm is."""
        self._reference, self._start = reference, steps

    def begin(self, reference: Reference, steps: int) -> None:
        """
        Follow a trajectory from a step on; it replaces the present trajectory.

        If the time of the first point is later than zero, the arm moves to this point within that
        time.

        Raises
        ------
        TrajectoryError
            If a joint is unknown or missing, a position or velocity limit is exceeded, the arm has
            no time to reach the first point, or the last point is not at rest. The course then
            does not change.

        """
        curve = reference.for_robot(self._robot)
        now = self.desired(steps, 1)
        if curve.dq is not None:
            self._require_none('ends with', curve.dq[-1], REST_TOLERANCE, '/s', 'stop it')
        if curve.t[0] > 0.0:
            curve = curve.after(now.q[0], now.dq[0], now.ddq[0])
        else:
            advice = 'give its first point a later time, to get there'
            self._require_none(
                'starts away by', curve.q[0] - now.q[0], START_TOLERANCE, '', advice
            )
            if curve.dq is not None:
                jump = curve.dq[0] - now.dq[0]
                self._require_none('starts with a jump of', jump, REST_TOLERANCE, '/s', advice)
        curve.require_limits(self._robot, self._dt)
        self.follow(curve, steps)

    def desired(self, first: int, count: int) -> Motion:
        """Return the desired motion at successive steps from `first` on."""
        motion = self._reference.sample(self._times(first - self._start, count))
        return replace(motion, t=self._times(first, count))

    def _times(self, first: int, count: int) -> FloatArray:
        return np.asarray(self._dt * np.arange(first, first + count), dtype=np.float64)

    def _require_none(
        self, what: str, values: FloatArray, tolerance: float, per: str, advice: str
    ) -> None:
        """Raise a TrajectoryError if the value of any joint exceeds a tolerance."""
        worst = int(np.argmax(np.abs(values)))
        if abs(values[worst]) > tolerance:
            unit = self._robot.position_units[worst] + per
            raise TrajectoryError(
                f"trajectory: joint '{self._robot.joints[worst]}' {what} {values[worst]:.4g} "
                f'{unit}, more than {tolerance:g} {unit}; {advice}'
            )
