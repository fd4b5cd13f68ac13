# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden differences of the rigid arm: its bodies, its payload, its gravity, its rotors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from armid_ros.robots import Robot
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.hidden.arrays import FloatArray, Parameter
from tests.hidden.base import HiddenEffect, InJoint, Live, OneJoint, pick, Setting

_NAMES = ('m', 'mx', 'my', 'mz', 'Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz')
_UNITS = ('kg', 'kg m', 'kg m', 'kg m') + ('kg m^2',) * 6


@dataclass(frozen=True)
class Payload(InJoint):
    """A solid ball welded to the last link."""

    name = 'payload'
    sized_by = 'mass'
    rigid = True
    mass: float
    centre: tuple[float, float, float]
    radius: float = 0.03

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        joint = setting.robot.joints[-1]
        mass = 0.003 * float(setting.robot.rigid_parameters[::10].sum())
        direction = rng.normal(size=3)
        centre = 0.1 * direction / np.linalg.norm(direction)
        return cls(joint, mass, tuple(centre.tolist()))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        inertia = 0.4 * self.mass * self.radius**2 * np.eye(3)
        values = body_parameters(self.mass, np.array(self.centre), inertia)
        return tuple(
            Parameter(f'payload_{name}', self.joint, float(value), unit)
            for name, value, unit in zip(_NAMES, values, _UNITS, strict=True)
        )

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        body = spec.joint(self.joint).parent.add_body(name='payload', ipos=self.centre)
        body.mass = self.mass
        body.inertia = np.full(3, 0.4 * self.mass * self.radius**2)
        body.explicitinertial = True


@dataclass(frozen=True)
class LinkInertia(InJoint):
    """One link heavier, its centre of mass elsewhere, than the description says."""

    name = 'link_inertia'
    sized_by = 'mass'
    rigid = True
    index: int
    mass: float
    centre: tuple[float, float, float]

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        n = setting.robot.n_joints
        j = int(rng.integers(1, n - 1))
        mass = 0.02 * float(setting.robot.rigid_parameters.reshape(-1, 10)[1:, 0].mean())
        direction = rng.normal(size=3)
        centre = 0.1 * direction / np.linalg.norm(direction)
        return cls(setting.robot.joints[j], j, mass, tuple(centre.tolist()))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        inertia = 0.1 * self.mass * 0.05**2 * np.eye(3)
        values = body_parameters(self.mass, np.array(self.centre), inertia)
        return tuple(
            Parameter(f'{name}_difference', self.joint, float(value), unit)
            for name, value, unit in zip(_NAMES, values, _UNITS, strict=True)
        )

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        body = spec.joint(self.joint).parent.add_body(name='difference', ipos=self.centre)
        body.mass = self.mass
        body.inertia = np.full(3, 0.1 * self.mass * 0.05**2)
        body.explicitinertial = True


@dataclass(frozen=True)
class GravityMagnitude(HiddenEffect):
    """Gravity stronger or weaker than the model has it."""

    name = 'gravity_magnitude'
    sized_by = 'difference'
    stated = (('gravity_difference', 'difference', 'm/s^2'),)
    rigid = True
    difference: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        return cls(float(rng.choice([-0.1, 0.1])))

    def prepare(self, live: Live) -> None:
        gravity = live.model.opt.gravity
        gravity *= 1.0 + self.difference / np.linalg.norm(gravity)


@dataclass(frozen=True)
class BaseTilt(HiddenEffect):
    """The base turned about a horizontal axis: gravity as it sees it turns the other way."""

    name = 'base_tilt'
    rigid = True
    tilt: tuple[float, float]

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        return cls((0.01 * np.cos(angle), 0.01 * np.sin(angle)))

    def scaled(self, factor: float) -> Self:
        return replace(self, tilt=(self.tilt[0] * factor, self.tilt[1] * factor))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('tilt_x', '', self.tilt[0], 'rad'),
            Parameter('tilt_y', '', self.tilt[1], 'rad'),
        )

    def prepare(self, live: Live) -> None:
        turn = Rotation.from_rotvec([*self.tilt, 0.0])
        live.model.opt.gravity[:] = turn.inv().apply(live.model.opt.gravity)


@dataclass(frozen=True)
class RotorInertia(OneJoint):
    """Inertia of the rotor: native armature."""

    name = 'rotor_inertia'
    stated = (('rotor_inertia', 'value', 'kg m^2'),)
    replaces = ('rotor_inertia',)

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = pick(setting, rng, first=1)
        return cls(setting.robot.joints[j], j, 1e-3 * float(setting.drive[j]))

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        spec.joint(self.joint).armature += self.value


def body_parameters(mass: float, centre: FloatArray, inertia: FloatArray) -> FloatArray:
    """Return mass, first moments and inertia about the frame's origin, shape (10,)."""
    about = inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.concatenate([[mass], mass * centre, about[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])


LOAD = (Payload, LinkInertia, GravityMagnitude, BaseTilt, RotorInertia)
