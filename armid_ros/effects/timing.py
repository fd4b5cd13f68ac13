# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Late torque readings: by a delay, or by a low-pass filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from armid_ros.effects.base import Arm
from armid_ros.effects.joint_law import joint_columns
from armid_ros.effects.quantities import Quantity
from armid_ros.effects.readings import TorqueReading
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import butter, lfilter, sosfiltfilt


@dataclass(frozen=True)
class LateReading(TorqueReading):
    """Base class of late torque readings; their error is proportional to the rate of torque."""

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """
        Return the derivatives of the late reading by the parameters, shape (N, n, P).

        The derivative is computed along a smoothed motion. The rate of a torque contains the third
        derivative of the positions, and noise in columns biases the values towards zero.

        """
        return super().columns(arm.smoothed(motion), arm)

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return the places where a delay can act: () for the whole arm, or a single joint."""
        return ((), *((joint,) for joint in robot.joints))

    def _joints_of_delays(self, motion: Motion) -> list[list[int]]:
        """Return the joint indices of each delay: a single joint, or all joints."""
        joints = self.indices(motion.joints)
        return [[joint] for joint in joints] or [list(range(motion.n_joints))]


@dataclass(frozen=True)
class TimeDelay(LateReading):
    """
    Torque readings that are delayed relative to the positions, reading(t) = tau(t - delay).

    The torque is cubic between samples, with the slopes of `rate_of_change` (Hermite's spline).
    By default, the whole arm has one delay, as of a late clock or bus; named joints have one
    delay each. To first order, the reading changes by -dtau/dt times delay. At low frequency it
    looks like viscous friction of a loaded joint, at high frequency like negative viscous
    friction. Confounded with torque_lag, which attenuates as well, with joint_elasticity and with
    clocks that differ. Two frequencies, or the slope of the phase, distinguish them.

    """

    name = 'time_delay'
    summary = 'delay of the torque readings relative to the positions'
    quantities = (Quantity('delay', 's', lower=-0.1, upper=0.1, typical=(0.0005, 0.02)),)
    linear = False
    instantaneous = False

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return ()

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the derivative of the reading by the delay, -dtau/dt [N m/s], (N, n, P)."""
        return _as_columns(self, motion, -self._delayed(values, motion, tau, derivative=1))

    def memory(self, values: FloatArray) -> float:
        """Return the longest torque delay [s]."""
        return float(np.max(np.abs(values)))

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return torques [N m] or regressor columns after the delay, shape (N, n, ...)."""
        return self._delayed(values, motion, tau)

    def _delayed(
        self, values: FloatArray, motion: Motion, x: FloatArray, derivative: int = 0
    ) -> FloatArray:
        rate = rate_of_change(motion.t, x)
        shifted = rate.copy() if derivative else x.copy()
        for delay, rows in zip(values, self._joints_of_delays(motion), strict=True):
            if delay:
                curve = CubicHermiteSpline(motion.t, x[:, rows], rate[:, rows])
                shifted[:, rows] = curve(motion.t - float(delay), derivative)
        return np.asarray(shifted)


@dataclass(frozen=True)
class TorqueLag(LateReading):
    """
    Torque readings filtered by a first-order low-pass, T dreading/dt + reading = tau.

    The cause is a current loop or the filter of a sensor. To first order, the reading changes by
    -dtau/dt, as for time_delay. In addition the lag attenuates by 1 / sqrt(1 + (omega T)^2), which
    is visible in motion up to half the bandwidth of the filter.

    """

    name = 'torque_lag'
    summary = 'low-pass of the torque readings: sensor filter, current loop'
    quantities = (Quantity('lag', 's', lower=0.0, upper=0.2, typical=(0.0005, 0.02)),)
    linear = False
    instantaneous = False

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Apply the low-pass to torques [N m] or to regressor columns, shape (N, n, ...)."""
        result = tau.copy()
        for lag, rows in zip(values, self._joints_of_delays(motion), strict=True):
            if lag:
                result[:, rows] = low_pass(motion.t, tau[:, rows], float(lag))
        return result

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the derivative of the reading by the lag [N m/s], shape (N, n, P)."""
        rates = -rate_of_change(motion.t, tau)
        more = 1.0001  # factor between two lags whose difference is the derivative
        for lag, rows in zip(values, self._joints_of_delays(motion), strict=True):
            if lag > 0.0:
                ends = [low_pass(motion.t, tau[:, rows], lag * s) for s in (more, 1 / more)]
                rates[:, rows] = (ends[0] - ends[1]) / (lag * (more - 1 / more))
        return _as_columns(self, motion, rates)

    def memory(self, values: FloatArray) -> float:
        """Return the time after which the slowest filter has settled [s]."""
        # after 20 time constants the output no longer depends on an input
        return 20.0 * float(np.max(np.abs(values)))


def rate_of_change(t: FloatArray, x: FloatArray) -> FloatArray:
    """Return the time derivative of samples x at times t, along the first axis."""
    if len(t) < 2:
        raise ModelError(
            'the motion has fewer than two samples, too few for delay, lag, elasticity or '
            'backlash; use a longer recording, or leave out these effects'
        )
    return np.asarray(np.gradient(x, t, axis=0))


def within_band(motion: Motion, x: FloatArray) -> FloatArray:
    """
    Low-pass filter a signal at the band limit of its motion.

    The second derivative of a torque contains the fourth derivative of the positions, in which
    noise dominates at high frequency. The filter runs forwards and backwards, without a time
    shift.

    """
    if np.isinf(motion.band_hz):
        return x
    rate = (len(motion) - 1) / float(motion.t[-1] - motion.t[0])
    if motion.band_hz >= 0.5 * rate:
        return x
    return np.asarray(sosfiltfilt(_sections(motion.band_hz, rate), x, axis=0))


@lru_cache(maxsize=64)
def _sections(band_hz: float, rate_hz: float) -> FloatArray:
    return np.asarray(butter(3, band_hz, fs=rate_hz, output='sos'))


def smoothed(motion: Motion) -> Motion:
    """Low-pass filter q, dq and ddq of a motion at its band limit."""
    q, dq, ddq = (within_band(motion, x) for x in (motion.q, motion.dq, motion.ddq))
    return replace(motion, q=q, dq=dq, ddq=ddq)


def low_pass(t: FloatArray, x: FloatArray, lag: float) -> FloatArray:
    """
    Filter samples by a first-order low-pass, T dy/dt + y = x, with T = `lag` [s].

    Samples are evenly spaced and begin at a constant rate. The filter is computed as y = x - T v,
    where v is the filtered rate of x, and the rate is linear between samples. It is of second
    order in the step for any ratio of lag and step. A negative lag advances the signal.

    """
    rate = rate_of_change(t, x)
    if lag <= 0.0:
        return np.asarray(x - lag * rate)
    step = float(t[-1] - t[0]) / (len(t) - 1) / lag
    decay, mean = np.exp(-step), -np.expm1(-step) / step
    numerator, denominator = [1.0 - mean, mean - decay], [1.0, -decay]
    filtered = rate.copy()
    before = (decay + numerator[1]) * rate[:1]
    filtered[1:], _ = lfilter(numerator, denominator, rate[1:], axis=0, zi=before)
    return np.asarray(x - lag * filtered)


def _as_columns(effect: TorqueReading, motion: Motion, values: FloatArray) -> FloatArray:
    """Arrange derivatives (N, n) as a regressor: a column per joint, or one for the whole arm."""
    if effect.joints:
        return joint_columns(effect, motion, values)
    return values[:, :, np.newaxis]
