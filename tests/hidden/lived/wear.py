# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What every arm that has lived has: the clutter of its drives, its gears and its dress pack.

It is there on both days alike, and no part of it is what happened between them.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.hidden.arrays import FloatArray

#: Change of friction from one recording to the next, as a share.
FRICTION_SPREAD = 0.01


@dataclass(frozen=True)
class Wear:
    """
    Clutter of all joints; arrays of shape (n,).

    Attributes
    ----------
    viscous, coulomb : ndarray
        Friction [N m s/rad, N m].
    stribeck, stribeck_speed : ndarray
        Dry friction that is more at low speed [N m], and at which speed [rad/s].
    load_share : ndarray
        Dry friction per torque of the rigid arm.
    presliding : ndarray
        Way after which friction has turned [rad].
    ripple, order, phase : ndarray
        Torque that repeats [N m], how often a turn [1/rev], and where.
    rotor : ndarray
        Inertia of the rotors [kg m^2].
    spring, rest : ndarray
        Stiffness of the dress pack [N m/rad] and where it is at rest [rad].
    gain, offset : ndarray
        Error of the reported effort, as a share, and [N m].
    lag : float
        Time constant of the low-pass that the drives report through [s].

    """

    viscous: FloatArray
    coulomb: FloatArray
    stribeck: FloatArray
    stribeck_speed: FloatArray
    load_share: FloatArray
    presliding: FloatArray
    ripple: FloatArray
    order: FloatArray
    phase: FloatArray
    rotor: FloatArray
    spring: FloatArray
    rest: FloatArray
    gain: FloatArray
    offset: FloatArray
    lag: float

    @classmethod
    def draw(
        cls, strength: FloatArray, speed: FloatArray, inertia: FloatArray, rng: np.random.Generator
    ) -> Wear:
        """
        Draw the clutter of an arm.

        Parameters
        ----------
        strength : ndarray, shape (n,)
            What the torque of each joint goes by [N m].
        speed : ndarray, shape (n,)
            What its speed goes by [rad/s].
        inertia : ndarray, shape (n,)
            What the rotor's inertia goes by [kg m^2].
        rng : Generator
            Source of randomness.

        """
        n = len(strength)

        def some(low: float, high: float) -> FloatArray:
            return rng.uniform(low, high, n)

        coulomb = strength * some(0.06, 0.25)
        return cls(
            viscous=strength / speed * some(0.05, 0.25),
            coulomb=coulomb,
            stribeck=coulomb * some(0.05, 0.25),
            stribeck_speed=speed * some(0.03, 0.1),
            load_share=some(0.01, 0.04),
            presliding=some(1e-4, 6e-4),
            ripple=strength * some(0.003, 0.015),
            order=np.round(some(6.0, 40.0)),
            phase=some(0.0, 2.0 * np.pi),
            rotor=inertia * some(0.05, 0.25),
            spring=strength * some(0.002, 0.02),
            rest=some(-0.5, 0.5),
            gain=some(-0.02, 0.02),
            offset=strength * some(-0.02, 0.02),
            lag=float(rng.uniform(0.002, 0.005)),
        )

    @classmethod
    def none(cls, n: int) -> Wear:
        """Return an arm as from the drawing, without clutter and friction."""
        zero = np.zeros(n)
        return cls(**{name: zero for name in cls.__dataclass_fields__ if name != 'lag'}, lag=0.0)

    def of_a_run(self, rng: np.random.Generator) -> Wear:
        """Return it as it is in one recording: friction is never twice the same."""
        n = len(self.coulomb)
        return replace(
            self,
            viscous=self.viscous * (1.0 + FRICTION_SPREAD * rng.normal(size=n)),
            coulomb=self.coulomb * (1.0 + FRICTION_SPREAD * rng.normal(size=n)),
        )


def bristle(q: FloatArray, distance: FloatArray) -> FloatArray:
    """
    Return the direction of dry friction in [-1, 1], with memory, shape (N, n).

    The Dahl bristle dz/dq = (sign(dq) - z) / distance, integrated exactly between reversals:
    sign(dq) in motion, and what the last motion left at rest.

    """
    state = np.zeros_like(q)
    for j in range(q.shape[1]):
        if distance[j] <= 0.0:
            continue
        step = np.diff(q[:, j])
        sign = np.sign(step)
        moving = np.flatnonzero(sign)
        if len(moving) == 0:
            continue
        last = np.maximum.accumulate(np.where(sign != 0.0, np.arange(len(sign)), -1))
        sign = np.where(last >= 0, sign[np.maximum(last, 0)], 0.0)
        begins = np.flatnonzero(np.diff(sign, prepend=sign[0] + 1.0))
        z = 0.0
        for begin, end in zip(begins, [*begins[1:], len(sign)], strict=True):
            way = np.cumsum(np.abs(step[begin:end])) / distance[j]
            z_run = sign[begin] + (z - sign[begin]) * np.exp(-way)
            if sign[begin] == 0.0:
                z_run = np.full(end - begin, z)
            state[begin + 1 : end + 1, j] = z_run
            z = float(z_run[-1])
    return state
