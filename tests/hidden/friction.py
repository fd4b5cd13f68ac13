# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden friction: MuJoCo's own damping and dry friction, their levels moved step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from armid_ros.robots import Robot
import mujoco
import numpy as np

from tests.hidden.arrays import Parameter
from tests.hidden.base import InPair, Live, OneJoint, Setting


class ViscousFriction(OneJoint):
    """The arm supplies value * dq: native damping."""

    name = 'viscous_friction'
    ordinary, by_speed = 0.05, 1
    stated = (('viscous_coefficient', 'value', 'N m s/rad'),)
    replaces = ('viscous_friction',)
    limit_of = ('thermal_friction',)

    def prepare(self, live: Live) -> None:
        live.model.dof_damping[live.dofs[self.index]] += self.value


class CoulombFriction(OneJoint):
    """The arm supplies value * sign(dq), and holds at rest: native dry friction."""

    name = 'coulomb_friction'
    ordinary = 0.03
    stated = (('coulomb_torque', 'value', 'N m'),)
    replaces = ('coulomb_friction',)
    limit_of = ('stribeck_friction', 'presliding_hysteresis')

    def prepare(self, live: Live) -> None:
        live.model.dof_frictionloss[live.dofs[self.index]] += self.value


@dataclass(frozen=True)
class StribeckFriction(OneJoint):
    """Dry friction that is higher by value * exp(-(dq / velocity)^2) at low speed."""

    name = 'stribeck_friction'
    ordinary = 0.03
    stated = (
        ('stribeck_torque', 'value', 'N m'),
        ('stribeck_velocity', 'velocity', 'rad/s'),
    )
    needs = ('coulomb_friction',)
    acts = True
    velocity: float = 0.1

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return (setting.speed[j] * rng.uniform(0.04, 0.12),)

    def act(self, live: Live) -> None:
        speed = live.dq[self.index]
        live.friction[self.index] += self.value * np.exp(-((speed / self.velocity) ** 2))


@dataclass(frozen=True)
class AsymmetricFriction(OneJoint):
    """Coulomb and viscous friction that differ between the directions."""

    name = 'asymmetric_friction'
    ordinary, by_speed, signed = 0.03, 1, True
    needs = ('coulomb_friction', 'viscous_friction')
    acts = True
    coulomb_share: float = 0.3

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return (float(setting.speed[j]) * 0.2,)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('coulomb_asymmetry', self.joint, self.value * self.coulomb_share, 'N m'),
            Parameter('viscous_asymmetry', self.joint, self.value, 'N m s/rad'),
        )

    def act(self, live: Live) -> None:
        speed = abs(live.dq[self.index])
        live.applied[self.index] -= self.value * (self.coulomb_share + speed)


class QuadraticFriction(OneJoint):
    """Drag that grows with the square of the speed."""

    name = 'quadratic_friction'
    ordinary, by_speed = 0.05, 2
    stated = (('quadratic_coefficient', 'value', 'N m s^2/rad^2'),)
    acts = True

    def act(self, live: Live) -> None:
        speed = live.dq[self.index]
        live.applied[self.index] -= self.value * speed * abs(speed)


class LoadDependentFriction(OneJoint):
    """Dry friction that is higher by a share of the torque the rigid arm takes."""

    name = 'load_dependent_friction'
    ordinary, by_torque, loaded = 0.08, 0, 0.05
    stated = (('load_coefficient', 'value', ''),)
    acts = True

    def act(self, live: Live) -> None:
        live.friction[self.index] += self.value * abs(live.load[self.index])


@dataclass(frozen=True)
class PreslidingHysteresis(OneJoint):
    """Dahl friction: a spring that slips, with its state integrated exactly over each step."""

    name = 'presliding_hysteresis'
    ordinary = 0.03
    stated = (
        ('presliding_torque', 'value', 'N m'),
        ('breakaway_distance', 'distance', 'rad'),
    )
    acts = True
    distance: float = 0.01

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return ((setting.high[j] - setting.low[j]) * rng.uniform(0.02, 0.06),)

    def act(self, live: Live) -> None:
        state = live.memory.setdefault(id(self), np.zeros(1))
        way = live.dq[self.index] * live.dt
        live.applied[self.index] -= self.value * state[0]
        target = np.sign(way)
        state[0] = target + (state[0] - target) * np.exp(-abs(way) / self.distance)


@dataclass(frozen=True)
class ThermalFriction(OneJoint):
    """Viscous friction that gets less as the joint warms up."""

    name = 'thermal_friction'
    ordinary, by_speed = -0.02, 1
    stated = (
        ('viscous_change', 'value', 'N m s/rad'),
        ('warm_up_time', 'time_constant', 's'),
    )
    needs = ('viscous_friction',)
    acts = True
    repeats = False
    time_constant: float = 10.0

    @classmethod
    def drawn(cls, setting: Setting, j: int, rng: np.random.Generator) -> tuple[Any, ...]:
        return (rng.uniform(6.0, 15.0),)

    def act(self, live: Live) -> None:
        warmth = 1.0 - np.exp(-live.t / self.time_constant)
        speed = live.dq[self.index]
        live.applied[self.index] -= self.value * warmth * speed


@dataclass(frozen=True)
class CoupledJointFriction(InPair):
    """
    A shaft that turns with the sum of the last two joints: a tendon with friction and damping.

    What the shaft's damping adds to each joint from its own motion is taken off the joint.

    """

    name = 'coupled_joint_friction'
    needs = ('viscous_friction',)
    coulomb: float
    most_viscous: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        drive = float(setting.strength[-2:].min())
        viscous = 0.005 * drive / float(setting.robot.velocity_limit[-2:].max())
        return cls(setting.joints[-2:], viscous, 0.02 * drive, 1.6 * viscous)

    def scaled(self, factor: float) -> Self:
        viscous = min(self.value * factor, self.most_viscous)  # less than the joint's own
        return replace(self, value=viscous, coulomb=self.coulomb * factor)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        joint = self.pair[0]
        return (
            Parameter('coupled_inertia', joint, 0.0, 'kg m^2'),
            Parameter('coupled_viscous_coefficient', joint, self.value, 'N m s/rad'),
            Parameter('coupled_coulomb_torque', joint, self.coulomb, 'N m'),
        )

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        tendon = spec.add_tendon(name='shaft')
        for joint in self.pair:
            tendon.wrap_joint(joint, 1.0)
        tendon.frictionloss = self.coulomb
        tendon.damping = [self.value, 0.0, 0.0]

    def prepare(self, live: Live) -> None:
        for joint in self.pair:
            live.model.dof_damping[live.dofs[live.robot.index(joint)]] -= self.value
