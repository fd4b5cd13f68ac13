# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Periodic reference motions of three speed classes: random Fourier series within the limits."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

from tests.hidden.arrays import FloatArray, smooth_step
from tests.hidden.machines import position_range


@dataclass(frozen=True)
class SpeedClass:
    """
    How fast a motion is.

    Attributes
    ----------
    share : float
        Share of the velocity limits that it uses.
    harmonics : int
        Number of harmonics of its period.
    period : float
        Duration of a period [s].

    """

    share: float
    harmonics: int
    period: float


SPEEDS = {
    'slow': SpeedClass(0.15, 4, 9.0),
    'medium': SpeedClass(0.4, 6, 8.0),
    'fast': SpeedClass(0.9, 8, 8.0),
    'other': SpeedClass(0.65, 7, 8.5),  # what the diagnosis is validated with
}

REST, RUN_IN, RUN_OUT = 0.5, 1.5, 1.0  # s
PERIODS = 2

#: Acceleration limit as the time to top speed [s].
TIME_TO_TOP_SPEED = 0.2

#: Share of the torque limits that the rigid arm may need.
TORQUE_SHARE = 0.6

_LARGEST_AMPLITUDE = 1.2  # rad
_DRAWS = 6


@dataclass(frozen=True)
class Reference:
    """
    Rest, run-in along the orbit, two identical periods, run-out, rest.

    Attributes
    ----------
    period : float
        Duration of a period [s].
    starts : tuple of float
        Time at which each period begins [s].
    t : ndarray, shape (N,)
        Time [s].
    q, dq, ddq : ndarray, shape (N, n)
        Desired motion.

    """

    period: float
    starts: tuple[float, ...]
    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray


@dataclass(frozen=True)
class Orbit:
    """q_j = centre_j + sum over k of cosine_jk cos(k w t) + sine_jk sin(k w t)."""

    period: float
    centre: FloatArray
    cosine: FloatArray
    sine: FloatArray

    def at(self, phase: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position and its first and second derivative by the phase [s], each (N, n)."""
        rate = 2.0 * np.pi / self.period * np.arange(1, self.cosine.shape[1] + 1)
        angle = np.multiply.outer(phase, rate)
        c, s = np.cos(angle), np.sin(angle)
        q = self.centre + c @ self.cosine.T + s @ self.sine.T
        dq = (c * rate) @ self.sine.T - (s * rate) @ self.cosine.T
        ddq = -(c * rate**2) @ self.cosine.T - (s * rate**2) @ self.sine.T
        return q, dq, ddq


def draw_orbit(robot: Robot, speed: str, rng: np.random.Generator) -> Orbit:
    """Draw several motions of a speed class and return the one that shows most of the arm."""
    orbits = [_draw_orbit(robot, SPEEDS[speed], rng) for _ in range(_DRAWS)]
    return max(orbits, key=lambda orbit: _richness(robot, orbit))


def reference(orbit: Orbit, dt: float) -> Reference:
    """Run through an orbit from rest to rest, sampled every dt [s]."""
    moving = RUN_IN + PERIODS * orbit.period + RUN_OUT
    t = np.arange(round((2 * REST + moving) / dt) + 1) * dt
    s = np.clip(t - REST, 0.0, moving)
    rising, falling = np.minimum(s / RUN_IN, 1.0), np.clip((moving - s) / RUN_OUT, 0.0, 1.0)
    (rise, rate, _), (fall, fall_rate, _) = smooth_step(rising), smooth_step(falling)
    pace = rise * fall
    change = (rate / RUN_IN - fall_rate / RUN_OUT) * ((s > 0.0) & (s < moving))
    area = RUN_IN * (_area(rising) - _area(1.0)) + np.maximum(s - RUN_IN, 0.0)
    slowed = np.maximum(s - (moving - RUN_OUT), 0.0)
    phase = area - slowed + RUN_OUT * (_area(1.0) - _area(falling))
    q, dq, ddq = orbit.at(phase)
    starts = tuple(REST + RUN_IN + k * orbit.period for k in range(PERIODS))
    pace, change = pace[:, np.newaxis], change[:, np.newaxis]
    return Reference(orbit.period, starts, t, q, dq * pace, ddq * pace**2 + dq * change)


def _draw_orbit(robot: Robot, speed: SpeedClass, rng: np.random.Generator) -> Orbit:
    n, shape = robot.n_joints, (robot.n_joints, speed.harmonics)
    raw = Orbit(speed.period, np.zeros(n), rng.normal(size=shape), rng.normal(size=shape))
    q, dq, ddq = raw.at(np.linspace(0.0, speed.period, 400))
    lower, upper = position_range(robot)
    room = np.minimum(0.9 * (upper - lower), 2.0 * _LARGEST_AMPLITUDE)
    fastest = speed.share * robot.velocity_limit
    largest = np.minimum.reduce(
        [
            room / np.ptp(q, axis=0),
            fastest / np.abs(dq).max(axis=0),
            fastest / TIME_TO_TOP_SPEED / np.abs(ddq).max(axis=0),
        ]
    )
    size = largest * rng.uniform(0.6, 1.0, n)
    margin = 0.02 * (upper - lower)
    low, high = lower + margin - size * q.min(axis=0), upper - margin - size * q.max(axis=0)
    for _ in range(100):
        centre = rng.uniform(low, high)
        orbit = Orbit(
            speed.period, centre, raw.cosine * size[:, np.newaxis], raw.sine * size[:, np.newaxis]
        )
        if _strong_enough(robot, orbit):
            return orbit
        size = 0.97 * size
    raise RuntimeError(f'{robot.name}: no motion keeps its torque limits')


def _strong_enough(robot: Robot, orbit: Orbit) -> bool:
    data = robot.model.createData()
    states = zip(*orbit.at(np.linspace(0.0, orbit.period, 60)), strict=True)
    tau = np.array([pin.rnea(robot.model, data, *state) for state in states])
    return bool(np.all(np.abs(tau) < TORQUE_SHARE * robot.torque_limit))


def _richness(robot: Robot, orbit: Orbit) -> float:
    """Return the logarithm of the volume that the rigid parameters' columns span."""
    data = robot.model.createData()
    states = zip(*orbit.at(np.linspace(0.0, orbit.period, 60)), strict=True)
    rows = [pin.computeJointTorqueRegressor(robot.model, data, *state) for state in states]
    columns = np.concatenate(rows)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-9)
    values = np.linalg.svd(columns, compute_uv=False)
    return float(np.sum(np.log(np.maximum(values, 1e-3))))


def _area(x: FloatArray | float) -> FloatArray | float:
    return x**4 * (2.5 - 3.0 * x + x**2)
