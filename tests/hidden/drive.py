# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden faults of drives: torque that ripples, and torque that ends."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from armid_ros.robots import Robot
import numpy as np

from tests.hidden.arrays import Parameter, Signals
from tests.hidden.base import InJoint, Live, pick, pick_loaded, Setting


@dataclass(frozen=True)
class TorqueRipple(InJoint):
    """Cogging: a torque that repeats several times per turn."""

    name = 'torque_ripple'
    sized_by = 'amplitude'
    acts = True
    index: int
    amplitude: float
    phase: float
    order: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = pick(setting, rng)
        # Half a dozen cycles or more in the range of motion, and slow enough to be sampled.
        least = 12.0 * np.pi / (setting.high[j] - setting.low[j])
        order = float(np.ceil(least * rng.uniform(1.0, 2.0)))
        return cls(
            setting.robot.joints[j],
            j,
            0.02 * setting.drive[j],
            float(rng.uniform(0.0, 2.0 * np.pi)),
            order,
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('ripple_sine', self.joint, self.amplitude * np.cos(self.phase), 'N m'),
            Parameter('ripple_cosine', self.joint, self.amplitude * np.sin(self.phase), 'N m'),
            Parameter('ripple_order', self.joint, self.order, '1/rev'),
        )

    def act(self, live: Live) -> None:
        angle = self.order * live.data.qpos[live.dofs[self.index]] + self.phase
        live.applied[self.index] -= self.amplitude * np.sin(angle)


@dataclass(frozen=True)
class ActuatorSaturation(InJoint):
    """A drive that gives no more than a limit, and reports what it was asked for."""

    name = 'actuator_saturation'
    sized_by = 'excess'
    index: int
    peak: float
    excess: float = 0.1

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = pick_loaded(setting, rng)
        return cls(setting.robot.joints[j], j, float(setting.peak[j]))

    @property
    def limit(self) -> float:
        """Largest torque [N m]."""
        return self.peak / (1.0 + self.excess)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('lost_share', self.joint, 1.0, ''),
            Parameter('saturation_torque', self.joint, self.limit, 'N m'),
        )

    def prepare(self, live: Live) -> None:
        live.model.actuator_forcelimited[self.index] = 1
        live.model.actuator_forcerange[self.index] = [-self.limit, self.limit]

    def distort(self, signals: Signals, robot: Robot) -> Signals:
        tau = signals.tau.copy()
        tau[:, self.index] = signals.command[:, self.index]
        return replace(signals, tau=tau)


DRIVE = (TorqueRipple, ActuatorSaturation)
