# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Other readings: of torques, of their time, of positions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tests.hidden.arrays import FloatArray, sampled
from tests.hidden.lived.causes.base import Cause, JointCause, Scene
from tests.hidden.lived.motions import Path


class Gain(JointCause):
    """A torque reading of another scale."""

    name = 'torque_gain'
    ordinary, by_torque, signed, loaded = 0.08, 0, True, 0.1
    stated = (('gain_error', 'value', ''),)
    factors = (0.05, 6.0)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return tau + self._column(tau, self.value * tau[:, self.index])


class Offset(JointCause):
    """A torque reading of another zero."""

    name = 'torque_offset'
    ordinary, signed = 0.1, True
    stated = (('torque_offset', 'value', 'N m'),)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return tau + self._column(tau, np.full(len(tau), self.value))


@dataclass(frozen=True)
class Delay(Cause):
    """Torques that are older than the positions they come with."""

    name = 'time_delay'
    stated = (('delay', 'value', 's'),)
    factors = (0.05, 3.0)
    value: float

    @classmethod
    def draw(cls, scene: Scene, rng: np.random.Generator) -> Self:
        return cls(0.01)

    def reading(self, t: FloatArray, tau: FloatArray) -> FloatArray:
        return sampled(t - self.value, t, tau)


class Encoder(JointCause):
    """An encoder that reads too little by a constant."""

    name = 'encoder_offset'
    ordinary, by_torque, signed, loaded, first_joint = 0.03, 0, True, 0.1, 1
    stated = (('encoder_offset', 'value', 'rad'),)
    factors = (0.02, 6.0)

    def truth(self, path: Path) -> Path:
        q = path.q.copy()
        q[:, self.index] += self.value
        return replace(path, q=q)
