# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What no catalogue has, and a map can learn: beside `bumps` and `cubic_drag`, two more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tests.hidden.arrays import FloatArray
from tests.hidden.lived.causes.base import JointCause, Scene
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import Path


@dataclass(frozen=True)
class PositionFriction(JointCause):
    """Dry friction that grows towards one place of the range, as of a gear that is worn there."""

    name = 'position_friction'
    stated = (('torque', 'value', 'N m'),)
    in_catalogue = False
    centre: float = 0.0
    width: float = 0.5

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        low, high = float(scene.low[j]), float(scene.high[j])
        centre = low + (high - low) * float(rng.uniform(0.25, 0.75))
        return cls(scene.chain.joints[j], j, 0.3 * scene.strength[j], centre, 0.15 * (high - low))

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        q, dq = path.q[:, self.index], path.dq[:, self.index]
        there = np.exp(-(((q - self.centre) / self.width) ** 2))
        return self._column(path.q, self.value * there * np.tanh(dq / 2e-3))


@dataclass(frozen=True)
class CableSnag(JointCause):
    """A cable that snags beyond an angle: it pulls back, harder while it is drawn out."""

    name = 'cable_snag'
    stated = (('stiffness', 'value', 'N m/rad'),)
    in_catalogue = False
    place: float = 0.0
    drag: float = 0.3

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        j = scene.joint(rng)
        low, high = float(scene.low[j]), float(scene.high[j])
        place = low + (high - low) * float(rng.uniform(0.5, 0.7))
        return cls(scene.chain.joints[j], j, scene.strength[j] / (high - low), place)

    def torque(self, path: Path, chain: Chain) -> FloatArray:
        q, dq = path.q[:, self.index], path.dq[:, self.index]
        drawn = np.maximum(q - self.place, 0.0)
        return self._column(path.q, self.value * drawn * (1.0 + self.drag * np.tanh(dq / 0.05)))
