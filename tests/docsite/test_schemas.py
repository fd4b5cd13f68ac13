# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The schemas describe every key of documents that the golden results lack."""

import json

import armid_ros as ar
from armid_ros.identification import PhysicalSettings
from jsonschema import Draft202012Validator
import pytest

from docsite.schemas import faults, FOLDER, SUFFIX
from tests.cli.conftest import armid

NAMES = sorted(path.name.removesuffix(SUFFIX) for path in FOLDER.glob(f'*{SUFFIX}'))


def check(name, document):
    assert faults(name, document) == []


@pytest.mark.parametrize('name', NAMES)
def test_a_schema_is_one_and_describes_what_it_names(name):
    schema = json.loads((FOLDER / f'{name}{SUFFIX}').read_text())
    Draft202012Validator.check_schema(schema)
    assert schema['title']
    assert schema['description'].endswith('.')
    assert schema['properties']['schema']['const'].startswith('armid/')


def test_an_identification_among_boxes(at_desk):
    box = PhysicalSettings(boxes={'elbow': ((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))})
    check('identification', ar.identify('my_arm.urdf', 'monday', physical=box).document())


def test_a_check_of_a_description(at_desk):
    armid('check', 'my_arm.urdf', 'friday', '--strict', '--out', 'checked', code=3)
    check('check', json.loads((at_desk / 'checked' / 'check.json').read_text()))
    check('check', json.loads(armid('check', 'my_arm.urdf', '--json').stdout))


def test_a_diagnosis_with_everything(at_desk):
    armid(
        *('diagnose', 'friday', '--robot', 'my_arm.urdf', '--everything'),
        *('--model', 'monday_result/model.yaml', '--out', 'found'),
    )
    check('diagnosis', json.loads((at_desk / 'found' / 'diagnosis.json').read_text()))


def test_an_inspection(at_desk):
    for robot in (('--robot', 'my_arm.urdf'), ()):
        check('inspection', json.loads(armid('inspect', 'monday', *robot, '--json').stdout))


def test_a_key_that_no_schema_has_and_a_value_of_another_kind_are_faults(at_desk):
    document = ar.compare('monday_result', 'friday_result').document()
    (added,) = faults('comparison', {**document, 'new': 1})
    assert added.startswith('$.new: ')
    (wrong,) = faults('comparison', {**document, 'only_after': 'none'})
    assert wrong.startswith('$.only_after')
