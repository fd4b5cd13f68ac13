# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a cause is: the places where it may act, all of them empty by default."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from tests.hidden.arrays import FloatArray, OfJoint, Sized
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import Path
from tests.hidden.lived.wear import Wear


@dataclass(frozen=True)
class Scene:
    """
    What a cause is drawn for.

    Attributes
    ----------
    chain : Chain
        True bodies.
    strength, speed : ndarray, shape (n,)
        What torque and speed of each joint go by [N m, rad/s].
    low, high : ndarray, shape (n,)
        Smallest and largest position of the motions of day 2 [rad].
    middle : ndarray, shape (n,)
        Middle of the position limits; zero where there are none [rad].
    end : float
        How long recordings are [s].

    """

    chain: Chain
    strength: FloatArray
    speed: FloatArray
    low: FloatArray
    high: FloatArray
    middle: FloatArray
    end: float

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self.chain.joints

    def pick(self, rng: np.random.Generator, *, loaded: float = 0.0, first: int = 0) -> int:
        """Pick a joint, none before the first, that has a share of the largest torque."""
        allowed = np.arange(len(self.strength)) >= min(first, len(self.strength) - 1)
        if loaded:
            allowed &= self.strength > loaded * self.strength.max()
        chosen = np.flatnonzero(allowed)
        return int(rng.choice(chosen if len(chosen) else [np.argmax(self.strength)]))


class Cause(Sized, ABC):
    """One cause with its true parameters; every hook leaves things as they are by default."""

    #: Name in the catalogue, or of something the catalogue does not have.
    name: ClassVar[str]
    #: Whether the catalogue has it.
    in_catalogue: ClassVar[bool] = True
    #: Largest and smallest factor on the drawn size that make sense.
    factors: ClassVar[tuple[float, float]] = (0.02, 8.0)

    joints: tuple[str, ...] = ()

    @classmethod
    @abstractmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        """Draw one of ordinary size."""

    def bodies(self, chain: Chain) -> Chain:
        """Change the rigid arm or its gravity."""
        return chain

    def wear(self, wear: Wear) -> Wear:
        """Change friction, springs or rotors."""
        return wear

    def truth(self, path: Path) -> Path:
        """Return where the joints are when the encoders say what the path says."""
        return path

    def dry(self, dq: FloatArray) -> FloatArray | float:
        """Return the dry friction that it adds at a speed, shape (N, n) [N m]."""
        return 0.0

    def torque(self, path: Path, chain: Chain) -> FloatArray | float:
        """Return torque that the drives have to give besides, shape (N, n) [N m]."""
        return 0.0

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        """Return the effort that is reported, shape (N, n), for what the drives would report."""
        return tau


class JointCause(OfJoint, Cause):
    """A cause in one joint with one value that its size goes by."""

    #: Attribute of the wear that grows by the value; empty for none.
    worn: ClassVar[str] = ''

    def _column(self, like: FloatArray, values: FloatArray) -> FloatArray:
        torque = np.zeros_like(like)
        torque[:, self.index] = values
        return torque

    def wear(self, wear: Wear) -> Wear:
        if not self.worn:
            return wear
        values = getattr(wear, self.worn).copy()
        values[self.index] += self.value
        return replace(wear, **{self.worn: values})
