# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""People and ropes at the arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from tests.hidden.arrays import FloatArray, force_parameters, holding_parameters, Parameter
from tests.hidden.lived.causes.base import JointCause, Scene
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import Path


@dataclass(frozen=True)
class _OnLink(JointCause):
    """Something at the centre of mass of a link of the outer half; the value is [N/m] or [N]."""

    #: Ordinary value over the largest strength of a joint.
    ordinary = 1.0
    attachment: tuple[float, float, float]

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        n = len(scene.strength)
        j = int(rng.integers(min(n // 2 + 1, n - 1), n))
        value = cls.ordinary * scene.strength.max()
        return cls(scene.joints[j], j, value, *cls.drawn(scene, j, rng))


@dataclass(frozen=True)
class Holding(_OnLink):
    """
    A person who holds a link: a spring and a damper to a fixed place.

    The value is the stiffness [N/m]; forces of the catalogue are those at the middle posture.

    """

    name = 'human_interaction'
    ordinary = 0.5
    anchor: tuple[float, float, float]
    middle: tuple[float, float, float]
    damping_time: float = 0.03

    @classmethod
    def drawn(cls, scene: Scene, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return _grip(scene, j, rng)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        way = np.array(self.anchor) - self.middle
        return holding_parameters(self.joint, self.value, self.damping_time, way)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        position, jacobian = chain.point(self.index, np.array(self.attachment), path.q)
        velocity = np.einsum('jxn,nj->xn', jacobian, path.dq)
        way = position - np.array(self.anchor)[:, np.newaxis] + self.damping_time * velocity
        return np.einsum('jxn,xn->nj', jacobian, self.value * way)


@dataclass(frozen=True)
class Pulling(_OnLink):
    """
    A person, or a balancer's rope, that pulls at a link with a constant force.

    The value is the force [N].

    """

    name = 'human_interaction'
    ordinary = 0.3
    direction: tuple[float, float, float]

    @classmethod
    def drawn(cls, scene: Scene, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        point, _, _ = _grip(scene, j, rng)
        along = rng.normal(size=3) * [1.0, 1.0, 0.3]  # not the weight of something
        along /= np.linalg.norm(along)
        return point, tuple(along.tolist())

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return force_parameters(self.joint, self.value * np.array(self.direction))

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        _, jacobian = chain.point(self.index, np.array(self.attachment), path.q)
        return -np.einsum('jxn,x->nj', jacobian, self.value * np.array(self.direction))


@dataclass(frozen=True)
class Knocks(_OnLink):
    """A person who pushes a link now and then, this way and that: in no catalogue."""

    name = 'pushes'
    stated = (('force', 'value', 'N'),)
    in_catalogue = False
    pushes: tuple[tuple[float, float, float, float, float], ...]

    @classmethod
    def drawn(cls, scene: Scene, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        point, _, _ = _grip(scene, j, rng)
        times = np.sort(rng.uniform(0.8, scene.end - 0.8, 9))
        pushes = [
            (float(time), float(rng.uniform(0.15, 0.7)), *rng.normal(size=3).tolist())
            for time in times
        ]
        return point, tuple(pushes)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        force = np.zeros((3, len(path.t)))
        for begin, length, *along in self.pushes:
            x = np.clip((path.t - begin) / length, 0.0, 1.0)
            force += np.array(along)[:, np.newaxis] * np.sin(np.pi * x)
        _, jacobian = chain.point(self.index, np.array(self.attachment), path.q)
        return -np.einsum('jxn,xn->nj', jacobian, self.value * force)


def _grip(
    scene: Scene, j: int, rng: np.random.Generator
) -> tuple[tuple[float, float, float], ...]:
    """Return a link's centre of mass, an anchor near where it moves, and its middle place."""
    body = scene.chain.bodies[j]
    point = body[1:4] / body[0]
    postures = rng.uniform(scene.low, scene.high, (40, len(scene.low)))
    places, _ = scene.chain.point(j, point, postures)
    anchor = places.mean(axis=1) + 0.1 * rng.normal(size=3)
    middle, _ = scene.chain.point(j, point, scene.middle[np.newaxis])
    return tuple(point.tolist()), tuple(anchor.tolist()), tuple(middle[:, 0].tolist())
