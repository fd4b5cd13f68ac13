# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Causal filtering and differentiation of a stream of joint states.

Two low-passes are in series. The motion filter G turns positions into positions, velocities and
accelerations and is applied to the torque as well. The regressor, a nonlinear function of the
motion, is evaluated behind G, and the row filter F is applied to its rows and to the torque. F is
linear and the same on both sides, so the equation tau = Y theta holds for filtered signals, for
any initial state. Only G has to be fast, as F[Y(q)] and Y(F[q]) differ by terms of order (w /
w_F)^2 for a motion of frequency w. With G four times as fast as F, this error is one sixteenth of
the error of a single filter in front of the regressor.

"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass
import math
from typing import NamedTuple

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy import signal as signals

#: Cut-off frequency (-3 dB) of three equal lags in series, divided by that of a single lag.
_CUTOFF_OF_POLE = float(np.sqrt(2.0 ** (1.0 / 3.0) - 1.0))
#: Cut-off of the motion filter over that of the row filter, where the sampling rate allows it.
MOTION_FILTER_RATIO = 4.0
#: Largest valid norm of positions and torques [SI units]; squares of larger numbers dominate all
#: others.
MAX_MAGNITUDE = 1e6


def check_gap(samples: int) -> None:
    """Raise an error if the longest gap to interpolate, in samples, is below 1."""
    if samples < 1:
        raise IdentificationError(
            f'max_gap, the longest interpolated gap, is {samples} samples; it has to be 1 or more'
        )


class TripleLag:
    """
    Low-pass for several signals: three equal first-order lags in series, 1 / (1 + s / pole)^3.

    The response is exact for a signal that is linear between its samples, at any intervals. The
    stages therefore give exact derivatives of the output, also with jitter of the stamps.
    The delay is 3 / pole.

    Parameters
    ----------
    cutoff : float
        Frequency where the gain is -3 dB [Hz].

    """

    def __init__(self, cutoff: float) -> None:
        self.pole = 2.0 * np.pi * cutoff / _CUTOFF_OF_POLE
        self._dt = 0.0
        self._step = np.zeros((3, 5))
        #: States of the three stages, the previous sample of the signal, and its last change.
        self._state: FloatArray | None = None

    @property
    def delay(self) -> float:
        """Delay of the filter for slow signals [s]."""
        return 3.0 / self.pole

    def reset(self) -> None:
        """Clear the state of the filter; the next sample becomes the initial output."""
        self._state = None

    def update(self, dt: float, signal: FloatArray) -> FloatArray:
        """
        Filter the next sample of all signals; return the outputs of the three lags, shape (3, m).

        Parameters
        ----------
        dt : float
            Time since the sample before [s], > 0; not used for the first one.
        signal : ndarray, shape (m,)
            Input.

        Returns
        -------
        ndarray, shape (3, m)
            Output of the three stages; the last one is the output of the filter.

        """
        if self._state is None:
            self._state = np.repeat(signal[np.newaxis], 5, axis=0)
            return self._state[:3].copy()
        if abs(dt - self._dt) > 1e-9 * dt:  # more than the rounding error of the stamps
            self._set_step(dt)
        state = self._state
        np.subtract(signal, state[3], out=state[4])
        stages: FloatArray = np.dot(self._step, state)
        state[:3], state[3] = stages, signal
        return stages

    def _set_step(self, dt: float) -> None:
        """Set the transition matrix of the three lags for a time step [s]."""
        # A ramp u is followed by stage i at u - i * slope / pole; the rest decays.
        x, step = self.pole * dt, self._step
        self._dt = dt
        step[0, 0] = step[1, 1] = step[2, 2] = decay = math.exp(-x)
        step[1, 0] = step[2, 1] = x * decay
        step[2, 0] = 0.5 * x * x * decay
        kept = ending = 0.0
        for stage, share in enumerate((decay, x * decay, 0.5 * x * x * decay)):
            kept += share  # remaining share of an offset that all stages have
            ending += kept
            step[stage, 3] = 1.0 - kept
            step[stage, 4] = 1.0 - (stage + 1.0 - ending) / x


class CausalMotion(NamedTuple):
    """
    Filtered motion and torque of all joints at one time.

    Attributes
    ----------
    t : float
        Time stamp of the newest sample [s].
    q, dq, ddq, tau : ndarray, shape (n,)
        Filtered position, velocity, acceleration, torque.

    """

    t: float
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray


