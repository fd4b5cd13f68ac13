# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden differences of the rigid arm and its drives: bodies, gravity, rotors, ripple, limits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from armid_ros.robots import Robot
import mujoco
import numpy as np

from tests.hidden.arrays import Ball, Parameter, Signals, Tilted
from tests.hidden.base import HiddenEffect, Live, OneJoint, Setting


class _Welded(Ball, OneJoint):
    """A body welded to a link."""

    rigid = True

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        body = spec.joint(self.joint).parent.add_body(name=self.name, ipos=self.centre)
        body.mass, body.inertia = self.value, np.full(3, self.inertia)
        body.explicitinertial = True


@dataclass(frozen=True)
class Payload(_Welded):
    """A solid ball welded to the last link."""

    name, label = 'payload', 'payload_{}'
    radius: float = 0.03

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        mass = 0.003 * float(setting.robot.rigid_parameters[::10].sum())
        return cls(setting.joints[-1], len(setting.joints) - 1, mass, _centre(rng))


@dataclass(frozen=True)
class LinkInertia(_Welded):
    """One link heavier, its centre of mass elsewhere, than the description says."""

    name, label, share = 'link_inertia', '{}_difference', 0.1
    radius: float = 0.05

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = int(rng.integers(1, setting.robot.n_joints - 1))
        mass = 0.02 * float(setting.robot.rigid_parameters.reshape(-1, 10)[1:, 0].mean())
        return cls(setting.joints[j], j, mass, _centre(rng))


@dataclass(frozen=True)
class GravityMagnitude(HiddenEffect):
    """Gravity stronger or weaker than the model has it."""

    name = 'gravity_magnitude'
    stated = (('gravity_difference', 'value', 'm/s^2'),)
    rigid = True
    value: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        return cls(float(rng.choice([-0.1, 0.1])))

    def prepare(self, live: Live) -> None:
        gravity = live.model.opt.gravity
        gravity *= 1.0 + self.value / np.linalg.norm(gravity)


class BaseTilt(Tilted, HiddenEffect):
    """The base turned about a horizontal axis: gravity as it sees it turns the other way."""

    rigid = True

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        return cls((0.01 * np.cos(angle), 0.01 * np.sin(angle)))

    def prepare(self, live: Live) -> None:
        live.model.opt.gravity[:] = self.seen(live.model.opt.gravity)


@dataclass(frozen=True)
class RotorInertia(OneJoint):
    """Inertia of the rotor: native armature."""

    name = 'rotor_inertia'
    ordinary, first_joint = 1e-3, 1
    stated = (('rotor_inertia', 'value', 'kg m^2'),)
    replaces = ('rotor_inertia',)

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        spec.joint(self.joint).armature += self.value


@dataclass(frozen=True)
class TorqueRipple(OneJoint):
    """Cogging: a torque that repeats several times per turn."""

    name = 'torque_ripple'
    ordinary = 0.02
    acts = True
    order: float
    phase: float

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        # Half a dozen cycles or more in the range of motion, and slow enough to be sampled.
        least = 12.0 * np.pi / (setting.high[j] - setting.low[j])
        order = float(np.ceil(least * rng.uniform(1.0, 2.0)))
        return order, float(rng.uniform(0.0, 2.0 * np.pi))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('ripple_sine', self.joint, self.value * np.cos(self.phase), 'N m'),
            Parameter('ripple_cosine', self.joint, self.value * np.sin(self.phase), 'N m'),
            Parameter('ripple_order', self.joint, self.order, '1/rev'),
        )

    def act(self, live: Live) -> None:
        angle = self.order * live.q[self.index] + self.phase
        live.applied[self.index] -= self.value * np.sin(angle)


@dataclass(frozen=True)
class ActuatorSaturation(OneJoint):
    """A drive that gives no more than a limit, and reports what it was asked for."""

    name = 'actuator_saturation'
    ordinary, by_torque, loaded = 0.1, 0, 0.05
    peak: float

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return (float(setting.peak[j]),)

    @property
    def limit(self) -> float:
        """Largest torque [N m]."""
        return self.peak / (1.0 + self.value)

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


def _centre(rng: np.random.Generator) -> tuple[float, float, float]:
    """Draw a place 0.1 m from the frame of a joint."""
    direction = rng.normal(size=3)
    return tuple((0.1 * direction / np.linalg.norm(direction)).tolist())
