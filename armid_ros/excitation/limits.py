# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of the joints, from the description and from the user, and checks of a motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import Any

from armid_ros.errors import TrajectoryError
from armid_ros.files import finite, load_yaml, read_text, reading
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
from armid_ros.robots.robot import position_range
import numpy as np
import numpy.typing as npt

#: URDF has no acceleration limit. By default, a joint may reach its top speed in this time [s].
#: For the first joint of a Panda this gives 8.7 rad/s^2; its data sheet has 15.
TIME_TO_TOP_SPEED = 0.25

#: Velocity limit of a joint without a velocity limit, or with the limit 0 [rad/s or m/s]: 0.5
#: m/s at the end of an arm of 1 m.
SLOW_VELOCITY = 0.5

#: Largest share of the velocity and acceleration limits in a run of each speed class.
SPEED_CLASSES = {'slow': 0.15, 'medium': 0.4, 'fast': 0.9}

#: Relative tolerance of the comparison of numbers with limits.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Limits:
    """
    Bounds on position, velocity, acceleration and torque of every joint, each of shape (n,).

    Attributes
    ----------
    joints : tuple of str
        n joint names.
    lower, upper : ndarray
        Position [rad or m]; may be infinite.
    velocity, acceleration, torque : ndarray
        Largest absolute value [rad/s, rad/s^2, N m, or m/s, m/s^2, N]; may be infinite.
    prismatic : ndarray of bool
        True where a joint slides; for the units in messages.

    """

    joints: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    torque: FloatArray
    prismatic: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Freeze the limits; raise a TrajectoryError if a joint cannot move within the limits."""
        n = len(self.joints)
        for limit in ('lower', 'upper', 'velocity', 'acceleration', 'torque'):
            values = read_only(getattr(self, limit))
            object.__setattr__(self, limit, values)
            if values.shape != (n,):
                raise TrajectoryError(f'limits: {limit} has shape {values.shape}, expected ({n},)')
        for j, joint in enumerate(self.joints):
            if not self.lower[j] < self.upper[j]:
                raise TrajectoryError(
                    f'joint {joint}: its lower position limit, {self.lower[j]:.6g}, has to be '
                    f'below its upper limit, {self.upper[j]:.6g} {self.unit("position", j)}'
                )
            for quantity in ('velocity', 'acceleration', 'torque'):
                limit = getattr(self, quantity)[j]
                if not limit > 0.0:
                    raise TrajectoryError(
                        f'joint {joint}: its {quantity} limit is {limit:g}, but has to be positive'
                    )

    @classmethod
    def of(
        cls,
        robot: Robot,
        *,
        speed: str | float = 'fast',
        reserve: bool = True,
    ) -> Limits:
        """
        Return the limits of a robot at a speed such as 'slow', by default with a safety reserve.

        Parameters
        ----------
        robot : Robot
            Robot with the limits. A joint without a velocity limit gets `SLOW_VELOCITY`; one
            without an acceleration limit reaches its top speed in 0.25 s.
        speed : str or float
            'slow', 'medium' or 'fast', or the share of the velocity and acceleration limits that
            may be used.
        reserve : bool
            Whether a tenth of the torque limits is kept free, as the prior model is not exact,
            and 2 % of the joint's range at every position limit.

        Raises
        ------
        TrajectoryError
            If the speed class does not exist, or a limit leaves no range.

        """
        if isinstance(speed, str) and speed not in SPEED_CLASSES:
            raise TrajectoryError(
                f"there is no speed class '{speed}'; give {', '.join(SPEED_CLASSES)}, or a share "
                'of the limits such as 0.6'
            )
        share = SPEED_CLASSES[speed] if isinstance(speed, str) else float(speed)
        if not 0.0 < share <= 1.0:
            raise TrajectoryError(
                f'speed has to be a share of the limits, above 0 and at most 1, not {share:g}'
            )
        span = robot.upper - robot.lower
        # reserves: 2 % of the range at each end, and a tenth of the torque limit
        margin = 0.02 * reserve * np.where(np.isfinite(span), span, 0.0)
        top = np.where(has_velocity_limit(robot), robot.velocity_limit, SLOW_VELOCITY)
        given = robot.acceleration_limit
        return cls(
            joints=robot.joints,
            lower=robot.lower + margin,
            upper=robot.upper - margin,
            velocity=share * top,
            acceleration=share * np.where(np.isinf(given), top / TIME_TO_TOP_SPEED, given),
            torque=(1.0 - 0.1 * reserve) * robot.torque_limit,
            prismatic=robot.prismatic,
        )

    def position_range(self) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper position limits, (n,) each; finite for unlimited joints, too."""
        return position_range(self.lower, self.upper)

    def unit(self, quantity: str, joint: int) -> str:
        """Return the unit of a joint's 'position', 'velocity', 'acceleration' or 'torque'."""
        slides = bool(self.prismatic[joint])
        length = 'm' if slides else 'rad'
        return {
            'position': length,
            'velocity': f'{length}/s',
            'acceleration': f'{length}/s^2',
            'torque': 'N' if slides else 'N m',
        }[quantity]