class CausalFilter:
    """
    Motion filter that smooths and differentiates a stream of joint states.

    The sampling period is the median of the first intervals, learned again after every restart.
    A sample of wrong length, with a number that is not finite or a norm above MAX_MAGNITUDE, is
    left out and counted; the signal is interpolated across it. A gap, or a stamp that does not
    increase, restarts the filter. A started filter has no output until its initial state has
    decayed. A `SpikeGate` removes full turns of positions beforehand.

    Parameters
    ----------
    n_joints : int
        Number of joints n.
    cutoff : float
        Frequency of the row filter F [Hz]; G is MOTION_FILTER_RATIO times as fast, or as fast as
        the sampling rate permits.
    max_gap : int
        Missing samples that are interpolated across.
    measured_velocity : bool
        Differentiate the measured velocity instead of the position. Better with coarse encoders,
        worse with drives that filter or delay the velocity.

    Raises
    ------
    IdentificationError
        If a parameter is out of range.

    Attributes
    ----------
    generation : int
        Number of starts; filters behind this one have to restart when it changes.
    period : float or None
        Sampling period [s], None until it is known.
    rejected, restarts : Counter of str
        Samples that were left out, and restarts of the filter, by reason: dropout, jump_back, or
        the argument of `restart`.

    """

    def __init__(
        self,
        n_joints: int,
        cutoff: float,
        *,
        max_gap: int = 10,
        measured_velocity: bool = False,
    ) -> None:
        if not (np.isfinite(cutoff) and cutoff > 0.0):
            raise IdentificationError(f'the cut-off frequency, {cutoff} Hz, has to be above 0')
        check_gap(max_gap)
        self._n_joints = n_joints
        self._cutoff = cutoff
        self.max_gap = max_gap
        self._measured_velocity = measured_velocity
        self._outputs = np.zeros((3, 3))
        self.generation = 0
        self.rejected: Counter[str] = Counter()
        self.restarts: Counter[str] = Counter()
        self._begin()

    def restart(self, reason: str) -> None:
        """Begin a new section of samples after an interruption of the stream."""
        self.restarts[reason] += 1
        self._begin()

    def _begin(self) -> None:
        self.generation += 1
        self.period: float | None = None
        self._intervals: list[float] = []
        self._lag: TripleLag | None = None
        self._start: float | None = None
        self._last: float | None = None
        self._recent: deque[tuple[float, FloatArray]] = deque(maxlen=3 * self.max_gap)

    @property
    def pole(self) -> float | None:
        """Pole of the motion filter [rad/s], None until the sampling period is known."""
        return None if self._lag is None else self._lag.pole

    def signal(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> FloatArray | None:
        """
        Return positions, velocities if used, and torques as one array; None if not valid.

        Parameters
        ----------
        t : float
            Time stamp [s].
        q, dq, tau : array_like, shape (n,)
            Measured position, velocity (or None) and torque.

        Returns
        -------
        ndarray, shape (2 n,) or (3 n,), or None
            None for a sample that is left out.

        """
        parts = [q, dq, tau] if self._measured_velocity and dq is not None else [q, tau]
        if self._measured_velocity and dq is None:
            self.rejected['no_velocity'] += 1
            return None
        arrays = [np.asarray(part, dtype=np.float64) for part in parts]
        for array in arrays:
            if array.shape != (self._n_joints,):
                self.rejected['wrong_length'] += 1
                return None
        signal = np.concatenate(arrays)
        norm = math.hypot(*signal.tolist())
        if not (norm <= MAX_MAGNITUDE and math.isfinite(t)):
            finite = math.isfinite(norm) and math.isfinite(t)
            self.rejected['impossible' if finite else 'not_finite'] += 1
            return None
        return signal

    def advance(self, t: float, signal: FloatArray) -> CausalMotion | None:
        """Filter a joint state; return the filtered motion, None until the filter has settled."""
        dt = 0.0 if self._last is None else t - self._last
        longest = self.max_gap * self.period if self.period else np.inf
        if self._last is not None and not 0.0 < dt <= longest:
            self.restart('dropout' if dt > 0.0 else 'jump_back')
            dt = 0.0
        self._last = t
        if self._lag is None:
            self._learn_period(dt)
            return None
        if self._start is None:
            self._start = t
        missing = self._missing(t, dt, signal)
        for value in (*missing, signal):
            stages = self._lag.update(dt / (len(missing) + 1), value)
        self._recent.append((t, signal))
        # the effect of the initial state of G decays to 1e-6 in 20 time constants
        if t - self._start < 20.0 / self._lag.pole:
            return None
        n = self._n_joints
        outputs = np.dot(self._outputs, stages)
        outputs.setflags(write=False)
        value, slope, bend = outputs
        dq, ddq = (value[n:], bend[n:]) if self._measured_velocity else (slope, bend)
        return CausalMotion(t, value[:n], dq[:n], ddq[:n], value[-n:])

    def _missing(self, t: float, dt: float, signal: FloatArray) -> list[FloatArray]:
        """Return interpolated samples for a gap of `dt` [s] before a sample; empty if no gap."""
        # A straight line would have no acceleration in the gap. A cubic goes through the sample
        # after the gap and three samples before it. Their distances equal the gap, so the cubic
        # has hardly more noise than the samples.
        assert self.period is not None
        # interval between two samples, in periods, above which samples are missing
        count = round(dt / self.period) if dt > 1.5 * self.period else 1
        if count < 2 or not self._recent:
            return []
        last = t - dt
        nearest = (min(self._recent, key=lambda s: abs(s[0] - (last - k * dt))) for k in range(3))
        nodes = [n for k, n in enumerate(nearest) if abs(n[0] - (last - k * dt)) < 0.5 * dt]
        place = np.array([(node_t - last) / dt for node_t, _ in nodes] + [1.0])
        values = np.stack([value for _, value in nodes] + [signal])
        inside = np.arange(1, count) / count
        factors = np.linalg.solve(np.vander(place), values)
        return list(np.vander(inside, len(place)) @ factors)

    def _learn_period(self, dt: float) -> None:
        """Collect a time step [s]; after 20 steps, set the period and create the filter."""
        if dt > 0.0:
            self._intervals.append(dt)
        if len(self._intervals) < 20:  # too few for a median
            return
        self.period = period = float(np.median(self._intervals))
        # with a faster pole, the signal between samples would be relevant
        fastest = 1.0 / period * _CUTOFF_OF_POLE / (2.0 * np.pi)
        self._lag = TripleLag(min(MOTION_FILTER_RATIO * self._cutoff, fastest))
        pole = self._lag.pole
        # Gain of the lag for a second derivative of 1. The signal is straight between samples, so
        # its curvature is at the samples. The output therefore has the sum of the impulse
        # response p^3 t^2 / 2 exp(-p t) instead of its integral.
        decay, relative = math.exp(-pole * period), pole * period
        gain = 0.5 * relative**3 * decay * (1.0 + decay) / (1.0 - decay) ** 3
        curvature = pole * pole / gain
        slope = (0.0, pole, -pole)
        bend = slope if self._measured_velocity else (curvature, -2.0 * curvature, curvature)
        self._outputs = np.array([(0.0, 0.0, 1.0), slope, bend])


@dataclass(frozen=True)
class RowNoise:
    """
    Noise of filtered torques (regression rows), relative to the noise of unfiltered samples.

    Noise of samples, of standard deviation s and density s^2 T, has the variance s^2 T B after a
    filter H. The noise bandwidth B of the filter is the integral of |H|^2 over all frequencies.
    Each row at intervals of `step` holds step B independent observations.

    Attributes
    ----------
    bandwidth : float
        Noise bandwidth B of both filters [Hz].
    gain : float
        Standard deviation of the noise of a row over that of a sample.
    single : float
        Error of one sample that changes a row as much as noise of 1 in all samples does.

    """

    bandwidth: float
    gain: float
    single: float

    @classmethod
    def of(cls, period: float, motion_pole: float, row_pole: float) -> RowNoise:
        """Return the noise of filtered torques for a sample time [s] and filter poles [rad/s]."""
        # impulse response of both filters in series, over and in units of the row filter's pole;
        # its square has the integral of the squared gain over all frequencies (Parseval)
        ratio = motion_pole / row_pole
        times, response = signals.impulse(
            ([], [-ratio] * 3 + [-1.0] * 3, ratio**3), T=np.linspace(0, 20, 401)
        )
        bandwidth = float(row_pole * np.trapezoid(response**2, times))
        gain = float(np.sqrt(period * bandwidth))
        return cls(bandwidth, gain, gain / (period * row_pole * float(np.max(response))))

    def independent(self, step: float) -> float:
        """Return the effective number (at most 1) of observations per row, `step` s apart."""
        return min(1.0, self.bandwidth * step)


def sensor_noise(robot: Robot, given: tuple[float, ...] | None) -> FloatArray:
    """Return the torque noise of each joint, (n,): `given`, or 1 % of the torque limit."""
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
    # default noise of a torque sensor, over the torque limit of its joint. Only the ratios between
    # joints matter, as the size of the noise then follows from the residuals.
    return 0.01 * np.where(known, limit, np.median(limit[known]))
