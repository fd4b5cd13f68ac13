# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Torque readings that come late: by a delay, or through a low-pass."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace

from armid_ros.effects.base import Arm
from armid_ros.effects.layout import joint_columns
from armid_ros.effects.quantities import Quantity
from armid_ros.effects.readings import TorqueReading
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt
from scipy.sparse import csr_array

#: Time constants after which a low-pass has forgotten what went in.
_FORGOTTEN = 20.0
#: Factor between two lags whose difference is the derivative.
_MORE = 1.0001


@dataclass(frozen=True)
class LateReading(TorqueReading):
    """A reading that comes late, which shows in how fast the torque changes."""

    @abstractmethod
    def _late(self, values: FloatArray, motion: Motion, x: FloatArray) -> FloatArray:
        """Return what has come of signals of all joints, shape (N, n, ...)."""

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the torque as it comes, shape (N, n) [N m]."""
        return self._late(values, motion, tau)

    def transfer(
        self, values: FloatArray, motion: Motion, tau: FloatArray, columns: FloatArray
    ) -> FloatArray:
        """Return the columns, as late as the torque."""
        return self._late(values, motion, columns)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """
        Return the derivative of the reading, shape (N, n, P).

        It is taken along the motion without the noise of positions: the rate of a torque is a
        third derivative of them, and noise in columns makes the values too small.

        """
        return super().columns(arm.smoothed(motion), arm)

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return the whole arm, whose drives and clocks are alike, and every joint."""
        return ((), *((joint,) for joint in robot.joints))

    def _owned(self, motion: Motion) -> list[list[int]]:
        """Return the joints that each of its owners has: all of them, or one."""
        joints = self.indices(motion.joints)
        return [[joint] for joint in joints] or [list(range(motion.n_joints))]


@dataclass(frozen=True)
class TimeDelay(LateReading):
    """
    Torque readings older than the positions they are recorded with, reading(t) = tau(t - delay).

    Of the whole arm by default, where one clock or one bus is behind; of joints that are named,
    each has its own. The first order is -dtau/dt. At low frequency it looks like viscous friction
    where the joint is loaded, at high frequency like negative one; confounded with torque_lag,
    which attenuates as well, with joint_elasticity and with clocks that disagree. Two frequencies,
    or the slope of the phase, tell.

    """

    name = 'time_delay'
    summary = 'torque readings older than the positions they are recorded with'
    quantities = (Quantity('delay', 's', lower=-0.1, upper=0.1, typical=(0.0005, 0.02)),)
    linear = False
    instantaneous = False

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return ()

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return -dtau/dt of earlier [N m/s], shape (N, n, P)."""
        slope = -self._late(values, motion, tau, derivative=1)
        return _by_owner(self, motion, slope)

    def memory(self, values: FloatArray) -> float:
        """Return the longest delay [s]."""
        return float(np.max(np.abs(values)))

    def _late(
        self, values: FloatArray, motion: Motion, x: FloatArray, derivative: int = 0
    ) -> FloatArray:
        earlier = rate_of_change(motion.t, x) if derivative else x
        shifted = earlier.copy()
        for delay, rows in zip(values, self._owned(motion), strict=True):
            if delay:
                weights = earlier_samples(motion.t, float(delay), derivative)
                own = x[:, rows]
                shifted[:, rows] = (weights @ own.reshape(len(x), -1)).reshape(own.shape)
        return np.asarray(shifted)


@dataclass(frozen=True)
class TorqueLag(LateReading):
    """
    Torque readings through a low-pass of the first order, T dreading/dt + reading = tau.

    A current loop, or the filter of a sensor. The first order is -dtau/dt, as of time_delay;
    beyond it the lag attenuates by 1 / sqrt(1 + (omega T)^2), which motion up to half its
    bandwidth shows.

    """

    name = 'torque_lag'
    summary = 'torque readings behind a low-pass: sensor filter, current loop'
    quantities = (Quantity('lag', 's', lower=0.0, upper=0.2, typical=(0.0005, 0.02)),)
    linear = False
    instantaneous = False

    def _late(self, values: FloatArray, motion: Motion, x: FloatArray) -> FloatArray:
        result = x.copy()
        for lag, rows in zip(values, self._owned(motion), strict=True):
            if lag:
                result[:, rows] = low_pass(motion.t, x[:, rows], float(lag))
        return result

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return dreading/dT [N m/s], which is -dtau/dt where the lag is zero, (N, n, P)."""
        rates = -rate_of_change(motion.t, tau)
        for lag, rows in zip(values, self._owned(motion), strict=True):
            if lag > 0.0:
                ends = [low_pass(motion.t, tau[:, rows], lag * s) for s in (_MORE, 1 / _MORE)]
                rates[:, rows] = (ends[0] - ends[1]) / (lag * (_MORE - 1 / _MORE))
        return _by_owner(self, motion, rates)

    def memory(self, values: FloatArray) -> float:
        """Return the time after which the slowest filter has forgotten [s]."""
        return _FORGOTTEN * float(np.max(np.abs(values)))


