# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Runs on locked sets are recorded, and made with committed code only."""

import json
import subprocess

import pytest

from benchmarks.looks import clean_commit, LOG, look, results_of
from benchmarks.metrics import Metric
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
