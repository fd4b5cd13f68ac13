# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What describes an effect in numbers: its quantities, its shapes, and their units."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.robots import Robot
import numpy as np

#: A unit of a revolute joint and what it becomes on a prismatic one.
_PRISMATIC_UNITS = {
    'N m': 'N',
    'N m s/rad': 'N s/m',
    'N m s^2/rad^2': 'N s^2/m^2',
    'N m/rad': 'N/m',
    'rad/(N m)': 'm/N',
    'kg m^2': 'kg',
    'rad': 'm',
    'rad/s': 'm/s',
    '1/rev': '1/(2 pi m)',
}

#: Units of two joints that turn, and what they are where the first slides and the second turns, or
#: the other way round.
_MIXED_UNITS = {
    'kg m^2': ('kg m', 'kg m'),
    'N m s/rad': ('N s/rad', 'N s/rad'),
    'N m': ('N, N m', 'N m, N'),
    'N m/rad': ('N/rad', 'N/rad'),
    '': ('1/m', 'm'),
}

#: No arm has more than so many times what arms of 1 to 10 kg have, but where it weighs more.
_BEYOND_TYPICAL = 10.0
_TYPICAL_MASS = 10.0
#: Multiple of a scale from which on the half width of its interval says nothing of it.
_SCALE_KNOWN = 3.0
#: Standard deviations by which a value surely differs from another.
SURELY = 3.0


@dataclass(frozen=True)
class Quantity:
    """
    One physical quantity that an effect has per joint, or once for the arm.

    Attributes
    ----------
    name : str
        Standard term, such as 'viscous_coefficient'.
    unit : str
        SI unit on a revolute joint.
    lower, upper : float
        What is physically possible.
    typical : tuple of float, or None
        Smallest and largest size that arms of 1 to 10 kg have, where it matters; a sign does not.

    Examples
    --------
    >>> import armid_ros as ar
    >>> ar.Quantity('hose_stiffness', 'N m/rad^3', lower=0.0, typical=(0.1, 10.0)).unit
    'N m/rad^3'

    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    typical: tuple[float, float] | None = None

    def largest(self, joint: str, robot: Robot) -> float:
        """
        Return the largest size that it can have on a joint of a robot, or on all of it (`''`).

        It is within the bounds, no torque is more than the drive gives where that is described,
        and nothing is far beyond what is typical; inf where none of these says anything.

        """
        size = max(self.upper, -self.lower)
        if joint and self.unit == 'N m':
            drive = float(robot.torque_limit[robot.joints.index(joint)])
            size = min(size, drive if drive > 0.0 else np.inf)
        if self.typical is None:
            return size
        heavier = max(float(robot.rigid_parameters[::10].sum()) / _TYPICAL_MASS, 1.0)
        return min(size, _BEYOND_TYPICAL * heavier * self.typical[1])


@dataclass(frozen=True)
class Shape:
    """
    One parameter that the torque does not depend on linearly, per owner of an effect.

    Attributes
    ----------
    name : str
        Standard term, such as 'stribeck_velocity'.
    unit : str
        SI unit on a revolute joint.
    lower, upper : float
        What is physically possible.
    default : float
        Value of an effect that was given none.
    grid : tuple of float
        Where a search starts from; values between which the best one is refined.
    near : float or None
        Share of a start from the data by which it may be wrong; None where a start is a guess.

    """

    name: str
    unit: str
    lower: float
    upper: float
    default: float
    grid: tuple[float, ...]
    near: float | None = None

    def determined(self, value: float, half_width: float) -> bool:
        """
        Return whether an interval of it says anything.

        It does not where it leaves out nothing that is possible, or for a scale, which is not
        negative, is wider than three times its value. A scale that may be nothing is compared with
        the smallest that is looked for, any other shape with the range of those.

        Parameters
        ----------
        value, half_width : float
            The estimate, and half of its 95 % interval.

        """
        if not np.isfinite(value) or not np.isfinite(half_width):
            return False
        if value - half_width <= self.lower and value + half_width >= self.upper:
            return False
        if self.lower >= 0.0:
            least = min((start for start in self.grid if start > 0.0), default=0.0)
            return half_width <= _SCALE_KNOWN * max(value, least)
        span = max(self.grid, default=0.0) - min(self.grid, default=0.0)
        return span <= 0.0 or half_width <= span


def joint_unit(unit: str, joint: str, robot: Robot) -> str:
    """Return a unit as it is on the joint: 'N m' is 'N' on a prismatic one."""
    slides = joint and robot.prismatic[robot.joints.index(joint)]
    return _PRISMATIC_UNITS.get(unit, unit) if slides else unit


def pair_unit(unit: str, first: str, second: str, robot: Robot) -> str:
    """
    Return a unit as it is between two joints, one of which may slide.

    A stiffness makes of the turn of one a force of the other, and of its way a torque: both are
    N/rad. Dry friction is a force of the one and a torque of the other. A share of a torque in the
    reading of a force is 1/m.

    """
    slides = [bool(robot.prismatic[robot.joints.index(joint)]) for joint in (first, second)]
    if slides[0] == slides[1] or unit not in _MIXED_UNITS:
        return joint_unit(unit, first, robot)
    return _MIXED_UNITS[unit][slides[1]]


def written_units(unit: str) -> tuple[str, ...]:
    """Return all that a unit can be on joints that turn or slide, or between two of them."""
    return tuple(
        dict.fromkeys((unit, _PRISMATIC_UNITS.get(unit, unit), *_MIXED_UNITS.get(unit, ())))
    )
