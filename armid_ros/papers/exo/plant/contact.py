# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The ground under a foot: a spring of power 1.5, a damper, dry friction.

F = max(0, k d^e + c d'), with the depth d of a point below the ground; across it friction of at
most mu F, by a smooth law of the sliding speed. It is the contact that the source gives in its
Table 3 (IMPACT of ADAMS): k = 100 N/mm^1.5, e = 1.5, c = 1 N s/mm, the damper at work as soon as
there is contact (penetration depth 0), mu = 0.3.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Ground:
    """
    Contact parameters of the ground.

    Attributes
    ----------
    stiffness : float
        k [N/m^e].
    exponent : float
        e [-].
    damping : float
        c [N s/m].
    friction : float
        mu [-].
    creep : float
        Sliding speed at three quarters of the largest friction [m/s]; the source does not describe
        the transition from rest to sliding.

    """

    stiffness: float = 100.0 * 1e3**1.5
    exponent: float = 1.5
    damping: float = 1000.0
    friction: float = 0.3
    creep: float = 0.01

    def force(self, height: FloatArray, rising: FloatArray, sliding: FloatArray) -> FloatArray:
        """
        Return the force on points.

        Parameters
        ----------
        height, rising, sliding : ndarray, shape (...)
            Height of the points above the ground [m], and their velocity up and forward [m/s].

        Returns
        -------
        ndarray, shape (..., 2)
            Forward and up [N].

        """
        depth = np.maximum(-height, 0.0)
        pressed = self.stiffness * depth**self.exponent - self.damping * rising
        up = np.where(height < 0.0, np.maximum(pressed, 0.0), 0.0)
        ahead = -self.friction * up * np.tanh(sliding / self.creep)
        return np.stack([ahead, up], axis=-1)
