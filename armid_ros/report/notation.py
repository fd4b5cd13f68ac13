# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How numbers and units are printed, in figures and in reports alike."""

from __future__ import annotations

import math

from armid_ros.robots import Robot


def pretty(unit: str) -> str:
    """Return a unit as it is printed: 'kg m²' for 'kg m^2'."""
    return unit.replace('^2', '²').replace('^3', '³')


def digits(value: float, count: int = 2) -> str:
    """Return a number with significant digits, zeros kept: '2.0', not '2'; 178, not 1.8e+02."""
    if 10.0**count <= abs(value) < 1e5:
        return f'{value:.0f}'
    return f'{value:#.{count}g}'.rstrip('.')


def measured(value: float, reach: float) -> tuple[str, str]:
    """Return a value and the half width of its interval, to the digit that this leaves."""
    if not (math.isfinite(reach) and reach > 0.0):
        return f'{value:.4g}', '0'
    decimals = max(0, 1 - math.floor(math.log10(reach)))
    if decimals > 7 or max(abs(value), reach) >= 1e7:
        return f'{value:.3g}', f'{reach:.2g}'
    return f'{value:.{decimals}f}', f'{reach:.{decimals}f}'


def counted(number: int, what: str, plural: str = '') -> str:
    """Return a number with its noun: '1 joint', '2 joints'."""
    return f'{number} {what if number == 1 else plural or what + "s"}'


def torque_unit(robot: Robot, joint: int) -> str:
    """Return the unit of a joint's actuator torque: N for one that slides."""
    return 'N' if robot.prismatic[joint] else 'N m'


def position_unit(robot: Robot, joint: int) -> str:
    """Return the unit of a joint's position."""
    return 'm' if robot.prismatic[joint] else 'rad'