def has_velocity_limit(robot: Robot) -> npt.NDArray[np.bool_]:
    """Return a mask of the joints with a finite, positive velocity limit, shape (n,)."""
    return np.isfinite(robot.velocity_limit) & (robot.velocity_limit > 0.0)


@dataclass(frozen=True)
class Violation:
    """
    Limit of a joint that a motion exceeds, at the time of the largest excess.

    Attributes
    ----------
    joint : str
        Joint name.
    limit : str
        'lower position', 'upper position', 'velocity', 'acceleration' or 'torque'.
    time : float
        Time of the largest excess [s].
    value, bound : float
        Value of the motion at this time, and the limit, in ``unit``.
    samples : int
        Number of samples beyond the limit.
    unit : str
        Unit of value and bound.

    """

    joint: str
    limit: str
    time: float
    value: float
    bound: float
    samples: int
    unit: str

    def __str__(self) -> str:
        """Return the exceeded limit in one line of text."""
        return (
            f'joint {self.joint}: {self.limit} {self.value:.4g} {self.unit} at {self.time:.3f} s, '
            f'limit {self.bound:.4g} {self.unit} ({self.samples} samples beyond it)'
        )


def check_limits(
    limits: Limits, motion: Motion, torque: FloatArray | None = None
) -> tuple[Violation, ...]:
    """
    Return the limits that a motion exceeds.

    Parameters
    ----------
    limits : Limits
        The limits.
    motion : Motion
        The motion.
    torque : ndarray, shape (N, n), optional
        Joint torques of the motion, such as ``arm.torque(motion)``; by default ``motion.tau``.
        Without torques, the torque limit is not checked.

    Returns
    -------
    tuple of Violation
        Empty if the motion keeps all limits; otherwise one for every limit exceeded.

    Raises
    ------
    TrajectoryError
        If the joints of the motion are not those of the limits.

    """
    if motion.joints != limits.joints:
        raise TrajectoryError(
            f'the motion has joints {", ".join(motion.joints)}, '
            f'but the limits are for {", ".join(limits.joints)}'
        )
    slack = _ROUNDING * np.where(np.isfinite(limits.upper), np.abs(limits.upper) + 1.0, 1.0)
    checks = [
        ('lower position', motion.q, limits.lower, limits.lower - slack - motion.q),
        ('upper position', motion.q, limits.upper, motion.q - limits.upper - slack),
    ]
    tau = motion.tau if torque is None else torque
    for name, values in (('velocity', motion.dq), ('acceleration', motion.ddq), ('torque', tau)):
        if values is not None:
            bound = getattr(limits, name)
            checks.append((name, values, bound, np.abs(values) - (1.0 + _ROUNDING) * bound))
    found = []
    for name, values, bound, excess in checks:
        for j in np.flatnonzero((excess > 0.0).any(axis=0)):
            worst = int(excess[:, j].argmax())
            found.append(
                Violation(
                    joint=limits.joints[j],
                    limit=name,
                    time=float(motion.t[worst]),
                    value=float(values[worst, j]),
                    bound=float(bound[j]),
                    samples=int(np.count_nonzero(excess[:, j] > 0.0)),
                    unit=limits.unit(name.split()[-1], int(j)),
                )
            )
    return tuple(found)


def require_radians(robot: Robot) -> None:
    """Raise a TrajectoryError if a revolute joint has position limits beyond two turns."""
    for joint, lower, upper, slides in zip(
        robot.joints, robot.lower, robot.upper, robot.prismatic, strict=True
    ):
        ends = [abs(end) for end in (lower, upper) if math.isfinite(end)]
        # limits beyond two turns are probably in degrees
        if not slides and max(ends, default=0.0) > 1.01 * 4.0 * math.pi:
            raise TrajectoryError(
                f'{robot.name}: joint {joint} has position limits {lower:g} and {upper:g} rad, '
                'beyond two turns; are these degrees? Write them in radians, or make the joint '
                'continuous'
            )


