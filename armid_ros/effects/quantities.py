# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Quantities and shapes of effects, and their units."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.robots import Robot
import numpy as np

#: Units on a revolute joint, and the corresponding units on a prismatic joint.
_PRISMATIC_UNITS = {
    'N m': 'N',
    'N m s/rad': 'N s/m',
    'N m s^2/rad^2': 'N s^2/m^2',
    'N m s/(rad K)': 'N s/(m K)',
    'N m/K': 'N/K',
    'N m/rad': 'N/m',
    'rad/(N m)': 'm/N',
    'kg m^2': 'kg',
    'rad': 'm',
    'rad/s': 'm/s',
    '1/rev': '1/(2 pi m)',
}

#: Units for two revolute joints, and the corresponding units if the first is prismatic and the
#: second revolute, or vice versa.
_MIXED_UNITS = {
    'kg m^2': ('kg m', 'kg m'),
    'N m s/rad': ('N s/rad', 'N s/rad'),
    'N m': ('N, N m', 'N m, N'),
    'N m/rad': ('N/rad', 'N/rad'),
    '': ('1/m', 'm'),
}

#: Number of standard deviations of a significant difference.
MIN_Z_SCORE = 3.0


@dataclass(frozen=True)
class Quantity:
    """
    Physical quantity of an effect, with one value per joint or one for the whole arm.

    Attributes
    ----------
    name : str
        Standard term, such as 'viscous_coefficient'.
    unit : str
        SI unit on a revolute joint.
    lower, upper : float
        Physical bounds.
    typical : tuple of float, or None
        Smallest and largest relevant absolute value in arms of 1 to 10 kg.

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
        Return the largest plausible value of the quantity on a joint ('' is the whole arm).

        The size is limited by the bounds, by the torque limit of the joint if described, and by a
        multiple of the typical size. It is inf without any of these limits.

        """
        size = max(self.upper, -self.lower)
        if joint in robot.joints and self.unit == 'N m':
            drive = float(robot.torque_limit[robot.joints.index(joint)])
            size = min(size, drive if drive > 0.0 else np.inf)
        if self.typical is None:
            return size
        # typical sizes are those of arms up to 10 kg; they grow with the mass of a heavier arm
        heavier = max(float(robot.rigid_parameters[::10].sum()) / 10.0, 1.0)
        return min(size, 10.0 * heavier * self.typical[1])


@dataclass(frozen=True)
class Shape:
    """
    Parameter in which the torque of an effect is nonlinear, per joint or for the whole arm.

    Attributes
    ----------
    name : str
        Standard term, such as 'stribeck_velocity'.
    unit : str
        SI unit on a revolute joint.
    lower, upper : float
        Physical bounds.
    default : float
        Default value.
    grid : tuple of float
        Start values of a search; the best value is refined between its neighbours.
    near : float or None
        Relative error of a start value from the data; None if start values are guesses.

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
        Return whether a confidence interval is narrow enough to be informative.

        The interval is uninformative if it covers all possible values. The half width of a
        non-negative shape may be three times the value, or the smallest start value if that is
        larger. The half width of any other shape may be the range of the start values.

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
            return half_width <= 3.0 * max(value, least)
        span = max(self.grid, default=0.0) - min(self.grid, default=0.0)
        return span <= 0.0 or half_width <= span


def joint_unit(unit: str, joint: str, robot: Robot) -> str:
    """Adapt a unit to the type of a joint: 'N m' becomes 'N' on a prismatic joint."""
    slides = joint and robot.slides(joint)
    return _PRISMATIC_UNITS.get(unit, unit) if slides else unit


def pair_unit(unit: str, first: str, second: str, robot: Robot) -> str:
    """
    Adapt a unit to the types of two joints, of which one or both may be prismatic.

    A coupling stiffness between a revolute and a prismatic joint has the unit N/rad. Dry friction
    is a force on one joint and a torque on the other. A share of a torque in the reading of a
    force has the unit 1/m.

    """
    slides = [bool(robot.prismatic[robot.joints.index(joint)]) for joint in (first, second)]
    if slides[0] == slides[1] or unit not in _MIXED_UNITS:
        return joint_unit(unit, first, robot)
    return _MIXED_UNITS[unit][slides[1]]


def written_units(unit: str) -> tuple[str, ...]:
    """Return the forms of a unit for revolute joints, prismatic joints and mixed pairs."""
    return tuple(
        dict.fromkeys((unit, _PRISMATIC_UNITS.get(unit, unit), *_MIXED_UNITS.get(unit, ())))
    )