def rate_of_change(t: FloatArray, x: FloatArray) -> FloatArray:
    """Differentiate samples along the first axis."""
    _require_change(t)
    return np.asarray(np.gradient(x, t, axis=0))


def _require_change(t: FloatArray) -> None:
    if len(t) < 2:
        raise ModelError(
            'delay, lag, elasticity and backlash depend on how the torque changes: they need a '
            'motion of two samples or more'
        )


def earlier_samples(t: FloatArray, delay: float, derivative: int = 0) -> csr_array:
    """
    Return how samples of earlier, or their derivative, are made of samples, shape (N, N).

    By the cubic between neighbours with the slopes of `rate_of_change` at both; beyond the ends
    the first and the last cubic go on. All columns of a model are delayed alike, so that the
    weights are made once and few.

    """
    _require_change(t)
    count = len(t)
    at = np.clip(np.searchsorted(t, t - delay, side='right') - 1, 0, count - 2)
    step = t[at + 1] - t[at]
    u = (t - delay - t[at]) / step
    if derivative:
        rise = 6.0 * u * (1.0 - u) / step
        value, slope = (-rise, rise), ((1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0))
    else:
        rise = u**2 * (3.0 - 2.0 * u)
        value = 1.0 - rise, rise
        slope = step * u * (1.0 - u) ** 2, -step * u**2 * (1.0 - u)
    lower, middle, upper = _slopes(t)
    weights = (
        slope[0] * lower[at],
        value[0] + slope[0] * middle[at] + slope[1] * lower[at + 1],
        value[1] + slope[0] * upper[at] + slope[1] * middle[at + 1],
        slope[1] * upper[at + 1],
    )
    samples = np.clip(at[:, np.newaxis] + np.arange(-1, 3), 0, count - 1)
    starts = 4 * np.arange(count + 1)
    return csr_array(
        (np.column_stack(weights).ravel(), samples.ravel(), starts), shape=(count, count)
    )


def _slopes(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the weights of the sample before, of its own and after in `rate_of_change`, (N,)."""
    before, after = np.diff(t)[:-1], np.diff(t)[1:]
    first, last = 1.0 / (t[1] - t[0]), 1.0 / (t[-1] - t[-2])
    lower = np.concatenate([[0.0], -after / (before * (before + after)), [-last]])
    middle = np.concatenate([[-first], (after - before) / (before * after), [last]])
    upper = np.concatenate([[first], before / (after * (before + after)), [0.0]])
    return lower, middle, upper


def within_band(motion: Motion, x: FloatArray) -> FloatArray:
    """
    Take from what follows a motion what is beyond the band of the motion.

    The second derivative of a torque is the fourth of positions, of which noise is the larger
    part at high frequency. The filter goes forth and back, without a shift in time.

    """
    if np.isinf(motion.band_hz):
        return x
    rate = (len(motion) - 1) / float(motion.t[-1] - motion.t[0])
    if motion.band_hz >= 0.5 * rate:
        return x
    return np.asarray(sosfiltfilt(butter(3, motion.band_hz, fs=rate, output='sos'), x, axis=0))


def smoothed(motion: Motion) -> Motion:
    """Take from positions, velocities and accelerations what is beyond the band of the motion."""
    q, dq, ddq = (within_band(motion, x) for x in (motion.q, motion.dq, motion.ddq))
    return replace(motion, q=q, dq=dq, ddq=ddq)


def low_pass(t: FloatArray, x: FloatArray, lag: float) -> FloatArray:
    """
    Filter samples on an even time base, T dy/dt + y = x, from a start in steady change.

    As y = x - T v, where v is the filtered rate of x, with the rate linear between samples: right
    to second order in the step for lags longer and shorter than it. A negative lag leads.

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


def _by_owner(effect: TorqueReading, motion: Motion, values: FloatArray) -> FloatArray:
    """Place sensitivities (N, n): in a column per joint, or in one for the whole arm."""
    if effect.joints:
        return joint_columns(effect, motion, values)
    return values[:, :, np.newaxis]
