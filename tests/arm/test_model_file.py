# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""model.yaml: what goes in comes out, and what is wrong is named."""

from armid_ros.arm import ArmModel, load_misfit, load_model, Misfit, save_model
from armid_ros.arm.misfit import RowFilters
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.effects.gravity import GravityVector
from armid_ros.errors import ModelError
from armid_ros.estimate import Estimate
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.motion import Motion
import numpy as np
import pytest
import yaml

READERS = (load_model, load_misfit, read_parameters)
#: Effects, and what a diagnosis looks for between two days.
KINDS = list(
    dict.fromkeys(
        [*CATALOGUE.values(), *(k.as_change() for k in CATALOGUE.values()), GravityVector]
    )
)
#: Fault in a model file: old text, new text, and words of the error message.
FAULTS = {
    'a key of the model': ('rigid_parameters:', 'rigid_paramters:', 'rigid_paramters'),
    'a key that is missing': ('gravity:\n- 0.0\n- 0.0\n- -9.81\n', '', 'gravity'),
    'a key of a parameter': (
        'joint: shoulder_roll\n  value:',
        'joint: shoulder_roll\n  valu:',
        "'m2' .*'shoulder_roll'.* 'valu'.*value",
    ),
    'no number': (
        'joint: shoulder_roll\n  value: ',
        'joint: shoulder_roll\n  value: a',
        "'m2' .*'shoulder_roll'.* number",
    ),
    'a unit of a link': ('unit: kg\n', 'unit: g\n', "'m1' .*'shoulder_pitch'.*'g'.*'kg'"),
    'a unit of an effect': (
        'unit: N m s/rad',
        'unit: N m s/deg',
        "'viscous_coefficient' .*'shoulder_pitch'.*s/deg'.*s/rad'",
    ),
}


@pytest.fixture
def path(robot, tmp_path):
    """Return a model with friction of two laws, and a misfit of 0.1, 0.2, ... N m."""
    arm = ArmModel(robot)
    for name in ('stribeck_friction', 'viscous_friction'):
        arm = arm.with_effect(make_effect(name, robot), np.ones(6))
    rms = {joint: 0.1 * (k + 1) for k, joint in enumerate(robot.joints)}
    loud = dict.fromkeys(robot.joints, 2.0)
    misfit = Misfit('held-out', rms, 5.1, loud, filters=RowFilters(200.0, 12.5, 8))
    save_model(tmp_path / 'model.yaml', arm, robot.name, misfit=misfit)
    return tmp_path / 'model.yaml'


@pytest.fixture(scope='module')
def motion(robot):
    rng = np.random.default_rng(0)
    states = rng.normal(size=(3, 40, robot.n_joints))
    return Motion(robot.joints, np.linspace(0.0, 60.0, 40), *states, states[0])


@pytest.mark.parametrize('kind', KINDS, ids=lambda kind: kind.__name__)
def test_every_effect_and_change_comes_back_with_values_shape_and_torque(
    robot, motion, kind, tmp_path
):
    rng, path = np.random.default_rng(0), tmp_path / 'model.yaml'
    effect = kind.on(robot)
    if effect.shapes:
        effect = effect.with_shape(effect.shape_values * rng.uniform(0.9, 1.1))
    values = rng.uniform(0.01, 0.02, len(effect.parameters(robot)))
    arm = ArmModel(robot).with_effect(effect, values)
    save_model(path, arm, robot.name)
    assert load_misfit(path) is None
    back = load_model(path)
    if kind in CATALOGUE.values():
        assert back.effects == (effect,)
        np.testing.assert_array_equal(back.values[0], values)
        np.testing.assert_array_equal(back.robot.rigid_parameters, robot.rigid_parameters)
    np.testing.assert_allclose(back.torque(motion), arm.torque(motion), rtol=1e-9, atol=1e-9)


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
        (lambda d: d['misfit']['rms'].update(elbow_pitch=float('nan')), 'elbow_pitch'),
        (lambda d: d['misfit'].update(rms='much'), 'misfit'),
        (lambda d: d['misfit'].update(data='guessed'), 'guessed'),
        (lambda d: d['misfit'].update(torque_rms={'elbow_pitch': -1.0}), 'elbow_pitch'),
        (lambda d: d['misfit'].update(relative_error_percent=None), 'misfit'),
        (lambda d: d['misfit']['filters'].update(cutoff_hz=-5.0), 'cutoff_hz'),
    ],
)
def test_what_is_wrong_is_named(path, change, message):
    document = yaml.safe_load(path.read_text())
    change(document)
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(ModelError, match=message) as error:
        load_model(path)
        load_misfit(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize('read', READERS, ids=lambda read: read.__name__)
@pytest.mark.parametrize('fault', FAULTS)
def test_every_reader_refuses_what_is_misspelt(path, read, fault):
    right, wrong, said = FAULTS[fault]
    text = path.read_text()
    read(path)
    assert right in text
    path.write_text(text.replace(right, wrong, 1))
    with pytest.raises(ModelError, match=f'model.yaml: .*{said}'):
        read(path)


def test_the_line_is_that_of_the_key(path):
    lines = path.read_text().splitlines()
    number = lines.index('  joint: elbow_pitch')
    lines[number + 1] = lines[number + 1].replace('value', 'valu')
    path.write_text('\n'.join(lines))
    with pytest.raises(ModelError, match=f'line {number + 2}: '):
        load_model(path)


def test_a_unit_may_be_left_out_where_the_description_tells_it(path):
    whole = load_model(path)
    path.write_text(path.read_text().replace('  unit: kg\n', '', 1))
    np.testing.assert_array_equal(load_model(path).theta, whole.theta)
    with pytest.raises(ModelError, match=r"'m1' .*'shoulder_pitch'"):
        read_parameters(path)


def test_a_change_of_viscous_friction_is_added_to_what_joints_have(robot, motion, tmp_path):
    friction = make_effect('viscous_friction', robot)
    arm = ArmModel(robot).with_effect(friction, np.ones(robot.n_joints))
    change = CATALOGUE['thermal_friction'].as_change().on(robot)
    warm = arm.with_effect(change, np.tile([-0.3, 0.1], robot.n_joints))
    save_model(tmp_path / 'model.yaml', warm, robot.name)
    back = load_model(tmp_path / 'model.yaml')
    assert [effect.name for effect in back.effects] == ['viscous_friction', 'thermal_friction']
    np.testing.assert_allclose(back.torque(motion), warm.torque(motion), atol=1e-12)


def test_a_misfit_comes_back_and_grows_with_the_torque(robot, path):
    found = load_misfit(path)
    assert found.data == 'held-out'
    assert found.relative_error_percent == 5.1
    assert found.filters == (200.0, 12.5, 8)
    np.testing.assert_allclose(found.of(robot), 0.1 * np.arange(1, 7))
    torque = np.array([1.0, 2.0, 3.0, 4.0, 0.0, 8.0])
    factor = np.array([1.0, 1.0, 1.5, 2.0, 1.0, 4.0])
    np.testing.assert_allclose(found.of(robot, torque), factor * found.of(robot))
    assert yaml.safe_load(path.read_text())['misfit']['unit'] == 'N m'
    rms = {joint: value for joint, value in found.rms.items() if joint != 'elbow_pitch'}
    with pytest.raises(ModelError, match='elbow_pitch'):
        Misfit('training', rms, 5.0).of(robot)
