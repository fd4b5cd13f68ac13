# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The shipped two-link arm with elastic joints, as a plant and under its drives."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.two_link import ROBOT, TwoLinkParameters, TwoLinkSet
from armid_ros.simulation.motor_control import VelocityLoop
from armid_ros.simulation.plant import Plant
from armid_ros.simulation.springs import Elasticity
import numpy as np
import pinocchio as pin


def two_link_arm(parameters: TwoLinkParameters, robot: Robot | None = None) -> ArmModel:
    """
    Return the two links as an arm with effects of the catalogue.

    The friction of the links is not among them: give it to the plant.

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


def two_link_plant(parameters: TwoLinkParameters, *, dt: float = 1e-3, substeps: int = 2) -> Plant:
    """Return the two links ready to be integrated."""
    arm = two_link_arm(parameters)
    return Plant(arm, dt, elasticity=Elasticity(substeps, parameters.link_damping))


def two_link_loop(shipped: TwoLinkSet, share: float = 1.0) -> VelocityLoop:
    """Return the velocity loop of the shipped arm, or one with a share of its gains."""
    parameters = shipped.parameters
    return VelocityLoop.of_drive(
        share * np.asarray(shipped.assumptions['proportional_gain']),
        share * np.asarray(shipped.assumptions['integral_gain']),
        parameters.torque_per_volt,
        parameters.gear,
    )


def modes(plant: Plant, q: FloatArray, *, locked: bool = False) -> FloatArray:
    """
    Return the natural frequencies and damping ratios of an elastic arm without dry friction.

    Parameters
    ----------
    plant : Plant
        The arm, with springs.
    q : ndarray, shape (n,)
        Position of the links [rad].
    locked : bool
        Whether the motors are held, as by a stiff velocity loop.

    Returns
    -------
    ndarray, shape (K, 2)
        Undamped frequency [Hz] and damping ratio of each oscillation, lowest first.

    Raises
    ------
    ModelError
        If all joints are rigid.

    """
    springs = plant.springs
    if springs is None:
        raise ModelError(f'{plant.robot.name}: its joints are rigid and do not oscillate')
    model, e = plant.robot.model, len(springs.joints)
    inertia = springs.rotors.copy()
    inertia[e:, e:] += pin.crba(model, model.createData(), np.asarray(q, dtype=float))
    w = springs.to_twists
    resist = springs.damping + (w.T * springs.transmission.damping) @ w
    spring = w.T * springs.transmission.stiffness
    if locked:
        inertia, resist, spring, w = inertia[e:, e:], resist[e:, e:], spring[e:], w[:, e:]
    size = e + len(inertia)
    a = np.zeros((size, size))
    a[:e, e:] = w
    a[e:] = np.linalg.solve(inertia, -np.hstack([spring, resist]))
    poles = np.linalg.eigvals(a)
    poles = poles[poles.imag > 1e-6]
    found = np.column_stack([np.abs(poles) / (2.0 * np.pi), -poles.real / np.abs(poles)])
    return np.asarray(found[np.argsort(found[:, 0])])
