# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What every effect of the catalogue keeps to, tested for each of them."""

from armid_ros.arm import ArmModel
from armid_ros.arm.testing import CHECKS, EffectCase
from armid_ros.effects import CATALOGUE, make_effect, parse_effect
from armid_ros.errors import ModelError
import numpy as np
import pytest

DESIGNED = """
    viscous_friction coulomb_friction stribeck_friction asymmetric_friction quadratic_friction
    load_dependent_friction presliding_hysteresis thermal_friction coupled_joint_friction
    torque_offset torque_drift torque_gain torque_crosstalk torque_lag time_delay encoder_offset
    rotor_inertia payload link_inertia gravity_magnitude base_tilt joint_elasticity backlash
    torque_ripple joint_spring joint_coupling soft_limit actuator_saturation human_interaction
    interface_slack learned_torque
""".split()
#: These twist transmissions by the load of the arm as it is, which counts as given.
LOADED = {'joint_elasticity', 'backlash'}
#: Sizes that are far from zero where the typical ones would not do.
SIZES = {'link_inertia': 0.02, 'payload': 0.05, 'interface_slack': 300.0, 'soft_limit': 20.0}


def test_a_name_once_shipped_stays():
    assert set(DESIGNED) <= set(CATALOGUE)


@pytest.mark.parametrize('check', CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize('name', CATALOGUE)
def test_every_effect_keeps_the_contract(robot, name, check):
    """The one that is public, with sizes far from zero and with typical ones."""
    check(EffectCase.of(CATALOGUE[name], robot))
    check(EffectCase.of(CATALOGUE[name], robot, size=SIZES.get(name), seed=6))


def check_columns(arm, motion, chosen, tolerance):
    """Compare columns of some parameters with central differences."""
    columns, theta = arm.columns(motion), arm.theta
    for parameter in chosen:
        step = 1e-6 * np.eye(len(theta))[parameter]
        ends = [arm.with_theta(theta + sign * step).torque(motion) for sign in (1.0, -1.0)]
        scale = 1.0 + np.abs(columns[:, :, parameter]).max()
        np.testing.assert_allclose(
            (ends[0] - ends[1]) / 2e-6, columns[:, :, parameter], atol=tolerance * scale
        )


@pytest.mark.parametrize('name', CATALOGUE)
def test_columns_are_the_derivative_of_what_is_read_and_of_the_rigid_body(robot, motion, name):
    rng = np.random.default_rng(4)
    case = EffectCase.of(CATALOGUE[name], robot, size=SIZES.get(name), seed=4)
    arm, rigid = case.arm(case.values), len(robot.rigid_parameters)
    chosen = rigid + rng.permutation(len(case.values))[:12]
    if name not in LOADED:
        chosen = np.concatenate([rng.permutation(rigid)[:12], chosen])
    check_columns(arm, motion, chosen, 2e-5)


def test_columns_pass_through_sensors_that_come_after_one_another(robot, motion):
    """Delay, gain, crosstalk and lag, one after the other, over an arm that rubs and twists."""
    arm = ArmModel(robot)
    for seed, name in enumerate(
        'encoder_offset load_dependent_friction human_interaction torque_gain time_delay '
        'torque_crosstalk torque_lag payload'.split()
    ):
        case = EffectCase.of(CATALOGUE[name], robot, size=SIZES.get(name), seed=seed)
        arm = arm.with_effect(case.effect, case.values)
    chosen = np.random.default_rng(5).permutation(len(arm.theta))[:60]
    check_columns(arm, motion, chosen, 3e-5)


def test_a_shape_belongs_to_each_joint(robot, motion):
    effect = make_effect('stribeck_friction@elbow_pitch+wrist_pitch', robot)
    effect = effect.with_shape([[0.1, 1.0], [0.4, 2.0]])
    assert effect == effect.with_shape(effect.shape_values)
    named = zip(effect.shape_parameters(robot), effect.shape, strict=True)
    assert [(p.name, p.joint, p.unit, value) for p, value in named] == [
        ('stribeck_velocity', 'elbow_pitch', 'rad/s', 0.1),
        ('stribeck_exponent', 'elbow_pitch', '', 1.0),
        ('stribeck_velocity', 'wrist_pitch', 'rad/s', 0.4),
        ('stribeck_exponent', 'wrist_pitch', '', 2.0),
    ]
    columns = effect.columns(motion, ArmModel(robot))
    dq = motion.dq[:, 5]
    expected = np.exp(-((dq / 0.4) ** 2)) * np.sign(dq)
    np.testing.assert_allclose(columns[:, 5, 1], expected)


@pytest.mark.parametrize(
    ('values', 'message'),
    [([-1.0, 2.0], 'stribeck_velocity has to be from'), ([1.0, 2.0, 3.0], 'array of size')],
)
def test_impossible_shapes_are_named(robot, values, message):
    with pytest.raises(ModelError, match=message):
        make_effect('stribeck_friction', robot).with_shape(values)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('stiction', 'viscous_friction, coulomb_friction'),
        ('viscous_friction@elbo', 'its joints are shoulder_pitch'),
        ('payload@hand', 'payload@wrist_pitch'),
        ('coupled_joint_friction@elbow_pitch', 'pairs'),
        ('gravity_magnitude@elbow_pitch', 'whole arm'),
        ('torque_crosstalk@elbow_pitch+elbow_pitch', 'same joint'),
        ('joint_coupling@elbow_pitch+wrist_pitch+elbow_pitch+forearm_yaw', 'first joint of two'),
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


def test_shapes_are_parsed_with_the_values(robot):
    text = 'stribeck_friction@elbow_pitch:stribeck_torque=0.3,stribeck_velocity=0.02'
    effect, values = parse_effect(text, robot)
    assert effect.shape == (0.02, 2.0)
    np.testing.assert_array_equal(values, [0.3])
