# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Arm whose friction follows its temperature by another law than that of the package.

The rigid body has dynamics of its own. Friction is viscous, Coulomb and Stribeck friction, each
of which decreases exponentially with temperature; the package has a law of first order without
Stribeck friction. Sensors of temperature have noise and steps.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.motion import Temperatures
from armid_ros.recording import Recording
from armid_ros.robots import robot_from_urdf
import numpy as np

from tests.hidden.arrays import FloatArray
from tests.hidden.lived.chain import Chain
from tests.hidden.trajectories import Orbit

JOINTS = ('turn', 'shoulder', 'elbow')
_LINK = (
    '<link name="{0}_link"><inertial><origin xyz="0.01 0 {1}"/><mass value="{2}"/><inertia '
    'ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.004"/></inertial></link>'
    '<joint name="{0}" type="revolute"><parent link="{3}"/><child link="{0}_link"/>'
    '<origin xyz="0 0 {4}"/><axis xyz="{5}"/>'
    '<limit lower="-3" upper="3" effort="80" velocity="6"/></joint>'
)
URDF = (
    '<robot name="warm_arm"><link name="base"/>'
    + _LINK.format('turn', 0.1, 4.0, 'base', 0.2, '0 0 1')
    + _LINK.format('shoulder', 0.15, 3.0, 'turn_link', 0.2, '0 1 0')
    + _LINK.format('elbow', 0.12, 1.5, 'shoulder_link', 0.35, '0 1 0')
    + '</robot>'
)
ROBOT = robot_from_urdf(URDF, gravity='earth')
_CHAIN = Chain.of(ROBOT)
#: Samples per second, duration of a recording [s], and noise of torques [N m].
_RATE, _DURATION, _NOISE = 200.0, 14.0, 0.04
#: Temperature of each joint over that of the arm, and its rise in a recording [K].
_OWN, _RISE = np.array([0.0, 3.0, 6.0]), np.array([2.0, 2.6, 1.4])


@dataclass(frozen=True)
class WarmArm:
    """
    An arm with friction that follows its temperature.

    Attributes
    ----------
    viscous, coulomb : ndarray, shape (3,)
        Coefficients at 25 degC [N m s/rad, N m].
    viscous_rate, coulomb_rate : float
        Relative decrease per kelvin [1/K].
    stribeck : float
        Breakaway torque beyond the Coulomb torque, over the Coulomb torque.

    """

    viscous: FloatArray
    coulomb: FloatArray
    viscous_rate: float = 0.02
    coulomb_rate: float = 0.006
    stribeck: float = 0.15

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> WarmArm:
        """Draw an arm."""
        return cls(
            np.array([0.9, 0.8, 0.4]) * rng.uniform(0.6, 1.5, 3),
            np.array([1.2, 1.0, 0.5]) * rng.uniform(0.6, 1.5, 3),
            rng.uniform(0.01, 0.03),
            rng.uniform(0.0, 0.012),
            rng.uniform(0.0, 0.3),
        )

    def worn(self, joint: str, factor: float) -> WarmArm:
        """Return the arm with more friction in a joint, at every temperature."""
        more = np.where(np.array(JOINTS) == joint, factor, 1.0)
        rates = self.viscous_rate, self.coulomb_rate
        return WarmArm(self.viscous * more, self.coulomb * more, *rates, self.stribeck)

    def record(
        self, rng: np.random.Generator, temperatures: Sequence[float], name: str
    ) -> list[Recording]:
        """Record a motion at each temperature of the arm [degC]."""
        return [self._run(rng, T, f'{name} {k}') for k, T in enumerate(temperatures)]

    def _run(self, rng: np.random.Generator, temperature: float, name: str) -> Recording:
        t = np.arange(round(_DURATION * _RATE)) / _RATE
        period, speed = _DURATION / 2 - 0.5, rng.uniform(1.0, 2.5)
        size, phase = np.empty((2, 3, 4))
        for j in range(3):
            size[j], phase[j] = rng.uniform(0.5, 1.0, 4), rng.uniform(0, 2 * np.pi, 4)
        size *= speed / np.sum(size * 2 * np.pi / period * np.arange(1, 5) / 3, axis=1)[:, None]
        orbit = Orbit(period, np.zeros(3), size * np.sin(phase), size * np.cos(phase))
        q, dq, ddq = orbit.at(t)
        true = temperature + _OWN + _RISE * (1.0 - np.exp(-t / 20.0))[:, np.newaxis]
        tau = _CHAIN.torque(q, dq, ddq) + self._friction(dq, true - 25.0)
        slow = slice(None, None, 100)
        read = true[slow] + 0.2 * rng.normal(size=true[slow].shape)
        return Recording(
            joints=JOINTS,
            t=t,
            q=q + 2e-5 * rng.normal(size=q.shape),
            tau=tau + _NOISE * rng.normal(size=q.shape),
            source=name,
            temperature=Temperatures(t[slow], np.round(2.0 * read) / 2.0),
        )

    def _friction(self, dq: FloatArray, warmer: FloatArray) -> FloatArray:
        dry = self.coulomb * np.exp(-self.coulomb_rate * warmer)
        dry = dry * (1.0 + self.stribeck * np.exp(-np.abs(dq) / 0.08))
        viscous = self.viscous * np.exp(-self.viscous_rate * warmer)
        return viscous * dq + dry * np.tanh(dq / 0.002)
