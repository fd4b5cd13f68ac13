# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Construction of a simulated arm with elastic joints, drives and sensors from an arm model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.robots import Robot
from armid_ros.robots.two_link import ROBOT, two_link_set, TwoLinkSet
from armid_ros.simulation.accelerometers import LinkAccelerometers
from armid_ros.simulation.elastic.two_link import two_link_arm, two_link_loop
from armid_ros.simulation.motor_control import MotorControl, VelocityLoop
from armid_ros.simulation.plant import Plant
from armid_ros.simulation.sensors import Sensors
from armid_ros.simulation.simulated_arm import SimulatedArm
from armid_ros.simulation.springs import Elasticity
import numpy as np
import numpy.typing as npt


def shipped_arm(robot: Robot) -> tuple[ArmModel, TwoLinkSet | None]:
    """
    Return the arm model of a shipped robot, and its drives if they are known.

    The model has no effects, except for the two-link arm: the springs, friction and drives of that
    arm are in its parameter set 'after'.

    """
    if robot.name != ROBOT:
        return ArmModel(robot), None
    shipped = two_link_set('after')
    return two_link_arm(shipped.parameters, robot), shipped


def elastic_joints(arm: ArmModel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """
    Return the elastic joints: those with rotor inertia, and those without.

    A motor without inertia has no motion of its own. Its spring is simulated as a twist that
    follows the load without delay.

    """
    action, joints = arm.action(), arm.robot.joints
    if action.transmission is None:
        return (), ()
    rotor = np.zeros(len(joints)) if action.inertia is None else np.diag(action.inertia)
    springs = np.flatnonzero(np.isfinite(action.transmission.stiffness))
    with_rotor = tuple(joints[j] for j in springs if rotor[j] > 0.0)
    return with_rotor, tuple(joints[j] for j in springs if rotor[j] <= 0.0)


def no_rotor(joints: Sequence[str]) -> str:
    """Return a note on how springs are simulated whose motors have no inertia."""
    return (
        f'{", ".join(joints)}: joint_elasticity without rotor_inertia, so that no motor moves on '
        'its own. All joints are simulated as rigid ones whose encoders read the twist under '
        'load; add rotor_inertia to have vibrations'
    )


def make_elastic_arm(
    arm: ArmModel,
    *,
    rng: np.random.Generator,
    drives: TwoLinkSet | None = None,
    gain: float = 1.0,
    dt: float = 1e-3,
    sensors: Sensors | None = None,
    start: npt.ArrayLike | None = None,
) -> SimulatedArm:
    """
    Make a simulated arm with elastic joints.

    Parameters
    ----------
    arm : ArmModel
        Arm model with joint_elasticity and rotor_inertia.
    rng : numpy.random.Generator
        Source of the sensors' noise.
    drives : TwoLinkSet, optional
        Velocity loops, friction of the links and places of the accelerometers of the two-link arm.
        By default, loops are designed from the model of the arm.
    gain : float
        Factor on the gains of the loops.
    dt : float
        Step of plant and loops [s].
    sensors, start
        As for `SimulatedArm`.

    Raises
    ------
    ModelError
        If no joint is elastic, or the motor of an elastic joint has no inertia.

    """
    if drives is None:
        plant, places = Plant(arm, dt, elasticity=Elasticity()), None
        control = MotorControl.of(plant)
    else:
        elasticity = Elasticity(link_damping=drives.parameters.link_damping)
        plant = Plant(arm, dt, elasticity=elasticity)
        control = MotorControl(two_link_loop(drives), dt)
        places = np.outer(drives.assumptions['accelerometer_radius'], [1.0, 0.0, 0.0])
    loop = VelocityLoop(gain * control.loop.proportional, gain * control.loop.integral)
    return SimulatedArm(
        plant,
        rng=rng,
        controller=replace(control, loop=loop),
        sensors=sensors,
        accelerometers=LinkAccelerometers(plant.robot, places),
        start=start,
    )
