# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is recorded: encoders that count, torques with coloured noise, stamps that jitter."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.recording import Recording
import numpy as np
from scipy.signal import lfilter

from tests.hidden.arrays import coloured_noise, FloatArray, sampled, Signals, START_NS


@dataclass(frozen=True)
class Sensors:
    """
    The instruments of an arm.

    Attributes
    ----------
    rate : float
        Samples per second [Hz].
    resolution : float
        Step of the encoders [rad].
    position_noise : float
        Standard deviation of the position before it is counted [rad].
    torque_noise : ndarray, shape (n,)
        Standard deviation of the torque [N m]; half of its variance is white, the other half
        has the correlation time.
    correlation_time : float
        Of the coloured half [s].
    jitter : float
        Standard deviation of the difference between a stamp and when the sample was taken [s].

    """

    rate: float
    resolution: float
    position_noise: float
    torque_noise: FloatArray
    correlation_time: float
    jitter: float

    @classmethod
    def draw(
        cls, torque: FloatArray, drive: FloatArray, rng: np.random.Generator, scale: float = 1.0
    ) -> Sensors:
        """
        Draw instruments for an arm.

        Parameters
        ----------
        torque : ndarray, shape (n,)
            Rms torque of the joints [N m].
        drive : ndarray, shape (n,)
            Size of the drives [N m], below a thousandth of which nobody measures.
        rng : Generator
            Source of randomness.
        scale : float
            Factor on the torque noise.

        """
        level = scale * np.exp(rng.uniform(np.log(0.005), np.log(0.03)))
        return cls(
            rate=200.0,
            resolution=2.0 * np.pi / 2.0 ** int(rng.integers(17, 21)),
            position_noise=float(np.exp(rng.uniform(np.log(5e-6), np.log(5e-5)))),
            torque_noise=level * torque + scale * 1e-3 * drive,
            correlation_time=float(rng.uniform(0.005, 0.02)),
            jitter=float(rng.choice([0.0, 5e-5, 2e-4])),
        )

    def stamps(self, t: FloatArray) -> FloatArray:
        """Return when samples are due within a time [s], shape (N,)."""
        return np.arange(int(t[-1] * self.rate) - 1) / self.rate

    def positions(self, q: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return positions as the encoders count them."""
        noisy = q + self.position_noise * rng.normal(size=q.shape)
        return self.resolution * np.round(noisy / self.resolution)

    def torques(self, tau: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return torques with noise, half white and half coloured."""
        noise = coloured_noise(tau.shape, self.rate * self.correlation_time, rng)
        return tau + self.torque_noise * noise

    @property
    def speed_noise(self) -> float:
        """Standard deviation of a velocity [rad/s]."""
        return (self.position_noise + 0.3 * self.resolution) * self.rate

    def record(
        self, signals: Signals, joints: tuple[str, ...], rng: np.random.Generator
    ) -> Recording:
        """Sample the signals as these instruments do."""
        stamps = self.stamps(signals.t)
        taken = np.clip(stamps + self.jitter * rng.normal(size=len(stamps)), 0.0, signals.t[-1])
        q, dq, tau = (sampled(taken, signals.t, x) for x in (signals.q, signals.dq, signals.tau))
        return Recording(
            joints=joints,
            t=stamps,
            q=self.positions(q, rng),
            dq=dq + self.speed_noise * rng.normal(size=dq.shape),
            tau=self.torques(tau, rng),
            start_ns=START_NS,
        )

    def perfect(self, signals: Signals, joints: tuple[str, ...]) -> Recording:
        """Return what instruments without noise, steps and jitter would record."""
        stamps = self.stamps(signals.t)
        q, dq, tau = (sampled(stamps, signals.t, x) for x in (signals.q, signals.dq, signals.tau))
        return Recording(joints=joints, t=stamps, q=q, dq=dq, tau=tau)


@dataclass(frozen=True)
class Instruments(Sensors):
    """
    The instruments of an arm that has lived: 100 to 500 Hz, with the faults of real logs.

    Attributes
    ----------
    velocity : {'none', 'measured', 'differentiated'}
        What is recorded of the velocity.

    """

    velocity: str

    @classmethod
    def of(cls, strength: FloatArray, rng: np.random.Generator) -> Instruments:
        """Draw instruments for joints of some strength [N m]."""
        level = np.exp(rng.uniform(np.log(0.004), np.log(0.02)))
        return cls(
            rate=float(rng.choice([100.0, 125.0, 200.0, 250.0, 500.0])),
            jitter=float(rng.choice([2e-5, 1e-4, 3e-4])),
            resolution=2.0 * np.pi / 2.0 ** int(rng.integers(16, 21)),
            position_noise=float(np.exp(rng.uniform(np.log(5e-6), np.log(3e-5)))),
            torque_noise=level * strength,
            correlation_time=float(np.exp(rng.uniform(np.log(0.005), np.log(0.08)))),
            velocity=str(rng.choice(['none', 'measured', 'differentiated'])),
        )

    def taken(self, stamps: FloatArray, end: float, rng: np.random.Generator) -> FloatArray:
        """Return when samples are really taken [s], shape (N,)."""
        error = np.clip(rng.normal(size=len(stamps)), -3.0, 3.0)
        return np.clip(stamps + self.jitter * error, 0.0, end)

    def velocities(
        self, dq: FloatArray, counted: FloatArray, rng: np.random.Generator
    ) -> FloatArray | None:
        """Return velocities as they are recorded."""
        noise = rng.normal(size=dq.shape)
        if self.velocity == 'none':
            return None
        if self.velocity == 'measured':
            return dq + self.speed_noise * 0.2 * noise
        backward = np.zeros_like(counted)
        backward[1:] = np.diff(counted, axis=0) * self.rate
        return lfilter([0.4], [1.0, -0.6], backward, axis=0)
