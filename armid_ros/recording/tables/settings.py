# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a person says of the columns of a table: which they are, in which unit, on which side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
import numpy as np

#: Beginnings of joint names in the file, or whole names, and what to put there instead.
Rules = Sequence[tuple[str, str]]
#: Seconds in a unit of time.
TIME_UNITS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}


@dataclass(frozen=True)
class ColumnSettings:
    """
    Which columns are what; None where that is to be guessed.

    Attributes
    ----------
    time, position, velocity, effort : str or None
        Columns: a name, the name of an array, names with commas, or a pattern in which '{}' stands
        for the joint's name or number and '{1..7}' for numbers. 'none' for a quantity that is
        not to be read.
    time_unit : str or None
        's', 'ms', 'us' or 'ns'.
    rate_hz : float or None
        Samples per second, for files without a column of time.
    degrees : bool
        Whether positions and velocities are in degrees.
    position_scale, effort_scale : tuple of float
        What values are multiplied with to be rad and N m: one number, or one a joint; a current's
        is the torque constant. Empty for what the unit says.
    zero : tuple of float
        What is added to the positions [rad or m] after all, one a joint; empty for nothing.
    gear : tuple of float
        Turns of the motor for one of the joint, one or one a joint; with them positions,
        velocities and efforts are those of the motors. Empty for none.
    coupling : tuple of (str, str, float)
        Motor, joint, and turns of that motor for one of that other joint, for wrists.
    rename : tuple of (str, str)
        Beginnings of joint names in the file, or whole names, and what to put there instead.
    episode : int or None
        Of a LeRobot dataset.

    """

    time: str | None = None
    position: str | None = None
    velocity: str | None = None
    effort: str | None = None
    time_unit: str | None = None
    rate_hz: float | None = None
    degrees: bool = False
    position_scale: tuple[float, ...] = ()
    effort_scale: tuple[float, ...] = ()
    zero: tuple[float, ...] = ()
    gear: tuple[float, ...] = ()
    coupling: tuple[tuple[str, str, float], ...] = ()
    rename: tuple[tuple[str, str], ...] = ()
    episode: int | None = None

    def __post_init__(self) -> None:
        """Refuse what means nothing."""
        if self.time_unit is not None and self.time_unit not in TIME_UNITS:
            raise RecordingError(f"time unit '{self.time_unit}'; it is {', '.join(TIME_UNITS)}")
        if self.rate_hz is not None and not self.rate_hz > 0.0:
            raise RecordingError(f'rate {self.rate_hz} Hz: it has to be positive')
        if self.coupling and not self.gear:
            raise RecordingError('a coupling of motors needs their gear ratios, too')


def renamed(name: str, rules: Rules) -> str:
    """Return a joint's name after the first rule that fits: the whole name, or its beginning."""
    for old, new in rules:
        if name == old:
            return new
    for old, new in rules:
        if name.startswith(old):
            return new + name[len(old) :]
    return name


def name_in_file(name: str, rules: Rules) -> str:
    """Return what a joint is called in the file, which is what ``renamed`` makes its name of."""
    for old, new in rules:
        if name == new:
            return old
    for old, new in rules:
        if name.startswith(new) and renamed(old + name[len(new) :], rules) == name:
            return old + name[len(new) :]
    return name


def number(text: str) -> float:
    """
    Return a number as people write ratios and angles: '1798/7', '-pi/2', '2*pi', '0.5'.

    Raises
    ------
    RecordingError
        It is none.

    """
    value, sign = 1.0, 1
    bare = text.strip().replace(' ', '')
    pieces = bare.replace('*', '|*').replace('/', '|/').split('|')
    try:
        for piece in pieces:
            sign = -1 if piece.startswith('/') else 1
            piece = piece.lstrip('*/')
            minus = -1.0 if piece.startswith('-') else 1.0
            factor = math.pi if piece.lstrip('+-') == 'pi' else abs(float(piece))
            value *= (minus * factor) ** sign
    except (ValueError, ZeroDivisionError):
        raise RecordingError(f"'{text}' is no number; write 0.5, 1798/7 or -pi/2") from None
    return value


def numbers(text: str | None) -> tuple[float, ...]:
    """Return numbers with commas between them; none for no text."""
    return tuple(number(part) for part in text.split(',')) if text else ()


def per_joint(values: Sequence[float], joints: Sequence[str], what: str) -> FloatArray:
    """Return one value a joint, shape (n,); RecordingError where their number does not fit."""
    if len(values) not in (1, len(joints)):
        raise RecordingError(
            f'{what} has {len(values)} values; give one, or {len(joints)} for {", ".join(joints)}'
        )
    return np.broadcast_to(np.asarray(values, dtype=float), len(joints)).copy()
