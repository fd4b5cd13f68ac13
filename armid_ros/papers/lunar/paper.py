# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Values of the paper on the 6-DOF humanoid arm, joint by joint, shoulder first.

Table 3 is the arm on the moon, Table 4 the arm on the moon with 0.3 kg in the hand, Table 6 the
real arm on Earth. The torque columns are peaks; the percentage is the RMSE as a share of the peak.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np

#: Load in the hand in Table 4 [kg].
LOAD = 0.3


@dataclass(frozen=True, eq=False)
class PaperTable:
    """
    One table of the paper.

    Attributes
    ----------
    number : int
        Its number.
    title : str
        Title of the table.
    robot : str
        Shipped robot that represents the arm.
    gravity : str
        'moon' or 'earth'.
    peak : ndarray, shape (6,)
        Peak torque [N m].
    error : ndarray, shape (6,)
        Torque error of the paper [N m]: RMSE, in Table 6 the mean absolute error.
    noise : ndarray, shape (6,)
        Torque noise of the reproduction [N m]. In Table 6, the noise that the paper measured, as
        mean amplitude; otherwise the RMSE of the paper, as standard deviation.

    """

    number: int
    title: str
    robot: str
    gravity: str
    peak: FloatArray
    error: FloatArray
    noise: FloatArray

    @property
    def uniform(self) -> bool:
        """Whether noise and error are mean absolute values."""
        return self.number == 6

    @property
    def ratio(self) -> FloatArray:
        """Return the error relative to the peak, in Table 6 to the noise, shape (6,)."""
        return self.error / (self.noise if self.uniform else self.peak)


def _milli(*values: float) -> FloatArray:
    return np.array(values) * 1e-3


TABLES = (
    PaperTable(
        3,
        'on the moon',
        'humanoid_arm',
        'moon',
        _milli(618.66, 608.73, 147.27, 141.64, 7.27, 1.91),
        _milli(32.64, 39.93, 4.89, 6.79, 0.46, 0.13),
        _milli(32.64, 39.93, 4.89, 6.79, 0.46, 0.13),
    ),
    PaperTable(
        4,
        'on the moon, 0.3 kg in the hand',
        'humanoid_arm_loaded',
        'moon',
        _milli(852.91, 806.69, 270.67, 266.12, 9.95, 4.77),
        _milli(59.60, 36.35, 7.61, 11.46, 0.60, 0.33),
        _milli(59.60, 36.35, 7.61, 11.46, 0.60, 0.33),
    ),
    PaperTable(
        6,
        'on Earth',
        'humanoid_arm',
        'earth',
        np.array([3.50, 4.04, 0.87, 0.89, 0.21, 0.16]),
        np.array([0.16, 0.27, 0.05, 0.07, 0.05, 0.04]),
        np.array([0.46, 0.49, 0.18, 0.17, 0.19, 0.16]),
    ),
)
