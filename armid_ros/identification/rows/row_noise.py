# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Noise of torque sensors before and after the filters, and information in a filtered row."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
from scipy import signal

#: Default noise of a torque sensor, over the torque limit of its joint. Only the ratios between
#: joints matter, as the size of the noise then follows from the residuals.
_NOISE_OF_LIMIT = 0.01
#: Noise of a torque over the spread of that torque, assumed before any fit.
NOISE_OF_TORQUE = 0.01


@dataclass(frozen=True)
class RowNoise:
    """
    White noise behind the filters.

    Noise of samples, of standard deviation s and density s^2 T, has the variance s^2 T B behind a
    filter H. Its bandwidth B is the integral of |H|^2 over all frequencies. Rows at intervals of
    `step` hold step B independent observations each.

    Attributes
    ----------
    bandwidth : float
        B [Hz].
    gain : float
        Standard deviation of the noise of a row over that of a sample.
    single : float
        Error of one sample that moves a row as much as noise of 1 in all samples does.

    """

    bandwidth: float
    gain: float
    single: float

    @classmethod
    def of(cls, period: float, motion_pole: float, row_pole: float) -> RowNoise:
        """Return the noise behind motion filter and row filter, given their poles [rad/s]."""
        # integrate the squared gain of both filters over frequency, both signs [Hz]
        nyquist = 0.5 / period
        f = np.linspace(0.0, min(nyquist, 20.0 * row_pole / (2.0 * np.pi)), 4001)
        w = 2.0 * np.pi * f
        power = 1.0 / ((1.0 + (w / motion_pole) ** 2) * (1.0 + (w / row_pole) ** 2)) ** 3
        bandwidth = float(2.0 * np.trapezoid(power, f))
        gain = float(np.sqrt(period * bandwidth))
        # the largest value of the impulse response of both filters in series [1/s]
        ratio = motion_pole / row_pole  # in the time of the row filter
        response = signal.impulse(
            ([], [-ratio] * 3 + [-1.0] * 3, ratio**3), T=np.linspace(0, 20, 401)
        )
        peak = float(row_pole * np.max(response[1]))
        return cls(bandwidth, gain, gain / (period * peak))

    def independent(self, step: float) -> float:
        """Return the number of independent observations in a row, `step` [s] after the last."""
        return min(1.0, self.bandwidth * step)


def sensor_noise(robot: Robot, given: tuple[float, ...] | None) -> FloatArray:
    """Return the noise of the torque of each joint, a share of its limit if not given, (n,)."""
    if given is not None:
        noise = np.array(given, dtype=np.float64)
        if noise.shape != (robot.n_joints,):
            raise IdentificationError(
                f'torque_noise has {noise.size} values, but {robot.name} has {robot.n_joints} '
                f'driven joints: {", ".join(robot.joints)}'
            )
        return noise
    limit = robot.torque_limit
    known = np.isfinite(limit) & (limit > 0.0)
    if not known.any():
        return np.ones(robot.n_joints)
    return _NOISE_OF_LIMIT * np.where(known, limit, np.median(limit[known]))
