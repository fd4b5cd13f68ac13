# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Gravity as people write it: a celestial body, three numbers in a string, or a vector."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, read_only
import numpy as np

GRAVITIES = {'earth': (0.0, 0.0, -9.81), 'moon': (0.0, 0.0, -1.62)}


def parse_gravity(value: str | Sequence[float] | FloatArray) -> FloatArray:
    """
    Return the gravity vector that a name, a string 'x,y,z' or three numbers stand for.

    Parameters
    ----------
    value : str or array_like, shape (3,)
        'earth', 'moon', 'x,y,z' or the vector itself [m/s^2], in the robot's base frame.

    Returns
    -------
    ndarray, shape (3,)
        Acceleration of gravity [m/s^2], read-only.

    Raises
    ------
    RobotError
        If it is neither a known name nor three finite numbers.

    """
    if isinstance(value, str) and value.strip().lower() in GRAVITIES:
        return read_only(GRAVITIES[value.strip().lower()])
    try:
        numbers = value.split(',') if isinstance(value, str) else value
        vector = np.array([float(number) for number in numbers])
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise RobotError(
            f'gravity {value!r} is neither {" nor ".join(GRAVITIES)} nor three numbers x,y,z '
            f'[m/s^2], such as 0,0,-9.81'
        )
    return read_only(vector)
