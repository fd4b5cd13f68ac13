# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What only a search looks for is written in the words of the catalogue, and acts the same."""

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.effects.gravity import GravityVector
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np
import pytest


@pytest.fixture(scope='module')
def robot():
    return load_robot('humanoid_arm')


@pytest.fixture(scope='module')
def motion(robot):
    rng = np.random.default_rng(0)
    states = rng.normal(size=(3, 40, robot.n_joints))
    return Motion(robot.joints, np.linspace(0.0, 60.0, 40), *states, states[0])


@pytest.mark.parametrize('name', [*(n for n, k in CATALOGUE.items() if not k.learned), ''])
def test_a_model_with_what_is_looked_for_between_two_days_comes_back(
    robot, motion, name, tmp_path
):
    kind = CATALOGUE[name].as_change() if name else GravityVector
    effect = kind.on(robot)
    values = np.random.default_rng(1).uniform(0.01, 0.02, len(effect.parameters(robot)))
    arm = ArmModel(robot).with_effect(effect, values)
    save_model(tmp_path / 'model.yaml', arm, robot.name)
    back = load_model(tmp_path / 'model.yaml')
    np.testing.assert_allclose(back.torque(motion), arm.torque(motion), rtol=1e-9, atol=1e-9)


def test_a_change_of_viscous_friction_is_added_to_what_joints_have(robot, motion, tmp_path):
    friction = make_effect('viscous_friction', robot)
    arm = ArmModel(robot).with_effect(friction, np.ones(robot.n_joints))
    change = CATALOGUE['thermal_friction'].as_change().on(robot)
    warm = arm.with_effect(change, np.tile([-0.3, 0.1], robot.n_joints))
    save_model(tmp_path / 'model.yaml', warm, robot.name)
    back = load_model(tmp_path / 'model.yaml')
    assert [effect.name for effect in back.effects] == ['viscous_friction', 'thermal_friction']
    np.testing.assert_allclose(back.torque(motion), warm.torque(motion), atol=1e-12)
