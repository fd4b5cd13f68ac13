# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""model.yaml: what goes in comes out, and what is wrong is named."""

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.effects.gravity import GravityVector
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate
from armid_ros.motion import Motion
import numpy as np
import pytest
import yaml


@pytest.mark.parametrize('name', CATALOGUE)
def test_every_effect_comes_back_with_values_and_shape(robot, name, tmp_path):
    rng = np.random.default_rng(0)
    effect = make_effect(name, robot)
    if effect.shapes:
        effect = effect.with_shape(effect.shape_values * rng.uniform(0.9, 1.1))
    values = rng.uniform(0.0, 0.3, len(effect.parameters(robot)))
    save_model(tmp_path / 'model.yaml', ArmModel(robot).with_effect(effect, values), robot.name)
    arm = load_model(tmp_path / 'model.yaml')
    assert arm.effects == (effect,)
    np.testing.assert_array_equal(arm.values[0], values)
    np.testing.assert_array_equal(arm.robot.rigid_parameters, robot.rigid_parameters)


def test_joints_gravity_and_errors_come_back(robot, tmp_path):
    moon = robot.with_gravity([0.0, 0.0, -1.62])
    effect = make_effect('stribeck_friction@elbow_pitch', moon).with_shape([0.05, 1.5])
    arm = ArmModel(moon).with_effect(effect, [0.2])
    names = (*effect.parameters(moon), effect.shape_parameters(moon)[0])
    estimate = Estimate(names, np.array([0.2, 0.05]), np.diag([0.01, 0.02]) ** 2)
    save_model(tmp_path / 'model.yaml', arm, robot.name, estimate)
    back = load_model(tmp_path / 'model.yaml')
    assert back.effects == arm.effects
    np.testing.assert_array_equal(back.robot.gravity, [0.0, 0.0, -1.62])
    (entry,) = yaml.safe_load((tmp_path / 'model.yaml').read_text())['effects']
    assert entry['joints'] == ['elbow_pitch']
    assert entry['parameters'][0]['std'] == pytest.approx(0.01)
    velocity, exponent = entry['shapes']
    assert (velocity['name'], velocity['value']) == ('stribeck_velocity', 0.05)
    assert velocity['std'] == pytest.approx(0.02)
    assert (exponent['value'], exponent['std'], exponent['unit']) == (1.5, None, '')


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        (lambda d: d.update(schema='other'), 'armid/model/1'),
        (lambda d: d['effects'][0].update(name='stiction'), 'catalogue'),
        (lambda d: d['effects'][0].update(joints=['elbo']), "'elbo'"),
        (lambda d: d['effects'][0]['parameters'].pop(), "'stribeck_torque' .*'wrist_pitch'"),
        (lambda d: d['effects'][0]['shapes'].pop(), "'stribeck_exponent' .*'wrist_pitch'"),
        (lambda d: d['effects'][0]['shapes'][0].update(value=-1.0), 'stribeck_velocity'),
        (lambda d: d.update(gravity='earth'), "'gravity' .*'earth'"),
        (lambda d: d.update(gravity=[0, 0, 'down']), "'gravity' .*finite"),
        (lambda d: d.update(gravity=[0, 0, float('nan')]), "'gravity' .*finite"),
        (
            lambda d: d['effects'][0]['parameters'][0].update(value=float('nan')),
            "'stribeck_torque' .*'shoulder_pitch' .*finite",
        ),
        (lambda d: d['rigid_parameters'][3].update(value=float('inf')), 'finite'),
        (lambda d: d['effects'][0]['shapes'][0].update(value='nan'), 'finite'),
        (
            lambda d: d['rigid_parameters'].append(d['rigid_parameters'][0]),
            "'m1' .*'shoulder_pitch' .*twice",
        ),
    ],
)
def test_what_is_wrong_is_named(robot, tmp_path, change, message):
    path = tmp_path / 'model.yaml'
    arm = ArmModel(robot).with_effect(make_effect('stribeck_friction', robot), np.ones(6))
    save_model(path, arm, robot.name)
    document = yaml.safe_load(path.read_text())
    change(document)
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(ModelError, match=message) as error:
        load_model(path)
    assert str(path) in str(error.value)


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
