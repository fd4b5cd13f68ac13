# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, make_effect, parse_effect
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np
import pytest

LINEAR = {name for name, effect in CATALOGUE.items() if effect.linear}


@pytest.fixture(scope='module')
def robot():
    return load_robot('humanoid_arm')


@pytest.fixture(scope='module')
def motion(robot):
    """Half a second of sines, different ones in every joint, without a measured torque."""
    t = np.arange(0.0, 0.5, 0.005)
    frequency = 2.0 * np.pi * np.linspace(0.4, 2.1, 6)
    phase = frequency * t[:, None] + np.arange(6)
    middle, amplitude = (robot.lower + robot.upper) / 2, 0.35 * (robot.upper - robot.lower)
    return Motion(
        robot.joints,
        t,
        middle + amplitude * np.sin(phase),
        amplitude * frequency * np.cos(phase),
        -amplitude * frequency**2 * np.sin(phase),
    )


def with_values(robot, name, values):
    return ArmModel(robot).with_effect(make_effect(name, robot), values)


def n_parameters(robot, name):
    return len(make_effect(name, robot).parameters(robot))


def derivative(function, values, parameter, lower):
    """Differentiate by central differences; forwards, to second order, at the lower bound."""
    step = 1e-6 * np.eye(len(values))[parameter]
    if values[parameter] > lower:
        return (function(values + step) - function(values - step)) / 2e-6
    near, far = function(values + step), function(values + 2.0 * step)
    return (4.0 * near - far - 3.0 * function(values)) / 2e-6


@pytest.mark.parametrize('name', CATALOGUE)
def test_columns_are_the_derivative_of_what_the_simulation_applies(robot, motion, name):
    """Of the torque that is read, at the model without the effect."""
    effect = make_effect(name, robot)
    columns = ArmModel(robot).with_effect(effect).effect_columns(motion)
    zero, (lower, _) = np.zeros(columns.shape[2]), effect.bounds()
    for parameter in range(columns.shape[2]):
        difference = derivative(
            lambda values: with_values(robot, name, values).torque(motion),
            zero,
            parameter,
            lower[parameter],
        )
        scale = 1.0 + np.abs(columns[:, :, parameter]).max()
        tolerance = (3e-7 if effect.linear else 1e-5) * scale
        np.testing.assert_allclose(difference, columns[:, :, parameter], atol=tolerance)


@pytest.mark.parametrize('name', sorted(LINEAR))
def test_linear_effects_are_exact_far_from_zero(robot, motion, name):
    rng = np.random.default_rng(6)
    motion = motion.with_torque(rng.normal(scale=10.0, size=motion.q.shape))
    values = rng.uniform(0.1, 0.5, n_parameters(robot, name))
    arm = with_values(robot, name, values)
    expected = (
        inverse_dynamics(robot, motion)
        + ArmModel(robot).with_effect(arm.effects[0]).effect_columns(motion) @ values
    )
    np.testing.assert_allclose(arm.torque(motion), expected, atol=1e-10)


@pytest.mark.parametrize('name', CATALOGUE)
def test_an_effect_of_size_zero_changes_nothing(robot, motion, name):
    tau = with_values(robot, name, np.zeros(n_parameters(robot, name))).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(robot, motion), atol=1e-12)


@pytest.mark.parametrize('name', ['viscous_friction', 'coulomb_friction'])
def test_friction_takes_energy_whatever_the_direction(robot, motion, name):
    tau = with_values(robot, name, np.full(6, 0.3)).torque(motion)
    friction = tau - inverse_dynamics(robot, motion)
    assert np.all(friction * motion.dq >= 0.0)
    assert np.all(np.sum(friction * motion.dq, axis=1) > 0.0)


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


def test_rotor_inertia_of_the_first_joint_is_its_link_inertia(robot, motion):
    parameters = robot.rigid_parameters.copy()
    parameters[9] += 0.07  # Izz1
    np.testing.assert_allclose(
        with_values(robot, 'rotor_inertia', [0.07, 0, 0, 0, 0, 0]).torque(motion),
        inverse_dynamics(robot.with_inertias(parameters), motion),
        atol=1e-12,
    )


def test_coupled_friction_dissipates_along_the_shaft_only(robot, motion):
    arm = with_values(robot, 'coupled_joint_friction', [0.0, 0.0, 0.4])
    friction = arm.torque(motion) - inverse_dynamics(robot, motion)
    shaft = motion.dq[:, 4] + motion.dq[:, 5]
    np.testing.assert_allclose(friction[:, 4], 0.4 * np.sign(shaft))
    np.testing.assert_allclose(friction[:, 5], friction[:, 4])
    assert not np.any(friction[:, :4])


def test_moon_is_earth_with_less_gravity(robot, motion):
    moon = load_robot('humanoid_arm', gravity='moon')
    tau = with_values(robot, 'gravity_magnitude', [1.62 - 9.81]).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(moon, motion), atol=1e-12)


def test_base_tilt_is_gravity_seen_from_a_turned_base(robot, motion):
    angle = 0.05
    tilted = robot.with_gravity([0.0, -9.81 * np.sin(angle), -9.81 * np.cos(angle)])
    tau = with_values(robot, 'base_tilt', [angle, 0.0]).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(tilted, motion), atol=1e-12)


def test_payload_is_a_body_fixed_to_the_last_link(robot, motion):
    """0.3 kg at the centroid of link 6 is the shipped arm with load, up to its point inertia."""
    loaded = load_robot('humanoid_arm_loaded')
    difference = loaded.rigid_parameters - robot.rigid_parameters
    np.testing.assert_allclose(difference[:50], 0.0)
    tau = with_values(robot, 'payload', difference[50:]).torque(motion)
    np.testing.assert_allclose(tau, inverse_dynamics(loaded, motion), atol=1e-12)


def test_payload_is_swallowed_by_free_link_parameters(robot):
    arm = ArmModel(robot)
    rng = np.random.default_rng(0)
    with_payload = arm.with_effect(make_effect('payload', robot))
    assert with_payload.base_parameters(rng).rank == arm.base_parameters(rng).rank


def test_names_joints_and_units():
    robot = load_robot('humanoid_arm')
    effect = make_effect('viscous_friction@elbow_pitch+wrist_pitch', robot)
    assert [(p.joint, p.unit) for p in effect.parameters(robot)] == [
        ('elbow_pitch', 'N m s/rad'),
        ('wrist_pitch', 'N m s/rad'),
    ]


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('stiction', 'viscous_friction, coulomb_friction'),
        ('viscous_friction@elbo', 'its joints are shoulder_pitch'),
        ('coupled_joint_friction@elbow_pitch', 'pairs'),
        ('gravity_magnitude@elbow_pitch', 'whole arm'),
    ],
)
def test_errors_hold_the_answer(robot, text, message):
    with pytest.raises(ModelError, match=message):
        make_effect(text, robot)


def test_values_are_parsed_for_every_joint(robot):
    effect, values = parse_effect('asymmetric_friction:viscous_asymmetry=0.25', robot)
    np.testing.assert_array_equal(values.reshape(6, 2), np.tile([0.0, 0.25], (6, 1)))
    assert effect.joints == robot.joints


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('viscous_friction:fv=1', 'it has viscous_coefficient'),
        ('viscous_friction:viscous_coefficient=much', 'not a number'),
    ],
)
def test_wrong_values_are_named(robot, text, message):
    with pytest.raises(ModelError, match=message):
        parse_effect(text, robot)
