# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is written is what the schemas say, and the schemas describe every key of it."""

import json
import shutil

import armid_ros as ar
from armid_ros.cli import main
from armid_ros.identification import PhysicalSettings
from click.testing import CliRunner
from jsonschema import Draft202012Validator
import pytest
import yaml

from docsite.schemas import faults, FOLDER, SUFFIX

NAMES = sorted(path.name.removesuffix(SUFFIX) for path in FOLDER.glob(f'*{SUFFIX}'))


def read(path):
    text = path.read_text()
    return yaml.safe_load(text) if path.suffix == '.yaml' else json.loads(text)


def check(name, document):
    assert faults(name, document) == []


@pytest.mark.parametrize('name', NAMES)
def test_a_schema_is_one_and_describes_what_it_names(name):
    schema = json.loads((FOLDER / f'{name}{SUFFIX}').read_text())
    Draft202012Validator.check_schema(schema)
    assert schema['title']
    assert schema['description'].endswith('.')
    assert schema['properties']['schema']['const'].startswith('armid/')


def armid(*arguments):
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_an_identification_and_its_model(at_desk):
    armid(
        *('identify', 'monday', '--validate', 'tuesday', '--robot', 'my_arm.urdf', '--physical'),
        *('--total-mass', '5', '--out', 'bodies'),
    )
    check('identification', read(at_desk / 'bodies' / 'identification.json'))
    check('model', read(at_desk / 'bodies' / 'model.yaml'))
    check('identification', read(at_desk / 'friday_result' / 'identification.json'))
    box = PhysicalSettings(boxes={'elbow': ((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))})
    check('identification', ar.identify('my_arm.urdf', 'monday', physical=box).document())


def test_a_check_of_a_description(at_desk):
    words = ['check', 'my_arm.urdf', 'friday', '--strict', '--out', 'checked']
    assert CliRunner().invoke(main, words).exit_code == 3
    check('check', read(at_desk / 'checked' / 'check.json'))
    check('check', json.loads(armid('check', 'my_arm.urdf', '--json')))


@pytest.mark.parametrize(
    'recordings',
    [('today_1', '--validate', 'today_2', '--baseline', 'monday'), ('friday',)],
    ids=['with a baseline', 'one recording alone'],
)
def test_a_diagnosis_and_its_model(recordings, at_desk):
    armid(
        *('diagnose', *recordings, '--robot', 'my_arm.urdf', '--everything'),
        *('--model', 'monday_result/model.yaml', '--out', 'found'),
    )
    check('diagnosis', read(at_desk / 'found' / 'diagnosis.json'))
    check('model', read(at_desk / 'found' / 'model.yaml'))


def test_a_comparison(at_desk):
    ar.identify('my_arm.urdf', 'today_1').save('today_result')
    shutil.copy('friday_result/model.yaml', 'alone.yaml')
    for after in ('friday_result', 'today_result', 'alone.yaml'):
        check('comparison', ar.compare('monday_result', after).document())


def test_a_trajectory_and_its_quality(at_desk):
    armid(
        *('excite', '--robot', 'my_arm.urdf', '--duration', '12', '--starts', '1'),
        *('--iterations', '2', '--out', 'short'),
    )
    check('excitation', read(at_desk / 'short' / 'excitation.yaml'))
    check('excitation_quality', read(at_desk / 'short' / 'excitation.json'))


def test_an_inspection(at_desk):
    check('inspection', json.loads(armid('inspect', 'monday', '--robot', 'my_arm.urdf', '--json')))
    check('inspection', json.loads(armid('inspect', 'monday', '--json')))


def test_a_key_that_no_schema_has_and_a_value_of_another_kind_are_faults(at_desk):
    document = ar.compare('monday_result', 'friday_result').document()
    assert faults('comparison', {**document, 'new': 1}) == ['$.new: is in no schema']
    (said,) = faults('comparison', {**document, 'only_after': 'none'})
    assert said.startswith('$.only_after')