def with_joint_limits(
    robot: Robot, path: str | Path | None = None, velocity: Sequence[str] = ()
) -> Robot:
    """
    Return a robot with the given position, velocity and acceleration limits.

    Parameters
    ----------
    robot : Robot
        The arm.
    path : str or Path, optional
        ``joint_limits.yaml`` of MoveIt; a limit applies if its ``has_..._limits`` is true.
        Position and velocity limits wider than those of the description are ignored.
    velocity : sequence of str
        'joint:=value' [rad/s or m/s]; these replace the velocity limits of the file.

    Raises
    ------
    TrajectoryError
        If the file has no limits of the arm's joints, a limit is not a positive number, a position
        range is empty, a joint is unknown, or a velocity exceeds the limit of the description.

    """
    described = np.where(has_velocity_limit(robot), robot.velocity_limit, np.inf)
    if path:
        robot = _with_file(robot, Path(path))
    top = np.array(robot.velocity_limit)
    for text in velocity:
        joint, assigned, number = text.partition(':=')
        if not assigned or joint not in robot.joints:
            raise TrajectoryError(
                f"velocity '{text}' has to be joint:=value, with one of the joints "
                f'{", ".join(robot.joints)}'
            )
        with reading(f'joint {joint}', TrajectoryError):
            top[robot.joints.index(joint)] = _positive(number, 'velocity')
    _require_narrower(robot, 'velocity', top, described)
    return replace(robot, velocity_limit=top)


def with_acceleration_limit(robot: Robot, limit: FloatArray) -> Robot:
    """Return a robot whose acceleration limits are lowered to `limit`, (n,) [rad/s^2 or m/s^2]."""
    limit = np.nan_to_num(limit, nan=np.inf)
    _require_narrower(robot, 'acceleration', limit, robot.acceleration_limit)
    return replace(robot, acceleration_limit=np.minimum(limit, robot.acceleration_limit))


def _require_narrower(
    robot: Robot, quantity: str, given: FloatArray, described: FloatArray
) -> None:
    """Raise a TrajectoryError if a given joint limit exceeds the limit of the description."""
    for joint, value, limit, slides in zip(
        robot.joints, given, described, robot.prismatic, strict=True
    ):
        if math.isfinite(value) and value > limit * (1.0 + _ROUNDING):
            unit = ('m' if slides else 'rad') + ('/s' if quantity == 'velocity' else '/s^2')
            hint = ''
            # in degrees, the value would be a usual share of the limit; 1 % is for rounding
            if not slides and 0.1 * limit <= math.radians(value) <= 1.01 * limit:
                hint = f'; are these degrees? {value:g} degrees are {math.radians(value):.4g} rad'
            raise TrajectoryError(
                f'joint {joint}: the given {quantity} limit of {value:g} {unit} exceeds the limit '
                f'of {limit:g} {unit}; a given limit can only be smaller{hint}'
            )


def _with_file(robot: Robot, path: Path) -> Robot:
    """Return a robot with the limits of a joint_limits.yaml of MoveIt."""
    names = ('velocity_limit', 'acceleration_limit', 'lower', 'upper')
    limits: dict[str, Any] = {name: np.array(getattr(robot, name)) for name in names}
    top, acceleration, lower, upper = limits.values()
    text = read_text(path, TrajectoryError)
    with reading(path, TrajectoryError):
        document = load_yaml(text)
        entries = document.get('joint_limits') if isinstance(document, dict) else None
        if not isinstance(entries, dict):
            raise TrajectoryError('the key joint_limits of MoveIt is missing or not a mapping')
        if not entries.keys() & set(robot.joints):
            raise TrajectoryError(f'joint_limits has none of the joints {", ".join(robot.joints)}')
        for j, joint in enumerate(robot.joints):
            entry = {} if entries.get(joint) is None else entries[joint]
            if not isinstance(entry, dict):
                raise TrajectoryError(f'the entry of joint {joint} is not a mapping of limits')
            if entry.get('has_position_limits'):
                ends = [
                    finite(entry.get(key), f'{joint}: {key}')
                    for key in ('min_position', 'max_position')
                ]
                lower[j], upper[j] = max(lower[j], ends[0]), min(upper[j], ends[1])
                if not lower[j] < upper[j]:
                    raise TrajectoryError(
                        f'{joint}: positions from {ends[0]:g} to {ends[1]:g} are outside the '
                        f'range {robot.lower[j]:g} to {robot.upper[j]:g} of the description'
                    )
            if entry.get('has_velocity_limits'):
                given = _positive(entry.get('max_velocity'), f'{joint}: max_velocity')
                top[j] = min(top[j], given) if top[j] > 0.0 else given
            if entry.get('has_acceleration_limits'):
                most = entry.get('max_acceleration')
                acceleration[j] = _positive(most, f'{joint}: max_acceleration')
    return replace(robot, **limits)


def _positive(value: Any, limit: str) -> float:
    number = finite(value, limit)
    if number <= 0.0:
        raise ValueError(f"{limit} has to be a positive number, not '{value}'")
    return number
