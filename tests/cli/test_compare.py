# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid compare prints, writes and refuses; the numbers are of identification/assess."""

import json

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import make_effect
from armid_ros.estimate import Estimate
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.model.base_parameters import symbol
from armid_ros.robots import load_robot
import numpy as np
import pytest

from .conftest import armid

FRICTION = ('viscous_coefficient', 'elbow', 'N m s/rad')
INERTIA = ('Izz1 + Iyy2', 'shoulder', 'kg m^2')
JOINTS = ('shoulder', 'elbow')


def rows_of(values):
    """Return rows of parameters; values of name, joint and unit to value and deviation."""
    return [
        dict(zip(('name', 'joint', 'unit'), name, strict=True)) | {'value': value, 'std': std}
        for name, (value, std) in values.items()
    ]


def write(folder, **document):
    """Write an identification of no commands, of independent parameters."""
    folder.mkdir(exist_ok=True)
    std = [row['std'] for row in document['parameters']]
    rows = [[0.0] * k + [one**2] for k, one in enumerate(std)]
    schema = {'schema': 'armid/identification/1', 'validation': [], 'covariance': rows}
    (folder / 'identification.json').write_text(json.dumps(schema | document))
    return folder


def identified(folder, friction, errors=(4.0, 4.0), inertia=0.5, **others):
    """Write an identification with a given friction, and errors of shoulder and elbow [%]."""
    document = {
        'robot': 'arm',
        'parameters': rows_of({FRICTION: (friction, 0.002), INERTIA: (inertia, 0.01)}),
        'training': {
            'bags': [folder.name],
            'relative_error_percent': max(errors),
            'joint_relative_error_percent': dict(zip(JOINTS, errors, strict=True)),
            'rms': dict(zip(JOINTS, (0.01 * error for error in errors), strict=True)),
        },
    }
    return write(folder, **(document | others))


def unusable(folder, friction):
    """Write an identification that describes no arm."""
    reasons = ['Halves of the data predict each other to 86.7 % in elbow.']
    return identified(folder, friction, errors=(4.0, 86.0), grade='unusable', reasons=reasons)


@pytest.fixture
def compared(tmp_path):
    """Return a function that compares two results: what it prints, its page and its document."""

    def compare(first, second, *more, code=0):
        out = tmp_path / 'out'
        text = armid('compare', first, second, *more, '--out', out, code=code).output
        page = (out / 'report.html').read_text()
        return ' '.join(text.split()), page, json.loads((out / 'comparison.json').read_text())

    return compare


def test_a_change_is_printed_with_its_interval_and_shown(tmp_path, compared):
    first, second = (
        identified(tmp_path / name, friction, robot='/a/long path/arm.urdf')
        for name, friction in (('a', 0.08), ('b', 0.1))
    )
    text, page, _ = compared(first, second)
    for fact in ('1 of 2', 'elbow', '0.0200 ± 0.0055', '+25 %'):
        assert fact in text
    assert '+25 %' in page and INERTIA[0] in page
    assert '/a/long' not in page[: page.index('</h1>')]
    assert 'http' not in page.split('<main>')[1].split('<script>')[0]


def test_a_model_that_describes_no_arm_is_said_first_and_nothing_is_unchanged(tmp_path, compared):
    text, page, document = compared(
        identified(tmp_path / 'a', 0.08), second := unusable(tmp_path / 'b', 0.081)
    )
    source = str(second / 'identification.json')
    assert text.startswith(f'UNUSABLE: {source}')
    assert 'elbow' in text and '86.7 %' in text
    assert '>unusable<' in page and 'unchanged' not in page
    assert [one['source'] for one in document['unusable']] == [source]


def test_a_model_that_describes_no_arm_ends_a_strict_run(tmp_path, compared):
    first, second = identified(tmp_path / 'a', 0.08), unusable(tmp_path / 'b', 0.0805)
    third = identified(tmp_path / 'c', 0.081)
    for pair, code in (((first, second), 3), ((second, first), 3), ((first, third), 0)):
        compared(*pair, '--strict', code=code)


def test_what_a_model_leaves_is_a_change_where_no_parameter_is(tmp_path, compared):
    text, page, document = compared(
        identified(tmp_path / 'a', 0.08, errors=(4.0, 1.0)),
        identified(tmp_path / 'b', 0.081, errors=(4.1, 30.0)),
    )
    for fact in ('elbow: ', '30 times', 'armid diagnose'):
        assert fact in text
    assert '>changed<' in page
    assert {one['joint']: one['changed'] for one in document['residuals']} == {
        'shoulder': False,
        'elbow': True,
    }


def modelled(folder, mass):
    """Write a model, and the identification beside it that tells sums of its parameters alone."""
    robot = load_robot('humanoid_arm')
    pi = robot.rigid_parameters.copy()
    pi[-10] += mass
    friction = make_effect('viscous_friction', robot)
    arm = ArmModel(robot).with_theta(pi).with_effect(friction, np.full(6, 0.1 + 1e-4 * mass))
    folder.mkdir()
    own = friction.parameters(robot)
    estimate = Estimate(own, arm.values[0], np.diag(np.full(6, 1e-6)))
    save_model(folder / 'model.yaml', arm, robot.name, estimate)
    values = {symbol(n): float(v) for n, v in zip(arm.parameters, arm.theta, strict=True)}
    terms = [{symbol(name): 1.0} for name in own] + [{'m6': 1.0, 'm5': 0.5}]
    heads = [(name.name, name.joint, name.unit) for name in own] + [('m6 + 0.5 m5', 'wrist', 'kg')]
    sums = [sum(f * values[key] for key, f in row.items()) for row in terms]
    return write(
        folder,
        robot=robot.name,
        gravity=[float(g) for g in robot.gravity],
        parameters=rows_of({head: (one, 1e-3) for head, one in zip(heads, sums, strict=True)}),
        grouping=terms,
        training={'relative_error_percent': 1.0},
    )


def test_a_model_is_compared_by_the_identification_beside_it(tmp_path, compared):
    folders = modelled(tmp_path / 'a', 0.0), modelled(tmp_path / 'b', 0.4)
    files = [folder / 'model.yaml' for folder in folders]
    assert 'of 7' in compared(*files)[0]
    assert read_parameters(files[0]).source == str(folders[0] / 'identification.json')
    for folder in folders:
        (folder / 'identification.json').unlink()
    text = armid('compare', *files, '--out', tmp_path / 'none', code=2).output
    assert 'no covariance' in text


def test_an_identification_of_another_model_is_left_alone(tmp_path):
    file = modelled(tmp_path / 'a', 0.0) / 'model.yaml'
    arm = load_model(file)
    theta = arm.theta.copy()
    theta[-1] += 0.1
    save_model(file, arm.with_theta(theta), 'humanoid_arm')
    assert read_parameters(file).source == str(file)
