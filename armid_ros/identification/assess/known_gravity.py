# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a person would write a gravity vector that data show."""

from __future__ import annotations

from armid_ros.motion import FloatArray
from armid_ros.robots import GRAVITIES
import numpy as np

#: Free values that are within this of an axis [degrees] are written as that axis.
_AXIS = 15.0


def known_gravity(vector: FloatArray, told: FloatArray) -> tuple[FloatArray, str]:
    """
    Write a gravity vector that was found as a person would.

    Parameters
    ----------
    vector : ndarray, shape (3,)
        As it was found [m/s^2].
    told : ndarray, shape (3,)
        As described; its magnitude is kept where the estimated one is close.

    Returns
    -------
    direction : ndarray, shape (3,)
        Unit vector; that of an axis where it is near.
    option : str
        What to give to --gravity.

    """
    size = float(np.linalg.norm(vector))
    direction = vector / size
    axis = np.round(direction)
    if np.count_nonzero(axis) == 1 and direction @ axis > np.cos(np.deg2rad(_AXIS)):
        direction = axis + 0.0
    sizes = [float(np.linalg.norm(told)), *(-value[2] for value in GRAVITIES.values())]
    near = min(sizes, key=lambda known: abs(np.log(size / max(known, 1e-9))))
    size = near if 0.75 < size / max(near, 1e-9) < 1.33 else size
    for name, value in GRAVITIES.items():
        if np.allclose(size * direction, value, atol=1e-6):
            return direction, name
    return direction, ','.join(f'{part:.3g}' for part in size * direction + 0.0)
