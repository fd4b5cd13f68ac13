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
from tests.hidden.base import InJoint, InPair, Live, OneJoint, pick, pick_loaded, Setting


@dataclass(frozen=True)
class JointSpring(OneJoint):
    """A native spring across a joint, at rest at some position."""

    name = 'joint_spring'
    rest: float = 0.0

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = pick(setting, rng)
        low, high = setting.low[j], setting.high[j]
        value = 0.05 * setting.drive[j] / (high - low)
        return cls(setting.robot.joints[j], j, value, float(rng.uniform(low, high)))

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
        j = pick(setting, rng)
        low, high = setting.low[j], setting.high[j]
        position = high - (high - low) * rng.uniform(0.2, 0.35)
        value = 0.1 * setting.drive[j] / (high - position)
        return cls(setting.robot.joints[j], j, value, position)

    def act(self, live: Live) -> None:
        beyond = live.data.qpos[live.dofs[self.index]] - self.position
        if beyond > 0.0:
            live.applied[self.index] -= self.value * beyond


@dataclass(frozen=True)
class JointCoupling(InPair):
    """A cable between two neighbouring joints: each feels the other's position."""

    name = 'joint_coupling'
    sized_by = 'stiffness'
    acts = True
    first: int
    stiffness: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        i = int(rng.integers(0, setting.robot.n_joints - 1))
        reach = max(setting.high[i + 1] - setting.low[i + 1], setting.high[i] - setting.low[i])
        stiffness = 0.05 * float(setting.drive[i : i + 2].min()) / reach
        return cls(setting.robot.joints[i : i + 2], i, stiffness)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter('coupling_stiffness', self.pair[0], self.stiffness, 'N m/rad'),)

    def act(self, live: Live) -> None:
        i = self.first
        live.applied[i] += self.stiffness * live.data.qpos[live.dofs[i + 1]]
        live.applied[i + 1] += self.stiffness * live.data.qpos[live.dofs[i]]


@dataclass(frozen=True)
class JointElasticity(InJoint):
    """A second hinge behind the motor's, with a native spring and a little damping."""

    name = 'joint_elasticity'
    sized_by = 'compliance'
    stated = (('compliance', 'compliance', 'rad/(N m)'),)
    needs = ('rotor_inertia',)
    dt = 2.5e-4
    index: int
    compliance: float
    retardation: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = pick_loaded(setting, rng, 0.1)
        return cls(setting.robot.joints[j], j, 0.002 / float(setting.torque[j]), 4e-4)

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        twist = add_twist(spec, self.joint)
        twist.stiffness = [1.0 / self.compliance, 0.0, 0.0]
        twist.damping = [self.retardation / self.compliance, 0.0, 0.0]


@dataclass(frozen=True)
class Backlash(InJoint):
    """A second hinge behind the motor's, free between two stops."""

    name = 'backlash'
    sized_by = 'width'
    stated = (
        ('backlash', 'width', 'rad'),
        ('crossing_width', 'width', 'rad'),
    )
    needs = ('rotor_inertia',)
    dt = 2.5e-4
    index: int
    width: float

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        j = pick_loaded(setting, rng, 0.1)
        return cls(setting.robot.joints[j], j, 0.004)

    def edit(self, spec: mujoco.MjSpec, robot: Robot) -> None:
        twist = add_twist(spec, self.joint)
        twist.limited = True
        twist.range = [-0.5 * self.width, 0.5 * self.width]
        twist.solref_limit = [0.005, 1.0]  # teeth that do not bounce
        twist.solimp_limit = [0.999, 0.9999, 1e-5, 0.5, 2.0]
        twist.margin = 0.0


@dataclass(frozen=True)
class _Strap(InJoint):
    """Something between a point of a link and a fixed point of the world."""

    attachment: tuple[float, float, float]
    anchor: tuple[float, float, float]
    stiffness: float
    acts = True
    sized_by = 'stiffness'

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
        joint, attachment, points = _attach(setting, rng)
        anchor = points.mean(axis=0) + 0.05 * rng.normal(size=3)
        reach = np.linalg.norm(points - anchor, axis=1).mean()
        stiffness = 0.02 * float(setting.drive[:2].mean()) / reach
        middle = _middle(setting, joint, attachment)
        return cls(joint, attachment, tuple(anchor.tolist()), stiffness, middle=middle)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        way = np.array(self.anchor) - self.middle
        return holding_parameters(self.joint, self.stiffness, self.damping_time, way)

    def force(self, way: FloatArray, velocity: FloatArray) -> FloatArray:
        return -self.stiffness * (way + self.damping_time * velocity)


@dataclass(frozen=True)
class InterfaceSlack(_Strap):
    """A strap that pulls when it is taut."""

    name = 'interface_slack'
    slack: float = 0.0

    @classmethod
    def draw(cls, setting: Setting, rng: np.random.Generator) -> Self:
        joint, attachment, points = _attach(setting, rng)
        spread = points.std(axis=0).max()
        anchor = points.mean(axis=0) + spread * rng.normal(size=3)
        reach = np.linalg.norm(points - anchor, axis=1)
        slack = float(np.quantile(reach, rng.uniform(0.3, 0.6)))
        stiffness = 0.04 * float(setting.drive[:2].mean()) / (reach.max() - slack)
        return cls(joint, attachment, tuple(anchor.tolist()), stiffness, slack)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter('slack_stiffness', self.joint, self.stiffness, 'N/m'),
            *(
                Parameter(f'anchor_{axis}', self.joint, value, 'm')
                for axis, value in zip('xyz', self.anchor, strict=True)
            ),
            Parameter('slack', self.joint, self.slack, 'm'),
        )

    def force(self, way: FloatArray, velocity: FloatArray) -> FloatArray:
        length = np.linalg.norm(way)
        return -self.stiffness * max(length - self.slack, 0.0) * way / max(length, 1e-9)


def add_twist(spec: mujoco.MjSpec, joint: str) -> mujoco.MjsJoint:
    """Add a hinge on the axis of a joint, between its motor and its link."""
    motor = spec.joint(joint)
    twist = motor.parent.add_joint(name=f'{joint}_twist')
    twist.type, twist.axis, twist.pos = motor.type, motor.axis, motor.pos
    return twist


def _middle(
    setting: Setting, joint: str, attachment: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return where an attachment is in the middle of the range of motion, which forces go by."""
    robot = setting.robot
    ends = np.array([robot.lower, robot.upper])
    posture = np.where(np.isfinite(ends).all(axis=0), ends, 0.0).mean(axis=0)
    place = setting.points(robot.index(joint), np.array(attachment), posture[np.newaxis])
    return tuple(place[0].tolist())


def _attach(
    setting: Setting, rng: np.random.Generator
) -> tuple[str, tuple[float, float, float], FloatArray]:
    """Return a link beyond the third joint, its centre of mass, and where that comes to."""
    robot = setting.robot
    j = int(rng.integers(3, robot.n_joints))
    centre = robot.model.inertias[j + 1].lever
    return robot.joints[j], tuple(centre.tolist()), setting.points(j, centre)


SPRINGS = (
    JointSpring,
    SoftLimit,
    JointCoupling,
    JointElasticity,
    Backlash,
    HumanInteraction,
    InterfaceSlack,
)
