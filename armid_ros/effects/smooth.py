# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Columns that are smooth in the motion, with their gradient in reverse: what a search needs.

The direction of motion, sign(dq), has no gradient; while a search runs it is tanh(dq / width).

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np

#: Derivative of a number by the samples q, dq and ddq, each of shape (N, n).
Gradient = tuple[FloatArray, FloatArray, FloatArray]

#: Column of a quantity (N, n), what it depends on (0 q, 1 dq, 2 ddq), and its derivative.
SmoothFactor = tuple[FloatArray, int, FloatArray]


@dataclass(frozen=True)
class SmoothColumns:
    """
    Columns of one effect with their gradient.

    Attributes
    ----------
    columns : ndarray, shape (N, n, P)
        Sensitivities with a smooth direction of motion.
    pullback : callable
        From derivatives of a number by the columns, shape (N, n, P), to those by the samples, or
        to those by the Fourier coefficients, shape (n, 1 + 2 H).

    """

    columns: FloatArray
    pullback: Callable[[FloatArray], Gradient | FloatArray]


def smooth_direction(velocity: FloatArray, width: FloatArray) -> SmoothFactor:
    """Return the direction of a velocity, blurred below a width."""
    sign = np.tanh(velocity / width)
    return sign, 1, (1.0 - sign**2) / width
