# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arm as a whole: its parameters, what it needs of a motion, what it can tell apart."""

import pickle

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics, random_motion
from armid_ros.robots import load_robot
import numpy as np
import pytest


@pytest.fixture(scope='module')
def motion(robot):
    return random_motion(robot, np.random.default_rng(0), 40)


def arm_with(robot, **values):
    arm = ArmModel(robot)
    for name, value in values.items():
        effect = make_effect(name, robot)
        arm = arm.with_effect(effect, np.resize(value, len(effect.parameters(robot))))
    return arm


def test_parameters_times_columns_is_torque_where_all_is_linear(robot, motion):
    arm = arm_with(robot, viscous_friction=0.2, stribeck_friction=0.1, torque_ripple=[0.1, 0.2])
    np.testing.assert_allclose(arm.columns(motion) @ arm.theta, arm.torque(motion), atol=1e-10)


def test_the_number_of_values_is_checked(robot):
    with pytest.raises(ModelError, match='viscous_friction'):
        ArmModel(robot).with_effect(make_effect('viscous_friction', robot), [1.0])


def test_the_body_carries_what_the_effects_add_under_the_gravity_that_is_there(robot, motion):
    moon = load_robot('humanoid_arm_loaded', gravity='moon')
    body = moon.rigid_parameters[50:] - robot.rigid_parameters[50:]
    for order in (1, -1):
        names = dict(list({'payload': body, 'gravity_magnitude': 1.62 - 9.81}.items())[::order])
        arm = arm_with(robot, **names)
        tau = inverse_dynamics(moon, motion)
        np.testing.assert_allclose(arm.load(motion), tau, atol=1e-12)
        np.testing.assert_allclose(arm.torque(motion), tau, atol=1e-12)


def test_weight_alone_is_felt_where_that_is_asked_for(robot, motion):
    slow = ArmModel(robot, quasi_static=True)
    np.testing.assert_allclose(slow.torque(motion), inverse_dynamics(robot, motion.at_rest()))
    np.testing.assert_allclose(slow.columns(motion) @ slow.theta, slow.torque(motion), atol=1e-10)


@pytest.mark.parametrize(
    ('name', 'known', 'more'),
    [('torque_gain', (), 5), ('asymmetric_friction', ('torque_offset',), 6), ('payload', (), 0)],
)
def test_base_parameters_that_an_effect_adds(robot, name, known, more):
    """A gain of all joints is a mass, asymmetric Coulomb friction an offset while all moves."""
    arm = arm_with(robot, **dict.fromkeys(known, 0.0))
    wider = arm.with_effect(make_effect(name, robot))
    ranks = [one.base_parameters(np.random.default_rng(1)).rank for one in (arm, wider)]
    assert ranks[1] == ranks[0] + more


@pytest.mark.parametrize(
    ('values', 'neighbours'),
    [
        ({'viscous_friction': 0.2}, 0),
        ({'torque_lag': 0.0, 'joint_elasticity': 0.0}, 0),
        ({'time_delay': 0.01}, 10),
        ({'torque_lag': 0.01}, 200),
        ({'joint_elasticity': 1e-4}, 1),
    ],
)
def test_an_arm_says_how_many_samples_around_one_it_needs(robot, values, neighbours):
    needed = arm_with(robot, **values).neighbours(1e-3)
    assert neighbours <= needed <= neighbours + 10
    assert (needed == 0) == (neighbours == 0)


def test_an_arm_goes_to_other_processes_after_use(robot):
    """What it derives and keeps, functions among it, stays behind."""
    arm = ArmModel(robot).with_effect(make_effect('torque_offset', robot), np.full(6, 0.1))
    motion = random_motion(robot, np.random.default_rng(0), 5)
    tau = arm.torque(motion)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(arm)).torque(motion), tau)
