# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden springs: in the transmission, across joints, at the ends of the range, at the hand."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Self

from armid_ros.robots import Robot
import mujoco
import numpy as np

from tests.hidden.arrays import FloatArray, holding_parameters, Parameter, spring_parameters
from tests.hidden.base import InPair, Live, OneJoint, Setting


@dataclass(frozen=True)
class JointSpring(OneJoint):
    """A native spring across a joint, at rest at some position."""

    name = 'joint_spring'
    rest: float = 0.0

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = setting.pick(rng)
        low, high = setting.low[j], setting.high[j]
        value = 0.05 * setting.strength[j] / (high - low)
        return cls(setting.joints[j], j, value, float(rng.uniform(low, high)))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return spring_parameters(self.joint, self.value, self.rest)

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        joint = spec.joint(self.joint)
        joint.stiffness, joint.springref = [self.value, 0.0, 0.0], self.rest


@dataclass(frozen=True)
class SoftLimit(OneJoint):
    """A bumper that pushes back beyond a position near the upper end of the motion."""

    name = 'soft_limit'
    stated = (
        ('upper_stiffness', 'value', 'N m/rad'),
        ('upper_position', 'position', 'rad'),
    )
    acts = True
    position: float = 0.0

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = setting.pick(rng)
        low, high = setting.low[j], setting.high[j]
        position = high - (high - low) * rng.uniform(0.2, 0.35)
        value = 0.1 * setting.strength[j] / (high - position)
        return cls(setting.joints[j], j, value, position)

    def act(self, live: Live) -> None:
        beyond = live.q[self.index] - self.position
        if beyond > 0.0:
            live.applied[self.index] -= self.value * beyond


@dataclass(frozen=True)
class JointCoupling(InPair):
    """A cable between two neighbouring joints: each feels the other's position."""

    name = 'joint_coupling'
    acts = True
    first: int

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        i = int(rng.integers(0, setting.robot.n_joints - 1))
        reach = max(setting.high[i + 1] - setting.low[i + 1], setting.high[i] - setting.low[i])
        stiffness = 0.05 * float(setting.strength[i : i + 2].min()) / reach
        return cls(setting.joints[i : i + 2], stiffness, i)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('coupling_stiffness', self.pair[0], self.value, 'N m/rad'),)

    def act(self, live: Live) -> None:
        i = self.first
        live.applied[i] += self.value * live.q[i + 1]
        live.applied[i + 1] += self.value * live.q[i]


@dataclass(frozen=True)
class JointElasticity(OneJoint):
    """A second hinge behind the motor's, with a native spring and a little damping."""

    name = 'joint_elasticity'
    stated = (('compliance', 'value', 'rad/(N m)'),)
    needs = ('rotor_inertia',)
    dt = 2.5e-4
    retardation: float = 4e-4

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = setting.pick(rng, loaded=0.1)
        return cls(setting.joints[j], j, 0.002 / float(setting.torque[j]))

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        twist = add_twist(spec, self.joint)
        twist.stiffness = [1.0 / self.value, 0.0, 0.0]
        twist.damping = [self.retardation / self.value, 0.0, 0.0]


class Backlash(OneJoint):
    """A second hinge behind the motor's, free between two stops."""

    name = 'backlash'
    ordinary, by_torque, loaded = 0.004, 0, 0.1
    stated = (
        ('backlash', 'value', 'rad'),
        ('crossing_width', 'value', 'rad'),
    )
    needs = ('rotor_inertia',)
    dt = 2.5e-4

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        twist = add_twist(spec, self.joint)
        twist.limited = True
        twist.range = [-0.5 * self.value, 0.5 * self.value]
        twist.solref_limit = [0.005, 1.0]  # teeth that do not bounce
        twist.solimp_limit = [0.999, 0.9999, 1e-5, 0.5, 2.0]
        twist.margin = 0.0


