# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Other friction, another rotor, a spring across a joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from tests.hidden.arrays import FloatArray, Parameter, spring_parameters
from tests.hidden.lived.causes.base import JointCause, Scene
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import Path


class Coulomb(JointCause):
    """A gear that has become stiff."""

    name, worn = 'coulomb_friction', 'coulomb'
    ordinary = 0.15
    stated = (('coulomb_torque', 'value', 'N m'),)


class Viscous(JointCause):
    """A gear with other grease."""

    name, worn = 'viscous_friction', 'viscous'
    ordinary, by_speed = 0.15, 1
    stated = (('viscous_coefficient', 'value', 'N m s/rad'),)


@dataclass(frozen=True)
class Stribeck(JointCause):
    """A gear that sticks at low speed."""

    name = 'stribeck_friction'
    ordinary = 0.2
    stated = (
        ('stribeck_torque', 'value', 'N m'),
        ('stribeck_velocity', 'velocity', 'rad/s'),
    )
    velocity: float = 0.1

    @classmethod
    def drawn(cls, scene: Scene, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return (float(scene.speed[j] * rng.uniform(0.15, 0.5)),)

    def dry(self, dq: FloatArray) -> FloatArray:
        return self._column(dq, self.value * np.exp(-((dq[:, self.index] / self.velocity) ** 2)))


class LoadFriction(JointCause):
    """A gear in which dry friction grows with the load."""

    name, worn = 'load_dependent_friction', 'load_share'
    ordinary, by_torque, loaded = 0.1, 0, 0.1
    stated = (('load_coefficient', 'value', ''),)
    factors = (0.02, 6.0)


class Rotor(JointCause):
    """A drive exchanged for one with a heavier rotor."""

    name, worn = 'rotor_inertia', 'rotor'
    ordinary, by_speed, first_joint = 0.05, 1, 1
    stated = (('rotor_inertia', 'value', 'kg m^2'),)


@dataclass(frozen=True)
class Spring(JointCause):
    """A hose or a cable across a joint."""

    name = 'joint_spring'
    rest: float = 0.0

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.pick(rng)
        low, high = scene.low[j], scene.high[j]
        value = 0.3 * scene.strength[j] / (high - low)
        return cls(scene.joints[j], j, value, float(rng.uniform(low, high)))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return spring_parameters(self.joint, self.value, self.rest)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        return self._column(path.q, self.value * (path.q[:, self.index] - self.rest))


class CubicDrag(JointCause):
    """Drag that grows with the cube of the speed: in no catalogue."""

    name = 'cubic_drag'
    ordinary, by_speed = 0.1, 3
    stated = (('cubic_coefficient', 'value', 'N m s^3/rad^3'),)
    in_catalogue = False

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        return self._column(path.q, self.value * path.dq[:, self.index] ** 3)


@dataclass(frozen=True)
class Bumps(JointCause):
    """Places in a gear that push one way where they are entered, the other way where left."""

    name = 'bumps'
    ordinary = 0.3
    stated = (('torque', 'value', 'N m'),)
    in_catalogue = False
    places: tuple[float, ...] = ()
    width: float = 0.1

    @classmethod
    def drawn(cls, scene: Scene, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        low, high = scene.low[j], scene.high[j]
        places = low + (high - low) * rng.uniform(0.15, 0.85, 3)
        return tuple(places.tolist()), 0.05 * float(high - low)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        x = (path.q[:, self.index, np.newaxis] - np.array(self.places)) / self.width
        return self._column(path.q, -self.value * (x * np.exp(-(x**2))).sum(axis=1))
