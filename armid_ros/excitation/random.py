# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Random trajectories within the limits: where a search starts, and what it has to beat."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.limits import Limits
from armid_ros.robots import CollisionModel
import numpy as np

#: Trajectories drawn before it is said that none was found.
ATTEMPTS = 200

#: Samples per period and harmonic at which a drawn trajectory is looked at.
_SAMPLES_PER_HARMONIC = 40

#: Share of the range that an unlimited joint is given, either way [rad or m].
_UNLIMITED_HALF_RANGE = np.pi


def random_feasible(
    arm: ArmModel,
    limits: Limits,
    period: float,
    harmonics: int,
    rng: np.random.Generator,
    *,
    collision: CollisionModel | None = None,
    margin: float = 0.0,
    attempts: int = ATTEMPTS,
) -> FourierTrajectory:
    """
    Draw a random trajectory that keeps the limits and hits nothing.

    Coefficients are normal, position amplitudes equal over the harmonics; each joint is scaled
    to a random share of the most that its limits allow, about a random centre.

    Parameters
    ----------
    arm : ArmModel
        Prior model, for the torque.
    limits : Limits
        What is allowed.
    period : float
        Period [s].
    harmonics : int
        Number of harmonics.
    rng : Generator
        Source of randomness.
    collision : CollisionModel, optional
        Bodies to keep apart.
    margin : float
        Clearance to keep [m].
    attempts : int
        Trajectories to try.

    Raises
    ------
    TrajectoryError
        If none was found; says what the last ones failed on.

    """
    reasons: dict[str, int] = {}
    for _ in range(attempts):
        trajectory = _draw(limits, period, harmonics, rng)
        for _ in range(6):  # towards smaller motions about the same centre
            reason = _fault(arm, limits, trajectory, collision, margin)
            if reason is None:
                return trajectory
            reasons[reason] = reasons.get(reason, 0) + 1
            trajectory = trajectory.scaled(0.7)
    raise TrajectoryError(
        f'no random trajectory of {attempts} kept within all limits; they failed on '
        + ', '.join(f'{reason} ({count}x)' for reason, count in sorted(reasons.items()))
    )


def _draw(
    limits: Limits, period: float, harmonics: int, rng: np.random.Generator
) -> FourierTrajectory:
    n = len(limits.joints)
    k = np.arange(1, harmonics + 1)
    raw = FourierTrajectory(
        limits.joints,
        period,
        np.zeros(n),
        k * rng.normal(size=(n, harmonics)),
        k * rng.normal(size=(n, harmonics)),
    )
    motion = raw.one_period(_SAMPLES_PER_HARMONIC * harmonics)
    low, high = motion.q.min(axis=0), motion.q.max(axis=0)
    lower = np.where(np.isfinite(limits.lower), limits.lower, -_UNLIMITED_HALF_RANGE)
    upper = np.where(np.isfinite(limits.upper), limits.upper, _UNLIMITED_HALF_RANGE)
    largest = np.minimum.reduce(
        [
            (upper - lower) / (high - low),
            limits.velocity / np.abs(motion.dq).max(axis=0),
            limits.acceleration / np.abs(motion.ddq).max(axis=0),
        ]
    )
    scaled = raw.scaled(largest * rng.uniform(0.3, 0.98, n))
    factor = scaled.a[:, 0] / raw.a[:, 0]
    room_low, room_high = lower - factor * low, upper - factor * high
    centre = rng.uniform(room_low, room_high)
    return FourierTrajectory(limits.joints, period, centre, scaled.a, scaled.b)


def _fault(
    arm: ArmModel,
    limits: Limits,
    trajectory: FourierTrajectory,
    collision: CollisionModel | None,
    margin: float,
) -> str | None:
    """Say what a trajectory does wrong, or None."""
    motion = trajectory.one_period(_SAMPLES_PER_HARMONIC * trajectory.harmonics)
    if np.isfinite(limits.torque).any():
        excess = np.abs(arm.torque(motion)).max(axis=0) - limits.torque
        if excess.max() > 0.0:
            return f'torque of joint {limits.joints[int(excess.argmax())]}'
    if collision is not None and collision.path_clearance(motion.q).min() < margin:
        return 'collision'
    return None