@dataclass(frozen=True)
class _Strap(OneJoint):
    """Something between a point of a link and a fixed point; the value is its stiffness [N/m]."""

    attachment: tuple[float, float, float]
    anchor: tuple[float, float, float]
    acts = True

    def act(self, live: Live) -> None:
        mujoco.mj_kinematics(live.model, live.data)
        mujoco.mj_comPos(live.model, live.data)
        body = int(live.model.joint(self.joint).bodyid[0])
        place = live.data.xmat[body].reshape(3, 3) @ self.attachment
        point = live.data.xpos[body] + place
        jacobian = np.empty((3, live.model.nv))
        mujoco.mj_jac(live.model, live.data, jacobian, None, point, body)
        velocity = jacobian @ live.data.qvel
        force = self.force(point - self.anchor, velocity)
        live.applied += (jacobian.T @ force)[live.dofs]

    @abstractmethod
    def force(self, way: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the force on the arm, shape (3,) [N]."""


@dataclass(frozen=True)
class HumanInteraction(_Strap):
    """A spring and a damper."""

    name = 'human_interaction'
    limit_of = ('interface_slack',)
    damping_time: float = 0.02
    middle: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j, attachment, points = _attach(setting, rng)
        anchor = points.mean(axis=0) + 0.05 * rng.normal(size=3)
        reach = np.linalg.norm(points - anchor, axis=1).mean()
        stiffness = 0.02 * float(setting.strength[:2].mean()) / reach
        ends = np.array([setting.robot.lower, setting.robot.upper])
        posture = np.where(np.isfinite(ends).all(axis=0), ends, 0.0).mean(axis=0)
        middle = setting.points(j, np.array(attachment), posture[np.newaxis])[0]
        anchor = tuple(anchor.tolist())
        return cls(
            setting.joints[j], j, stiffness, attachment, anchor, middle=tuple(middle.tolist())
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        way = np.array(self.anchor) - self.middle
        return holding_parameters(self.joint, self.value, self.damping_time, way)

    def force(self, way: FloatArray, velocity: FloatArray) -> FloatArray:
        return -self.value * (way + self.damping_time * velocity)


@dataclass(frozen=True)
class InterfaceSlack(_Strap):
    """A strap that pulls when it is taut."""

    name = 'interface_slack'
    slack: float = 0.0

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j, attachment, points = _attach(setting, rng)
        spread = points.std(axis=0).max()
        anchor = points.mean(axis=0) + spread * rng.normal(size=3)
        reach = np.linalg.norm(points - anchor, axis=1)
        slack = float(np.quantile(reach, rng.uniform(0.3, 0.6)))
        stiffness = 0.04 * float(setting.strength[:2].mean()) / (reach.max() - slack)
        anchor = tuple(anchor.tolist())
        return cls(setting.joints[j], j, stiffness, attachment, anchor, slack)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('slack_stiffness', self.joint, self.value, 'N/m'),
            *(
                Parameter(f'anchor_{axis}', self.joint, value, 'm')
                for axis, value in zip('xyz', self.anchor, strict=True)
            ),
            Parameter('slack', self.joint, self.slack, 'm'),
        )

    def force(self, way: FloatArray, velocity: FloatArray) -> FloatArray:
        length = np.linalg.norm(way)
        return -self.value * max(length - self.slack, 0.0) * way / max(length, 1e-9)


def add_twist(spec: mujoco.MjSpec, joint: str) -> mujoco.MjsJoint:
    """Add a hinge on the axis of a joint, between its motor and its link."""
    motor = spec.joint(joint)
    twist = motor.parent.add_joint(name=f'{joint}_twist')
    twist.type, twist.axis, twist.pos = motor.type, motor.axis, motor.pos
    return twist


def _attach(
    setting: Setting, rng: np.random.Generator
) -> tuple[int, tuple[float, float, float], FloatArray]:
    """Return a link beyond the third joint, its centre of mass, and where that comes to."""
    robot = setting.robot
    j = int(rng.integers(3, robot.n_joints))
    centre = robot.model.inertias[j + 1].lever
    return j, tuple(centre.tolist()), setting.points(j, centre)
