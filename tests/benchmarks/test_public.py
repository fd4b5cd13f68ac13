# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public benchmark writes cases that a stranger can read, and scores answers to them."""

import json

import pytest

from benchmarks.public import answer, cases, judged, make


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder of two cases."""
    path = tmp_path_factory.mktemp('public') / 'cases'
    make(path, seed=3, count=2)
    return path


def test_answers_are_scored_by_the_truth(folder):
    truth = {name: case.truth for name, case in cases(3, 2)}
    assert set(truth) == {path.name for path in folder.iterdir()}
    right = {
        name: {
            'verdict': 'named',
            'effects': [{'name': cause.name, 'joints': cause.joints} for cause in causes],
        }
        for name, causes in truth.items()
    }
    answers = folder.with_name('answers.json')
    answers.write_text(json.dumps(right))
    assert all(one.first for one in judged(3, 2, answers))
    answers.write_text('{}')
    assert all(one.answer.error for one in judged(3, 2, answers))


def test_a_case_has_no_trace_of_the_truth_and_can_be_answered(folder):
    case = folder / 'case_00'
    assert {path.name for path in case.iterdir()} == {
        'arm.urdf',
        'held_out_0',
        *(f'day_{day}_{k}' for day in (1, 2) for k in range(3)),
    }
    assert answer(case, 'parameters')['verdict'] in {'named', 'consistent'}
