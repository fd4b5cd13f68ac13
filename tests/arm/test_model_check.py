# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A model.yaml that is misspelt is refused with its line, whoever reads it."""

from armid_ros.arm import ArmModel, load_misfit, load_model, Misfit, save_model
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.robots import load_robot
import numpy as np
import pytest

READERS = (load_model, load_misfit, read_parameters)
#: What is written in place of what, and what is said then.
FAULTS = {
    'a key of the model': ('rigid_parameters:', 'rigid_paramters:', 'rigid_paramters'),
    'a key that is missing': ('gravity:\n- 0.0\n- 0.0\n- -9.81\n', '', 'gravity'),
    'a key of a parameter': (
        'joint: shoulder_roll\n  value:',
        'joint: shoulder_roll\n  valu:',
        "'m2' .*'shoulder_roll'.* 'valu' .*value",
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
def model(tmp_path):
    robot = load_robot('humanoid_arm')
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), np.ones(6))
    misfit = Misfit('held-out', dict.fromkeys(robot.joints, 0.1), 1.0)
    save_model(tmp_path / 'model.yaml', arm, robot.name, misfit=misfit)
    return tmp_path / 'model.yaml'


@pytest.mark.parametrize('read', READERS, ids=lambda read: read.__name__)
@pytest.mark.parametrize('fault', FAULTS)
def test_every_reader_refuses_what_is_misspelt(model, read, fault):
    right, wrong, said = FAULTS[fault]
    text = model.read_text()
    read(model)
    assert right in text
    model.write_text(text.replace(right, wrong, 1))
    with pytest.raises(ModelError, match=f'model.yaml: .*{said}'):
        read(model)


def test_the_line_is_that_of_the_key(model):
    lines = model.read_text().splitlines()
    number = lines.index('  joint: elbow_pitch')
    lines[number + 1] = lines[number + 1].replace('value', 'valu')
    model.write_text('\n'.join(lines))
    with pytest.raises(ModelError, match=f'line {number + 2}: '):
        load_model(model)


def test_a_unit_may_be_left_out_where_the_description_tells_it(model):
    whole = load_model(model)
    model.write_text(model.read_text().replace('  unit: kg\n', '', 1))
    np.testing.assert_array_equal(load_model(model).theta, whole.theta)
    with pytest.raises(ModelError, match=r"'m1' .*'shoulder_pitch'"):
        read_parameters(model)
