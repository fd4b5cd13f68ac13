# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is recorded of an arm that has lived, at 100 to 500 Hz, with the faults of real logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tests.hidden.arrays import FloatArray
from tests.hidden.sensors import Sensors


@dataclass(frozen=True)
class Instruments(Sensors):
    """
    Encoders, torque readings and the clock.

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
