# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Runs on locked sets are recorded, of committed code only; rates and public cases follow."""

import json
import subprocess

import pytest

from benchmarks.looks import clean_commit, LOG, look, results_of
from benchmarks.metrics import Metric
from benchmarks.public import answer, cases, judged, make
from benchmarks.rates import PAGE, page, PUBLIC, PUBLIC_PAGE, public_page, RATES


@pytest.fixture
def log(tmp_path):
    """Return a log in a git tree with one commit."""

    def git(*words):
        subprocess.run(
            ['git', '-C', str(tmp_path), '-c', 'user.name=a', '-c', 'user.email=a@b', *words],
            check=True,
            capture_output=True,
        )

    git('init')
    (tmp_path / 'code.py').write_text('pass\n')
    git('add', '-A')
    git('commit', '-m', 'code')
    return tmp_path / 'looks.jsonl'


def entries(log):
    return [json.loads(line) for line in log.read_text().splitlines()]


def test_a_look_leaves_commit_date_and_results(log):
    commit = clean_commit(log)
    for value in (0.9, 0.8):
        with look('lived, locked, 96 cases', log) as entry:
            assert 'results' not in entries(log)[-1]  # it is there from the beginning
            entry['results'] = results_of([Metric('first', value, 0.7, 0.95, 20, '', None)])
    assert [one['commit'] for one in entries(log)] == [commit, commit]
    assert [one['results']['first']['value'] for one in entries(log)] == [0.9, 0.8]
    assert entries(log)[0]['results']['first']['interval'] == [0.7, 0.95]


def test_a_look_that_is_broken_off_is_recorded(log):
    with pytest.raises(KeyboardInterrupt), look('lived, locked', log):
        raise KeyboardInterrupt
    assert 'lived, locked' in log.read_text()


def test_code_that_is_in_no_commit_does_not_look(log):
    (log.parent / 'code.py').write_text('changed\n')
    with pytest.raises(SystemExit, match=r'code\.py'), look('lived, locked', log):
        raise AssertionError
    assert not log.exists()


def test_the_page_is_up_to_date_and_short():
    made = page(LOG.read_text(encoding='utf-8'), RATES.read_text(encoding='utf-8'))
    assert PAGE.read_text(encoding='utf-8') == made  # `python -m benchmarks.rates` writes it
    assert len(made.splitlines()) <= 80


def test_the_page_of_the_public_benchmark_is_up_to_date():
    made = public_page(PUBLIC.read_text(encoding='utf-8'))
    assert PUBLIC_PAGE.read_text(encoding='utf-8') == made


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
