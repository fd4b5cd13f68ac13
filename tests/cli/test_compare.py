# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
import json

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import make_effect
from armid_ros.estimate import Estimate
from armid_ros.identification.parameters_file import read_parameters
from armid_ros.model.base_parameters import symbol
from armid_ros.robots import load_robot
import numpy as np

from .conftest import armid

FRICTION = ('viscous_coefficient', 'elbow', 'N m s/rad')
JOINTS = ('shoulder', 'elbow')
INERTIA = ('Izz1 + Iyy2', 'shoulder', 'kg m^2')


def identified(folder, friction, robot='arm', errors=(4.0, 4.0), **others):
    """Write an identification with a given friction, and errors of shoulder and elbow [%]."""
    folder.mkdir()
    rows = [
        dict(zip(('name', 'joint', 'unit'), name, strict=True)) | {'value': value, 'std': std}
        for name, value, std in ((FRICTION, friction, 0.002), (INERTIA, 0.5, 0.01))
    ]
    document = {
        'schema': 'armid/identification/1',
        'robot': robot,
        'parameters': rows,
        'training': {
            'bags': [folder.name],
            'relative_error_percent': max(errors),
            'joint_relative_error_percent': dict(zip(JOINTS, errors, strict=True)),
            'rms': dict(zip(JOINTS, (0.01 * error for error in errors), strict=True)),
        },
        'validation': [],
    } | others
    (folder / 'identification.json').write_text(json.dumps(document))
    return folder


def test_a_change_is_said_in_words_and_on_a_page(tmp_path):
    first, second = (
        identified(tmp_path / name, friction, '/a/long path/arm.urdf')
        for name, friction in (('a', 0.08), ('b', 0.1))
    )
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    assert '1 of 2 parameters' in result.output
    for fact in ('elbow', '0.08', '0.1', '+25 %', '0.0200 ± 0.0055 N m s/rad (+25 %)'):
        assert fact in result.output
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert '+25 %' in page
    assert 'Izz1 + Iyy2' in page and '/a/long' not in page[: page.index('</h1>')]
    assert 'http' not in page.split('<main>')[1].split('<script>')[0]


def test_an_escape_sequence_in_a_name_does_not_reach_the_terminal(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), identified(tmp_path / 'b', 0.1)
    for folder in (first, second):
        path = folder / 'identification.json'
        path.write_text(path.read_text().replace('elbow', r'elb\u001b[2Jow'))
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    assert '\x1b' not in result.output and r'elb\x1b[2Jow' in result.output


def unusable(folder, friction):
    reasons = ['Halves of the data predict each other to 86.7 % in elbow, the most of all joints.']
    return identified(folder, friction, errors=(4.0, 86.0), grade='unusable', reasons=reasons)


def test_a_model_that_describes_no_arm_is_said_first_and_nothing_is_unchanged(tmp_path):
    first, second = identified(tmp_path / 'a', 0.08), unusable(tmp_path / 'b', 0.081)
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    said = result.output.splitlines()[0]
    assert said.startswith(f'UNUSABLE: {second / "identification.json"} is unusable')
    assert '86.7 % in elbow' in said and 'armid diagnose' in said
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert 'class="verdict bad"' in page and '>unusable<' in page
    assert 'unchanged' not in page
    document = json.loads((tmp_path / 'out' / 'comparison.json').read_text())
    (one,) = document['unusable']
    assert one['source'] == str(second / 'identification.json') and '86.7 %' in one['reason']


def test_a_model_that_describes_no_arm_is_code_3_where_that_is_asked_for(tmp_path):
    first, second, third = (
        identified(tmp_path / 'a', 0.08),
        unusable(tmp_path / 'b', 0.0805),
        identified(tmp_path / 'c', 0.081),
    )
    for pair, code in (((first, second), 3), ((second, first), 3), ((first, third), 0)):
        armid('compare', *pair, '--strict', '--out', tmp_path / 'out', code=code)


def test_what_a_model_leaves_is_a_change_where_no_parameter_is(tmp_path):
    first = identified(tmp_path / 'a', 0.08, errors=(4.0, 1.0))
    second = identified(tmp_path / 'b', 0.081, errors=(4.1, 30.0))
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    for fact in ('of 2 parameters', 'elbow: ', '30 times', '30 %', 'armid diagnose'):
        assert fact in result.output
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert 'class="verdict fair"' in page and '>changed<' in page
    document = json.loads((tmp_path / 'out' / 'comparison.json').read_text())
    assert {one['joint']: one['changed'] for one in document['residuals']} == {
        'shoulder': False,
        'elbow': True,
    }
    assert document['unusable'] == []


