# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motion of an arm from one pose to another, from rest to rest, around obstacles."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.geometry.paths import clear_line, find_path
from armid_ros.excitation.limits import check_limits, Limits, SLOW_VELOCITY, SPEED_CLASSES
from armid_ros.excitation.scene import CollisionScene
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
from armid_ros.robots.reference import Reference
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Transfer(Reference):
    """Motion on straight lines in joint space from pose to pose, with a stop at each pose."""

    def __post_init__(self) -> None:
        """Set velocity and acceleration to zero at every waypoint."""
        for name in ('dq', 'ddq'):
            object.__setattr__(self, name, np.zeros_like(self.q))
        super().__post_init__()

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return the motion at given times (N,) [s]; the arm rests before and after the motion."""
        return self.sample(np.clip(np.asarray(t, dtype=float), 0.0, self.duration))

    def lasting(self, duration: float) -> Transfer:
        """Return a transfer along the same path with another duration [s]."""
        return replace(self, t=self.t * (duration / self.duration))

    def reversed(self) -> Transfer:
        """Return the transfer in the opposite direction, from its last pose to its first pose."""
        return replace(self, t=self.duration - self.t[::-1], q=self.q[::-1])


@dataclass(frozen=True)
class TransferPlanner:
    """
    Planner of motions between two poses, within all limits and the clearance.

    Attributes
    ----------
    arm : ArmModel
        Prior model, for the torque.
    limits : Limits
        Limits in force.
    clearance : ClearanceModel or None
        Bodies to keep apart, the floor among them.

    """

    arm: ArmModel
    limits: Limits
    clearance: ClearanceModel | None

    @classmethod
    def of(cls, arm: ArmModel, scene: CollisionScene, speed: str | float) -> TransferPlanner:
        """Return the planner for an arm in a collision scene, for a run at the given speed."""
        clearance = ClearanceModel.of(scene.bodies, scene.clearance)
        return cls(arm, transfer_limits(arm.robot, speed), clearance)

    def __call__(
        self, start: FloatArray, goal: FloatArray, shortest: float = 0.0, seed: int = 0
    ) -> Transfer:
        """
        Plan a motion from a start pose to a goal pose, around obstacles.

        Parameters
        ----------
        start, goal : ndarray, shape (n,)
            Poses [rad or m].
        shortest : float
            Shortest duration [s].
        seed : int
            Seed of the search for a path around obstacles.

        Raises
        ------
        TrajectoryError
            If the start or the goal is not allowed, or no path was found. The message names the
            limit or the bodies.

        """
        limits = self.limits
        # a pose measured slightly beyond a limit is moved onto the limit
        inside = np.clip(start, limits.lower, limits.upper)
        # tolerance beyond a position limit for a measured position [rad or m]
        start = np.where(np.abs(start - inside) <= 0.01, inside, start)
        for end, q in (('start', start), ('goal', goal)):
            fault = self.fault(q)
            if fault:
                raise TrajectoryError(f'the {end} pose is not allowed: {fault}')
        poses = find_path(
            self.clearance,
            (start, goal),
            (limits.lower, limits.upper),
            lambda q: not self._overload(q),
            np.random.default_rng(seed),
        )
        # the path with the duration that the limits require
        distance = np.abs(np.diff(poses, axis=0))
        velocity = np.where(np.isfinite(limits.velocity), limits.velocity, SLOW_VELOCITY)
        # largest velocity and acceleration of a quintic from 0 to 1 in unit time
        needed = np.maximum(
            (1.875 * distance / velocity).max(axis=1),
            np.sqrt((10.0 / np.sqrt(3.0)) * distance / limits.acceleration).max(axis=1),
        )
        # the duration is positive for a transfer without motion, too
        t = np.append(0.0, np.cumsum(np.maximum(needed, 1e-6)))
        transfer = Transfer(limits.joints, t, poses)
        transfer = transfer.lasting(max(transfer.duration, shortest))
        for _ in range(20):  # increasing durations
            # the torque is checked at 200 samples
            motion = transfer.at(np.linspace(0.0, transfer.duration, 200))
            violations = check_limits(limits, motion, self.arm.joint_torque(motion))
            if not violations:
                return transfer
            transfer = transfer.lasting(1.3 * transfer.duration)
        raise TrajectoryError(f'no transfer to the trajectory is within limits: {violations[0]}')

    def fault(self, q: FloatArray) -> str:
        """Return the reason why a pose (n,) is not allowed; empty if it is allowed."""
        violations = check_limits(self.limits, Motion.of_states(self.limits.joints, q, 0.0, 0.0))
        overload = self._overload(q[np.newaxis])
        if violations or overload:
            return '; '.join([*map(str, violations), *filter(None, [overload])])
        near = clear_line(self.clearance, q, q)
        if near is None or self.clearance is None:
            return ''
        return (
            f'{near.first} and {near.second} are {near.distance:.4f} m apart, less than the '
            f'clearance of {self.clearance.margin:g} m'
        )

    @property
    def zero_pose(self) -> FloatArray:
        """Return the pose with all joints at zero, clipped to the position limits with reserve."""
        return self._as_start(self.arm.robot.zero_pose)

    def _as_start(self, q: FloatArray) -> FloatArray:
        """Return poses (..., n) that are clipped to the position limits with reserve."""
        limits = Limits.of(self.arm.robot)
        return np.clip(q, limits.lower, limits.upper)

    def free_start(self) -> FloatArray:
        """
        Return the zero pose if allowed, else the nearest allowed pose found, shape (n,).

        Raises
        ------
        TrajectoryError
            If no pose around zero is allowed.

        """
        zero = self.zero_pose
        reason = self.fault(zero)
        if not reason:
            return zero
        rng = np.random.default_rng(0)
        # 200 random poses around zero at each of these distances
        for distance in (0.1, 0.2, 0.4, 0.8, 1.6, 3.2):
            about = zero + distance * rng.uniform(-1.0, 1.0, (200, len(zero)))
            about = self._as_start(about)
            about = about[np.argsort(np.linalg.norm(about - zero, axis=1))]
            q = next((pose for pose in about if not self.fault(pose)), None)
            if q is None:
                continue
            for j in np.argsort(np.abs(q - zero)):  # zero for all joints for which it is allowed
                other = q.copy()
                other[j] = zero[j]
                if not self.fault(other):
                    q = other
            rounded = np.where(q == zero, zero, np.round(q, 2))  # few decimals, to be typed
            rounded = self._as_start(rounded)
            return q if self.fault(rounded) else rounded
        raise TrajectoryError(
            f'{self.arm.robot.name}: the zero pose is not allowed ({reason}), and no allowed pose '
            'was found around it; give a start pose with --start'
        )

    def _overload(self, q: FloatArray) -> str:
        """Return a message if a joint is too weak to hold the arm in any of N poses (N, n)."""
        if not np.isfinite(self.limits.torque).any():
            return ''
        torque = np.abs(self.arm.joint_torque(Motion.of_states(self.limits.joints, q, 0.0, 0.0)))
        excess = (torque - self.limits.torque).max(axis=0)
        worst = int(np.argmax(excess))
        if excess[worst] <= 0.0:
            return ''
        unit = self.limits.unit('torque', worst)
        return (
            f'joint {self.limits.joints[worst]}: holding still takes '
            f'{torque[:, worst].max():.4g} {unit}, more than its limit of '
            f'{self.limits.torque[worst]:.4g} {unit}'
        )


def transfer_limits(robot: Robot, speed: str | float = 'slow') -> Limits:
    """
    Return the limits for a motion between two poses, at low speed.

    Parameters
    ----------
    robot : Robot
        Robot with the limits; the whole range of motion is used, because the arm may stand at its
        end.
    speed : str or float
        Speed of the run; a transfer is never faster.

    """
    run = Limits.of(robot, speed=speed, reserve=False)
    share = SPEED_CLASSES[speed] if isinstance(speed, str) else float(speed)
    slow = min(1.0, SPEED_CLASSES['slow'] / share)
    # acceleration that is slow for any joint, used with `SLOW_VELOCITY` [rad/s^2 or m/s^2]
    return replace(
        run,
        velocity=np.minimum(run.velocity, np.maximum(slow * run.velocity, SLOW_VELOCITY)),
        acceleration=np.minimum(run.acceleration, np.maximum(slow * run.acceleration, 1.0)),
    )
