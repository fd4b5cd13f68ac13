# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction, rotors, gravity and bodies, each against what it is in physics."""

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.model import inverse_dynamics
from armid_ros.robots import load_robot
import numpy as np
import pinocchio as pin
import pytest


def test_asymmetric_friction_gives_each_direction_its_own_law(robot, motion):
    """Fc+ = 0.5, Fc- = 0.2, Fv+ = 0.3, Fv- = 0.1 as means and half differences."""
    arm = (
        ArmModel(robot)
        .with_effect(make_effect('coulomb_friction', robot), np.full(6, 0.35))
        .with_effect(make_effect('viscous_friction', robot), np.full(6, 0.2))
        .with_effect(make_effect('asymmetric_friction', robot), np.tile([0.15, 0.1], 6))
    )
    dq = motion.dq
    law = np.where(dq > 0.0, 0.5 + 0.3 * dq, -0.2 + 0.1 * dq)
    np.testing.assert_allclose(arm.torque(motion) - inverse_dynamics(robot, motion), law)


def test_rotor_inertia_of_the_first_joint_is_its_link_inertia(robot, motion, with_values):
    parameters = robot.rigid_parameters.copy()
    parameters[9] += 0.07  # Izz1
    np.testing.assert_allclose(
        with_values('rotor_inertia', [0.07, 0, 0, 0, 0, 0]).torque(motion),
        inverse_dynamics(robot.with_inertias(parameters), motion),
        atol=1e-12,
    )


def test_coupled_friction_dissipates_along_the_shaft_only(robot, motion, with_values):
    arm = with_values('coupled_joint_friction', [0.0, 0.0, 0.4])
    friction = arm.torque(motion) - inverse_dynamics(robot, motion)
    shaft = motion.dq[:, 4] + motion.dq[:, 5]
    np.testing.assert_allclose(friction[:, 4], 0.4 * np.sign(shaft))
    np.testing.assert_allclose(friction[:, 5], friction[:, 4])
    assert not np.any(friction[:, :4])


def test_moon_is_earth_with_less_gravity(robot, motion, with_values):
    moon = load_robot('humanoid_arm', gravity='moon')
    tau = with_values('gravity_magnitude', [1.62 - 9.81]).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(moon, motion), atol=1e-12)


def test_base_tilt_is_gravity_seen_from_a_turned_base(robot, motion, with_values):
    angle = 0.05
    tilted = robot.with_gravity([0.0, -9.81 * np.sin(angle), -9.81 * np.cos(angle)])
    tau = with_values('base_tilt', [angle, 0.0]).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(tilted, motion), atol=1e-12)


def test_payload_is_a_body_fixed_to_the_last_link(robot, motion, with_values):
    """0.3 kg at the centroid of link 6 is the shipped arm with load, up to its point inertia."""
    loaded = load_robot('humanoid_arm_loaded')
    difference = loaded.rigid_parameters - robot.rigid_parameters
    np.testing.assert_allclose(difference[:50], 0.0)
    tau = with_values('payload', difference[50:]).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(loaded, motion), atol=1e-12)


def test_payload_is_swallowed_by_free_link_parameters(robot):
    arm = ArmModel(robot)
    rng = np.random.default_rng(0)
    with_payload = arm.with_effect(make_effect('payload', robot))
    assert with_payload.base_parameters(rng).rank == arm.base_parameters(rng).rank


@pytest.mark.parametrize('seed', range(5))
def test_a_body_may_be_a_payload_and_one_lighter_about_its_axis_than_a_point_may_not(seed):
    rng = np.random.default_rng(seed)
    robot = load_robot('humanoid_arm')
    effect, arm = make_effect('payload', robot), ArmModel(robot)
    centre, thin = rng.uniform(0.05, 0.2, 3), rng.normal(size=(3, 3))
    inertia = pin.Inertia(rng.uniform(0.5, 5.0), centre, 1e-3 * thin @ thin.T)
    values = inertia.toDynamicParameters()
    std = np.full(10, 1e-6)
    assert effect.plausible(values, std, arm)
    nothing = np.concatenate([values[:4], 0.1 * values[4:]])
    assert not effect.plausible(nothing, std, arm)
    assert effect.plausible(nothing, np.abs(values), arm)


@pytest.mark.parametrize(('change', 'possible'), [(-6.7, False), (-1e-5, True), (6.7, True)])
def test_no_link_has_an_inertia_of_less_than_nothing(robot, change, possible):
    arm, effect = ArmModel(robot), CATALOGUE['link_inertia'].on(robot, ('elbow_pitch',))
    values, std = np.zeros(10), np.full(10, 1e-3)
    values[4] = change
    assert effect.plausible(values, std, arm) == possible
    hidden = np.where(np.arange(10) < 6, std, 0.0)  # Izz may stand for Ixx
    assert effect.plausible(values, hidden, arm)


@pytest.mark.parametrize(('shift', 'opposes'), [(0.4, True), (-0.4, True), (0.7, False)])
def test_friction_of_any_direction_opposes_the_motion(robot, shift, opposes):
    """A joint of 0.5 N m of friction is not pushed forwards by 0.2 N m of it."""
    arm = ArmModel(robot).with_effect(make_effect('coulomb_friction', robot), np.full(6, 0.5))
    effect = CATALOGUE['asymmetric_friction'].on(robot, ('elbow_pitch',))
    values, sure = np.array([shift, 0.0]), np.full(2, 0.01)
    assert effect.plausible(values, sure, arm) == opposes
    assert effect.plausible(values, 10.0 * sure, arm)
    assert effect.plausible(values, sure, ArmModel(robot))
