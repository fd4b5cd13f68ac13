# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The serial two-link arm with elastic joints: its parameters and the shipped parameter sets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

from armid_ros.errors import RobotError
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.motion import FloatArray, freeze
from armid_ros.robots.robot import Robot
import numpy as np
import pinocchio as pin

ROBOT = 'two_link_elastic'


@dataclass(frozen=True, eq=False)
class TwoLinkParameters:
    """
    Parameters of a planar two-link arm whose motors drive the links by springs and dampers.

    Motors: Mm v_m' + Dm v_m + fm sgn(v_m) = E u - n tau_g, motor side, n = 1 / gear.
    Springs: tau_g = Kg (n th_m - th_l) + Dg (n v_m - v_l).
    Links: M(th_l) v_l' + h(th_l, v_l) + Dl v_l = tau_g, with c2 = cos(th_l2) and
    M = [[alpha + beta + 2 gamma c2, beta + gamma c2], [beta + gamma c2, beta]].
    Source: Oaki and Adachi 2008, Table 1; equations in their standard form.

    Attributes
    ----------
    alpha, beta, gamma : float
        m1 lc1^2 + I1 + m2 l1^2, m2 lc2^2 + I2 and m2 l1 lc2 [kg m^2].
    motor_inertia : ndarray, shape (2,)
        mm [kg m^2], motor side.
    stiffness : ndarray, shape (2,)
        kg [N m/rad], link side.
    link_damping : ndarray, shape (2,)
        dl [N m s/rad].
    motor_damping : ndarray, shape (2,)
        dm [N m s/rad], motor side.
    spring_damping : ndarray, shape (2,)
        dg [N m s/rad], link side.
    coulomb : ndarray, shape (2,)
        fm [N m], motor side.
    torque_constant : ndarray, shape (2,)
        e [N m/V], motor side.
    gear : ndarray, shape (2,)
        Turns of the motor per turn of the joint.

    """

    alpha: float
    beta: float
    gamma: float
    motor_inertia: FloatArray
    stiffness: FloatArray
    link_damping: FloatArray
    motor_damping: FloatArray
    spring_damping: FloatArray
    coulomb: FloatArray
    torque_constant: FloatArray
    gear: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays and check that the inertia parameters are physically possible."""
        for field in fields(self)[3:]:
            freeze(self, field.name)
            values = getattr(self, field.name)
            if values.shape != (2,) or not np.all(np.isfinite(values)):
                raise RobotError(f'two links: {field.name} has to be two numbers, got {values}')
        if not (self.alpha > 0.0 and self.alpha * self.beta > self.gamma**2):
            raise RobotError(
                f'two links: alpha = {self.alpha:g}, beta = {self.beta:g} and gamma = '
                f'{self.gamma:g} kg m^2 are impossible; alpha beta has to exceed gamma^2'
            )

    @property
    def inertia(self) -> FloatArray:
        """Constant part of the inertia at each joint: alpha and beta, (2,) [kg m^2]."""
        return np.array([self.alpha, self.beta])

    @property
    def rotor(self) -> FloatArray:
        """Motor inertia, converted to the joint side, shape (2,) [kg m^2]."""
        return np.asarray(self.motor_inertia * self.gear**2)

    @property
    def joint_motor_damping(self) -> FloatArray:
        """Motor damping, converted to the joint side, shape (2,) [N m s/rad]."""
        return np.asarray(self.motor_damping * self.gear**2)

    @property
    def joint_coulomb(self) -> FloatArray:
        """Coulomb friction, converted to the joint side, shape (2,) [N m]."""
        return np.asarray(self.coulomb * self.gear)

    @property
    def torque_per_volt(self) -> FloatArray:
        """Joint torque per command voltage, shape (2,) [N m/V]."""
        return np.asarray(self.torque_constant * self.gear)

    @property
    def total_damping(self) -> FloatArray:
        """Viscous friction of link and motor at the joint, dl + dm gear^2, (2,) [N m s/rad]."""
        return np.asarray(self.link_damping + self.joint_motor_damping)

    def body(self, robot: Robot) -> Robot:
        """
        Return a robot whose link inertias agree with alpha, beta and gamma.

        Masses, lengths and the centroid of the first link do not change. The centroid and inertia
        of the second link and the inertia of the first link are adapted.

        """
        pi = np.array(robot.rigid_parameters).reshape(2, 10)
        length = float(robot.model.jointPlacements[2].translation[0])
        pi[1, 1] = self.gamma / length
        pi[1, [6, 9]] = self.beta
        pi[0, [6, 9]] = self.alpha - pi[1, 0] * length**2
        return robot.with_inertias(pi.ravel())


@dataclass(frozen=True, eq=False)
class TwoLinkSet:
    """
    Shipped parameter set of the two-link arm, with further assumptions for simulation.

    Attributes
    ----------
    parameters : TwoLinkParameters
        One of the published parameter sets.
    assumptions : mapping of str to value
        Values that the source does not give: link length, radii of the accelerometers, gains.

    """

    parameters: TwoLinkParameters
    assumptions: Mapping[str, Any]


def planar_pair(robot: Robot) -> bool:
    """Return whether a robot has two links with parallel axes and no gravity torque."""
    if robot.n_joints != 2 or np.any(robot.prismatic):
        return False
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, np.zeros(2), np.array([1.0, 0.0]))
    first = np.array(data.oMi[1].rotation @ data.v[1].angular)
    pin.forwardKinematics(robot.model, data, np.zeros(2), np.array([0.0, 1.0]))
    second = np.array(data.oMi[2].rotation @ data.v[2].angular)
    crossed = np.abs([np.cross(first, second), np.cross(first, robot.gravity)])
    return bool(crossed.max() < 1e-6)


def two_link_set(name: str) -> TwoLinkSet:
    """
    Read a shipped parameter set of the two-link arm, 'before' or 'after' tuning.

    Raises
    ------
    RobotError
        If the set does not exist.

    """
    path = Path(str(resources.files('armid_ros.robots').joinpath(ROBOT, 'parameters.yaml')))
    text = read_text(path, RobotError)
    with reading(path, RobotError):
        content = load_yaml(text)
        if name not in content['sets']:
            raise RobotError(f"unknown parameter set '{name}'; use {', '.join(content['sets'])}")
        assumed = {key: entry['value'] for key, entry in content['assumptions'].items()}
        parameters = TwoLinkParameters(**content['sets'][name], **content['drive'])
    return TwoLinkSet(parameters, MappingProxyType(assumed))
