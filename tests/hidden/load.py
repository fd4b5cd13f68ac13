# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden differences of the rigid arm: its bodies, its payload, its gravity, its rotors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from armid_ros.robots import Robot
import mujoco
import numpy as np

from tests.hidden.arrays import body_vector, named_body, Parameter, Tilted
from tests.hidden.base import HiddenEffect, InJoint, Live, OneJoint, Setting


@dataclass(frozen=True)
class _Ball(InJoint):
    """A body welded to a link, of equal inertia about all axes."""

    rigid = True
    sized_by = 'mass'
    #: What the names of the ten parameters are made of.
    label: ClassVar[str]
    #: Inertia over mass times squared radius, and the radius [m].
    shape: ClassVar[tuple[float, float]]
    mass: float
    centre: tuple[float, float, float]

    @property
    def inertia(self) -> float:
        """Inertia about any axis through the centre of mass [kg m^2]."""
        share, radius = self.shape
        return share * self.mass * radius**2

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        values = body_vector(self.mass, np.array(self.centre), self.inertia * np.eye(3))
        return named_body(self.label, self.joint, values)

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        body = spec.joint(self.joint).parent.add_body(name=self.name, ipos=self.centre)
        body.mass, body.inertia = self.mass, np.full(3, self.inertia)
        body.explicitinertial = True


class Payload(_Ball):
    """A solid ball welded to the last link."""

    name, label, shape = 'payload', 'payload_{}', (0.4, 0.03)

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        mass = 0.003 * float(setting.robot.rigid_parameters[::10].sum())
        return cls(setting.robot.joints[-1], mass, _centre(rng))


class LinkInertia(_Ball):
    """One link heavier, its centre of mass elsewhere, than the description says."""

    name, label, shape = 'link_inertia', '{}_difference', (0.1, 0.05)

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = int(rng.integers(1, setting.robot.n_joints - 1))
        mass = 0.02 * float(setting.robot.rigid_parameters.reshape(-1, 10)[1:, 0].mean())
        return cls(setting.robot.joints[j], mass, _centre(rng))


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


def _centre(rng: np.random.Generator) -> tuple[float, float, float]:
    """Draw a place 0.1 m from the frame of a joint."""
    direction = rng.normal(size=3)
    return tuple((0.1 * direction / np.linalg.norm(direction)).tolist())


LOAD = (Payload, LinkInertia, GravityMagnitude, BaseTilt, RotorInertia)
