# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each command answers what is stored, by its schema; `python -m tests.golden` writes it anew."""

import json

import pytest
import yaml

from docsite.schemas import faults
from tests.golden.cases import answer, CASES, LIVED, lived_answer, RESULTS
from tests.golden.facts import differences, facts
from tests.golden.inputs import lay_out


def stored(name):
    return json.loads((RESULTS / f'{name}.json').read_text(encoding='utf-8'))


def written(folder):
    """Yield the documents that have a schema, with its name."""
    for path in folder.rglob('*.*'):
        if path.suffix in ('.json', '.yaml'):
            text = path.read_text(encoding='utf-8')
            document = json.loads(text) if path.suffix == '.json' else yaml.safe_load(text)
            if 'schema' in document:
                name = document['schema'].split('/')[1]
                yield 'excitation_quality' if path.name == 'excitation.json' else name, document


@pytest.fixture(scope='module')
def inputs(tmp_path_factory):
    """Return the folder of all recordings."""
    folder = tmp_path_factory.mktemp('inputs')
    lay_out(folder)
    return folder


@pytest.mark.parametrize(
    'name',
    [
        pytest.param(
            name,
            marks=[
                *([pytest.mark.long] if case.long else []),
                *([pytest.mark.real_data] if case.real else []),
            ],
        )
        for name, case in CASES.items()
    ],
)
def test_a_command_answers_what_is_stored(name, inputs, tmp_path, request):
    if CASES[name].real:
        request.getfixturevalue('real_data')
    assert differences(stored(name), answer(name, inputs, tmp_path)) == []
    for schema, document in written(tmp_path):
        assert faults(schema, document) == []


@pytest.mark.long
@pytest.mark.parametrize(('kind', 'index'), LIVED)
def test_the_diagnosis_of_an_arm_that_has_lived_is_what_is_stored(kind, index):
    assert differences(stored('lived')[f'{kind}/{index}'], lived_answer(kind, index)) == []


def test_stored_results_are_small_and_each_has_its_case():
    files = list(RESULTS.glob('*.json'))
    assert {path.stem for path in files} == {*CASES, 'lived'}
    assert sum(path.stat().st_size for path in files) < 300_000


@pytest.mark.parametrize(
    ('new', 'differs'),
    [
        ({'value': 1.0019, 'std': 0.01}, []),
        ({'value': 1.03, 'std': 0.01}, ['/value']),
        ({'value': 1.0}, ['/std']),
        ({'value': 1.0, 'std': 0.01, 'joint': 'elbow'}, []),
        ({'value': 'large', 'std': 0.01}, ['/value']),
    ],
)
def test_numbers_agree_to_a_tolerance_and_facts_may_be_added(new, differs):
    found = differences({'value': 1.0, 'std': 0.01}, new)
    assert [line.partition(':')[0] for line in found] == differs


def test_sentences_times_and_curves_are_no_facts():
    document = {'verdict': 'named', 'text': 'x', 'why': 'The gap is gone.', 'curve': [2.0] * 50}
    assert facts(document) == {'verdict': 'named', 'curve': {'length': 50, 'rms': 2.0}}
