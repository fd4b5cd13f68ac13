# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The shipped two-link arm with elastic joints: its plant and its drives."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.two_link import ROBOT, TwoLinkParameters, TwoLinkSet
from armid_ros.simulation.motor_control import VelocityLoop
from armid_ros.simulation.plant import Plant
from armid_ros.simulation.springs import Elasticity
import numpy as np


def two_link_arm(parameters: TwoLinkParameters, robot: Robot | None = None) -> ArmModel:
    """
    Return the two-link arm as an arm model with effects of the catalogue.

    The model does not contain the friction of the links, which the plant adds.

    """
    robot = parameters.body(robot or load_robot(ROBOT))
    springs = make_effect('joint_elasticity', robot)
    springs = springs.with_shape((parameters.spring_damping / parameters.stiffness)[:, np.newaxis])
    arm = ArmModel(robot).with_effect(springs, 1.0 / parameters.stiffness)
    for name, values in (
        ('rotor_inertia', parameters.rotor),
        ('viscous_friction', parameters.joint_motor_damping),
        ('coulomb_friction', parameters.joint_coulomb),
    ):
        arm = arm.with_effect(make_effect(name, robot), values)
    return arm


def two_link_plant(parameters: TwoLinkParameters, *, substeps: int = 2) -> Plant:
    """Return the plant of the two-link arm."""
    arm = two_link_arm(parameters)
    return Plant(arm, elasticity=Elasticity(substeps, parameters.link_damping))


def two_link_loop(shipped: TwoLinkSet, share: float = 1.0) -> VelocityLoop:
    """Return the velocity loop of the shipped arm, with its gains times a factor."""
    # units of the gains are V s/rad and V/rad at the motors
    scale = share * shipped.parameters.torque_per_volt * shipped.parameters.gear
    proportional, integral = (
        scale * np.asarray(shipped.assumptions[name])
        for name in ('proportional_gain', 'integral_gain')
    )
    return VelocityLoop(proportional, integral)
