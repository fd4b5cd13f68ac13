# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Other bodies and another mounting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tests.hidden.arrays import Ball, Parameter, Tilted
from tests.hidden.lived.causes.base import Cause, JointCause, Scene
from tests.hidden.lived.chain import Chain


class Body(Ball, JointCause):
    """A ball fixed to a link."""

    def bodies(self, chain: Chain) -> Chain:
        return chain.with_body(self.index, self.body)


class Payload(Body):
    """Something in the hand."""

    name, label = 'payload', 'payload_{}'
    factors = (0.01, 20.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = len(scene.strength) - 1
        mass = rng.uniform(0.02, 0.12) * float(scene.chain.bodies[1:, 0].sum())
        centre = rng.normal(size=3)
        centre *= rng.uniform(0.03, 0.15) / np.linalg.norm(centre)
        return cls(scene.joints[j], j, mass, tuple(centre.tolist()), rng.uniform(0.02, 0.06))


class Link(Body):
    """Something mounted on a link in the middle of the arm."""

    name, label = 'link_inertia', '{}_difference'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        n = len(scene.strength)
        j = int(rng.integers(1, max(n - 1, 2)))
        centre = rng.normal(size=3)
        centre *= rng.uniform(0.08, 0.2) / np.linalg.norm(centre)
        mass = 0.08 * float(scene.chain.bodies[1:, 0].sum())
        return cls(scene.joints[j], j, mass, tuple(centre.tolist()), rng.uniform(0.03, 0.06))


class Tilt(Tilted, Cause):
    """The base turned about a horizontal axis, so that gravity as it sees it turns back."""

    factors = (0.02, 5.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        turn = np.radians(np.exp(rng.uniform(0.0, np.log(10.0))))
        return cls((turn * np.cos(angle), turn * np.sin(angle)))

    def bodies(self, chain: Chain) -> Chain:
        return chain.with_gravity(self.seen(chain.gravity))


class Wall(Tilt):
    """Another mounting: on a wall, on a slope, under a ceiling."""

    factors = (1.0, 1.0)

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        angle = rng.integers(0, 8) * np.pi / 4.0
        turn = np.radians(float(rng.choice([30.0, 45.0, 60.0, 90.0, 90.0, 90.0, 135.0, 179.0])))
        return cls((turn * np.cos(angle), turn * np.sin(angle)))


@dataclass(frozen=True)
class Mounting(Cause):
    """Gravity of any direction and magnitude."""

    vector: tuple[float, float, float]
    name = 'gravity'

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        return cls(tuple(Tilt.draw(scene, rng).bodies(scene.chain).gravity.tolist()))

    def scaled(self, factor: float) -> Self:
        return self

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(f'gravity_{axis}', '', value, 'm/s^2')
            for axis, value in zip('xyz', self.vector, strict=True)
        )

    def bodies(self, chain: Chain) -> Chain:
        return chain.with_gravity(np.array(self.vector))
