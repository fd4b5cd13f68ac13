# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The reference of an arm: waypoints in time, and the smooth curve through them.

The curve equals that of ROS 2's joint_trajectory_controller for a JointTrajectory: linear between
waypoints with positions only, cubic with velocities, quintic with accelerations. Before the
first and after the last waypoint, the arm is at rest.

"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray, freeze, Motion
from armid_ros.robots.robot import Robot
import numpy as np
from scipy.interpolate import PPoly

#: Tolerance beyond a position limit, as a share of the range between the limits.
LIMIT_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Reference:
    """
    Reference trajectory of joints: waypoints, and the smooth curve through them.

    Attributes
    ----------
    joints : tuple of str
        Joint names in column order.
    t : ndarray, shape (K,)
        Time from the start [s], strictly increasing, not negative.
    q : ndarray, shape (K, n)
        Position [rad or m].
    dq, ddq : ndarray, shape (K, n), or None
        Velocity and acceleration; an acceleration needs a velocity.
    tau : ndarray, shape (K, n), or None
        Feedforward torque, interpolated linearly between waypoints [N m]; for controllers that
        accept it.

    """

    joints: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    dq: FloatArray | None = None
    ddq: FloatArray | None = None
    tau: FloatArray | None = None
    _curves: tuple[Any, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Freeze and check the waypoints, and compute the polynomials between them."""
        names = [
            name for name in ('t', 'q', 'dq', 'ddq', 'tau') if getattr(self, name) is not None
        ]
        freeze(self, *names)
        if self.t.ndim != 1 or not len(self.t):
            raise TrajectoryError('trajectory: there are no waypoints')
        if len(set(self.joints)) != len(self.joints):
            raise TrajectoryError(f'trajectory: a joint is named twice: {", ".join(self.joints)}')
        expected = (len(self.t), len(self.joints))
        for name in names[1:]:
            values = getattr(self, name)
            if values.shape != expected:
                raise TrajectoryError(
                    f'trajectory: {name} has shape {values.shape}, but {expected[0]} points of '
                    f'{expected[1]} joints need {expected}'
                )
            bad = np.argwhere(~np.isfinite(values))
            if len(bad):
                point, joint = bad[0]
                raise TrajectoryError(
                    f"trajectory: {name} of joint '{self.joints[joint]}' at point {point} is "
                    f'{values[point, joint]}'
                )
        if not self.t[0] >= 0.0:
            raise TrajectoryError(
                f'trajectory: the first waypoint is at {self.t[0]} s; times have to be >= 0'
            )
        late = np.flatnonzero(~((np.diff(self.t) > 0.0) & np.isfinite(self.t[1:])))
        if len(late):
            point = int(late[0]) + 1
            raise TrajectoryError(
                f'trajectory: time_from_start has to increase, but point {point} is at '
                f'{self.t[point]} s and the previous point at {self.t[point - 1]} s'
            )
        if self.ddq is not None and self.dq is None:
            raise TrajectoryError('trajectory: accelerations need velocities, which are missing')
        if len(self.t) > 1:
            position = _curve(self.t, self.q, self.dq, self.ddq)
            curves = (position, position.derivative(), position.derivative(2))
            object.__setattr__(self, '_curves', curves)

    @classmethod
    def of(cls, motion: Motion) -> Reference:
        """Return the reference through every sample of a motion, starting at time zero."""
        return cls(motion.joints, motion.t - motion.t[0], motion.q, motion.dq, motion.ddq)

    @property
    def duration(self) -> float:
        """Time of the last waypoint [s]."""
        return float(self.t[-1])

    def sample(self, t: FloatArray) -> Motion:
        """
        Return the motion at times t on the smooth curve through the waypoints.

        Parameters
        ----------
        t : ndarray, shape (N,)
            Time from the start [s]; at any time outside the waypoints the arm holds still.

        Returns
        -------
        Motion
            Position, velocity and acceleration, and torque if the reference has one.

        """
        tau = None
        if self.tau is not None:
            columns = [np.interp(t, self.t, column, 0.0, 0.0) for column in self.tau.T]
            tau = np.column_stack(columns)
        if len(self.t) == 1:
            q = np.broadcast_to(self.q[0], (len(t), len(self.joints)))
            return Motion(self.joints, t, q, np.zeros_like(q), np.zeros_like(q), tau)
        inside = ((t >= self.t[0]) & (t <= self.t[-1]))[:, np.newaxis]
        within = np.clip(t, self.t[0], self.t[-1])
        q, dq, ddq = (curve(within) for curve in self._curves)
        q = np.where((t >= self.t[-1])[:, np.newaxis], self.q[-1], q)
        dq, ddq = (np.where(inside, rate, 0.0) for rate in (dq, ddq))
        return Motion(self.joints, t, q, dq, ddq, tau)

    def for_robot(self, robot: Robot) -> Reference:
        """
        Return the reference with its joints in the order of the robot.

        Raises
        ------
        TrajectoryError
            If a joint is unknown or missing.

        """
        listed = ', '.join(robot.joints)
        for joint in self.joints:
            if joint not in robot.joints:
                raise TrajectoryError(
                    f"trajectory: joint '{joint}' is not a driven joint of {robot.name}; driven "
                    f'joints: {listed}'
                )
        for joint in robot.joints:
            if joint not in self.joints:
                raise TrajectoryError(
                    f"trajectory: joint '{joint}' is missing; {robot.name} needs {listed}; to "
                    f'keep missing joints at rest, give --joints {",".join(self.joints)}'
                )
        return self if self.joints == robot.joints else self.of_joints(robot.joints)

    def of_joints(self, joints: tuple[str, ...]) -> Reference:
        """Return the reference of the named joints only, in the order of `joints`."""
        order = [self.joints.index(joint) for joint in joints]
        return self._waypoints(joints, self.t, (slice(None), order))

    def remaining(self, late: float) -> Reference:
        """
        Return the remaining part of a reference that was started `late` seconds ago.

        Waypoints of the first 2 * late seconds are left out, so the arm has time to reach the
        reference. If no waypoint remains, the whole reference is returned.

        Parameters
        ----------
        late : float
            Time since the start of the reference [s].

        """
        left = self.t > 2.0 * late
        if late <= 0.0 or not left.any():
            return self
        return self._waypoints(self.joints, self.t[left] - late, left)

    def _waypoints(self, joints: tuple[str, ...], t: FloatArray, chosen: Any) -> Reference:
        values = (self.q, self.dq, self.ddq, self.tau)
        q, *rest = (None if one is None else one[chosen] for one in values)
        assert q is not None
        return Reference(joints, t, q, *rest)

    def after(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> Reference:
        """
        Return the reference with the present state of the arm as first waypoint, at time zero.

        The time of the first point has to be later than zero.

        """
        return Reference(
            self.joints,
            np.append(0.0, self.t),
            np.vstack([q, self.q]),
            None if self.dq is None else np.vstack([dq, self.dq]),
            None if self.ddq is None else np.vstack([ddq, self.ddq]),
            None if self.tau is None else np.vstack([np.zeros_like(q), self.tau]),
        )

    def require_limits(self, robot: Robot, dt: float) -> None:
        """
        Raise TrajectoryError if the interpolated motion exceeds position or velocity limits.

        Parameters
        ----------
        robot : Robot
            Robot with the limits, in the joint order of this reference.
        dt : float
            Time between the checked points [s].

        Raises
        ------
        TrajectoryError
            If a limit is exceeded; the message names the joint, the time, the value and the limit.

        """
        slack = limit_slack(robot)
        fastest = robot.velocity_limit * (1.0 + LIMIT_TOLERANCE)
        t = np.minimum(dt * np.arange(int(np.ceil(self.duration / dt)) + 1), self.duration)
        size = 20_000  # samples of a block
        blocks = [self.t, *np.split(t, np.arange(size, len(t), size))]
        for motion in map(self.sample, blocks):
            for beyond, values, kind, per_time in (
                (motion.q < robot.lower - slack, motion.q, 'lower', ''),
                (motion.q > robot.upper + slack, motion.q, 'upper', ''),
                (np.abs(motion.dq) > fastest, motion.dq, 'velocity', '/s'),
            ):
                if not beyond.any():
                    continue
                sample, joint = np.argwhere(beyond)[0]
                limit = {
                    'lower': robot.lower,
                    'upper': robot.upper,
                    'velocity': robot.velocity_limit,
                }[kind][joint]
                unit = f'{robot.position_units[joint]}{per_time}'
                raise TrajectoryError(
                    f"trajectory: joint '{robot.joints[joint]}' reaches "
                    f'{values[sample, joint]:.4g} {unit} at {motion.t[sample]:.3f} s, beyond its '
                    f'{kind} limit of {limit:.4g} {unit}'
                )


def limit_slack(robot: Robot) -> FloatArray:
    """Return the tolerance by which a position may exceed its limit, shape (n,) [rad or m]."""
    span = robot.upper - robot.lower
    return np.asarray(LIMIT_TOLERANCE * np.where(np.isfinite(span), span, 1.0))


def _curve(t: FloatArray, q: FloatArray, dq: FloatArray | None, ddq: FloatArray | None) -> PPoly:
    """Return the piecewise polynomial of joint positions through the waypoints."""
    span, way = np.diff(t)[:, np.newaxis], np.diff(q, axis=0)
    c = np.zeros((6, *way.shape))  # coefficients of u^0 to u^5, u = (t - t_k) / (t_k+1 - t_k)
    c[0], c[1] = q[:-1], way
    if dq is not None:
        v0, v1 = span * dq[:-1], span * dq[1:]
        c[1] = v0
        c[2] = 3.0 * way - 2.0 * v0 - v1
        c[3] = -2.0 * way + v0 + v1
        if ddq is not None:
            a0, a1 = span**2 * ddq[:-1] / 2.0, span**2 * ddq[1:] / 2.0
            c[2] = a0
            c[3] = 10.0 * way - 6.0 * v0 - 4.0 * v1 - 3.0 * a0 + a1
            c[4] = -15.0 * way + 8.0 * v0 + 7.0 * v1 + 3.0 * a0 - 2.0 * a1
            c[5] = 6.0 * way - 3.0 * (v0 + v1) - a0 + a1
    c /= span ** np.arange(6)[:, np.newaxis, np.newaxis]
    return PPoly(c[::-1], t)
