# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What no catalogue has: effects that should be called unknown, and shown where they live."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.hidden.base import Live, OneJoint, Setting


@dataclass(frozen=True)
class _Outside(OneJoint):
    acts = True
    stated = (('torque', 'value', 'N m'),)
    in_catalogue = False

    def act(self, live: Live) -> None:
        live.applied[self.index] += self.value * self.shape(
            live.t, live.q[self.index], live.dq[self.index]
        )

    @abstractmethod
    def shape(self, t: float, q: float, dq: float) -> float:
        """Return the torque per value."""


@dataclass(frozen=True)
class DeadPatch(_Outside):
    """A place in the gear that pushes one way where it is entered, the other way where left."""

    name = 'dead_patch'
    ordinary = 0.05
    centre: float = 0.0
    width: float = 0.1

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        low, high = setting.low[j], setting.high[j]
        centre = float(rng.uniform(0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high))
        return centre, 0.06 * (high - low)

    def shape(self, t: float, q: float, dq: float) -> float:
        x = (q - self.centre) / self.width
        return float(x * np.exp(-(x**2)))


@dataclass(frozen=True)
class Chirp(_Outside):
    """A machine nearby that speeds up while the arm moves."""

    name = 'chirp'
    ordinary = 0.02
    repeats = False
    low: float = 0.5
    rate: float = 0.2

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return tuple(rng.uniform([0.3, 0.1], [1, 0.3]))

    def shape(self, t: float, q: float, dq: float) -> float:
        return float(np.sin(2.0 * np.pi * (self.low + 0.5 * self.rate * t) * t))


@dataclass(frozen=True)
class RandomContact(_Outside):
    """Knocks at times that have nothing to do with the motion."""

    name = 'random_contact'
    ordinary = 0.05
    repeats = False
    times: tuple[float, ...] = ()
    lengths: tuple[float, ...] = ()

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        times = np.sort(rng.uniform(1.0, 20.0, 8))
        lengths = rng.uniform(0.1, 0.5, 8) * rng.choice([-1.0, 1.0], 8)
        return tuple(times.tolist()), tuple(lengths.tolist())

    def shape(self, t: float, q: float, dq: float) -> float:
        push = 0.0
        for begin, length in zip(self.times, self.lengths, strict=True):
            x = (t - begin) / abs(length)
            if 0.0 < x < 1.0:
                push += np.sign(length) * np.sin(np.pi * x)
        return float(push)


@dataclass(frozen=True)
class Muscle(_Outside):
    """A person who works along: stronger in the middle of the range, tired as time goes on."""

    name = 'muscle'
    ordinary = 0.05
    repeats = False
    centre: float = 0.0
    width: float = 1.0
    speed: float = 1.0
    rhythm: tuple[float, ...] = ()

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        low, high = setting.low[j], setting.high[j]
        rhythm = tuple(rng.uniform(0.3, 1.1, 3).tolist())
        return (low + high) / 2.0, 0.3 * (high - low), float(setting.speed[j]), rhythm

    def shape(self, t: float, q: float, dq: float) -> float:
        a, b, c = self.rhythm
        activation = max(np.sin(7.0 * a * t) + np.sin(11.0 * b * t + 1.0) * np.sin(3.0 * c * t), 0)
        length = np.exp(-(((q - self.centre) / self.width) ** 2))
        shortening = 1.0 / (1.0 + np.exp(4.0 * dq / self.speed))
        return float(activation * length * shortening)
