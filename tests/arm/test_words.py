# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What only a search looks for is written in the words of the catalogue, and acts the same."""

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.effects.friction import friction_level
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


def test_friction_of_all_joints_is_added_to_what_they_have(robot, motion, tmp_path):
    arm = ArmModel(robot)
    for name in ('viscous_friction', 'coulomb_friction'):
        arm = arm.with_effect(make_effect(name, robot), np.ones(robot.n_joints))
    pairs = zip(arm.effects, arm.values, strict=True)
    kind, _ = friction_level(pairs, robot, list(CATALOGUE))
    warm = arm.with_effect(kind.on(robot), np.array([-0.3]))
    save_model(tmp_path / 'model.yaml', warm, robot.name)
    back = load_model(tmp_path / 'model.yaml')
    assert back.effects == arm.effects
    np.testing.assert_allclose(back.torque(motion), warm.torque(motion), atol=1e-12)