def test_what_is_not_compared_is_counted(tmp_path):
    first = identified(tmp_path / 'a', 0.08)
    lost = {'name': FRICTION[0], 'joint': FRICTION[1], 'unit': FRICTION[2]}
    second = identified(
        tmp_path / 'b',
        0.08,
        not_identified=[lost | {'reason': 'this motion does not show it'}],
    )
    file = second / 'identification.json'
    document = json.loads(file.read_text())
    document['parameters'] = [row | {'value': 0.501} for row in document['parameters'][1:]]
    document['parameters'].append(
        {'name': 'spring_stiffness', 'joint': 'elbow', 'unit': 'N m/rad', 'value': 1, 'std': 1}
    )
    file.write_text(json.dumps(document))
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    said = ' '.join(result.output.split())
    assert 'of 1 parameter ' in said and '2 more' in said
    assert '(spring stiffness of elbow)' in said
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert '>unchanged<' not in page and '2 more' in page
    found = json.loads((tmp_path / 'out' / 'comparison.json').read_text())
    assert found['not_compared'] == 2
    assert [one['why'] for one in found['only_before'] + found['only_after']] == [
        'motion',
        'effect',
    ]


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
    rows = [
        dict(zip(('name', 'joint', 'unit'), head, strict=True))
        | {'value': sum(f * values[key] for key, f in row.items()), 'std': 1e-3}
        for head, row in zip(heads, terms, strict=True)
    ]
    document = {
        'schema': 'armid/identification/1',
        'robot': robot.name,
        'gravity': [float(g) for g in robot.gravity],
        'parameters': rows,
        'covariance': [[0.0] * k + [1e-6] for k in range(len(rows))],
        'grouping': terms,
        'training': {'relative_error_percent': 1.0},
    }
    (folder / 'identification.json').write_text(json.dumps(document))
    return folder


def test_a_model_is_compared_by_the_identification_beside_it(tmp_path):
    first, second = modelled(tmp_path / 'a', 0.0), modelled(tmp_path / 'b', 0.4)
    files = [folder / 'model.yaml' for folder in (first, second)]
    result = armid('compare', *files, '--out', tmp_path / 'out')
    assert '1 of 7 parameters' in result.output
    assert read_parameters(files[0]).source == str(first / 'identification.json')


def test_parameters_without_a_deviation_are_counted_where_it_is_not_there(tmp_path):
    first, second = modelled(tmp_path / 'a', 0.0), modelled(tmp_path / 'b', 0.4)
    for folder in (first, second):
        (folder / 'identification.json').unlink()
    files = [folder / 'model.yaml' for folder in (first, second)]
    result = armid('compare', *files, '--out', tmp_path / 'out')
    said = ' '.join(result.output.split())
    assert 'of 6 parameters' in said and '60 more' in said
    assert f'{files[0]} and {files[1]}' in said
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert '60 parameters' in page and '>unchanged<' not in page
    document = json.loads((tmp_path / 'out' / 'comparison.json').read_text())
    assert document['not_compared'] == len(document['left_out']) == 60


def test_an_identification_of_another_model_is_left_alone(tmp_path):
    folder = modelled(tmp_path / 'a', 0.0)
    arm = load_model(folder / 'model.yaml')
    theta = arm.theta.copy()
    theta[-1] += 0.1
    save_model(folder / 'model.yaml', arm.with_theta(theta), 'humanoid_arm')
    assert read_parameters(folder / 'model.yaml').source == str(folder / 'model.yaml')


def test_models_of_other_effects_leave_other_residuals(tmp_path):
    first = identified(tmp_path / 'a', 0.08, errors=(4.0, 1.0))
    second = identified(tmp_path / 'b', 0.081, errors=(4.1, 30.0))
    file = second / 'identification.json'
    file.write_text(file.read_text().replace(FRICTION[0], 'spring_stiffness'))
    document = json.loads(file.read_text())
    document['parameters'][1]['value'] = 0.501
    file.write_text(json.dumps(document))
    result = armid('compare', first, second, '--out', tmp_path / 'out')
    assert '30 times' in result.output and 'different effects' in result.output
