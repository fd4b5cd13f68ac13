# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Looks at locked sets are recorded, and made with committed code only."""

import subprocess

import pytest

from benchmarks.looks import clean_commit, look


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
    return tmp_path / 'looks.md'


def test_a_look_leaves_commit_date_and_table(log):
    commit = clean_commit(log)
    for table in ('first 0.9', 'first 0.8'):
        with look('lived, locked, 96 cases', log) as record:
            assert log.read_text().rstrip().endswith('UTC')  # it is there from the beginning
            record.table = table
    text = log.read_text()
    assert text.count(f'commit {commit}, clean, 20') == 2
    assert text.index('first 0.9') < text.index('first 0.8')
    assert text.startswith('# Looks')


def test_a_look_that_is_broken_off_is_recorded(log):
    with pytest.raises(KeyboardInterrupt), look('lived, locked', log):
        raise KeyboardInterrupt
    assert 'lived, locked' in log.read_text()


def test_code_that_is_in_no_commit_does_not_look(log):
    (log.parent / 'code.py').write_text('changed\n')
    with pytest.raises(SystemExit, match=r'code\.py'), look('lived, locked', log):
        raise AssertionError
    assert not log.exists()


def test_a_folder_that_is_no_git_tree_does_not_look(tmp_path):
    with pytest.raises(SystemExit, match='git tree'):
        clean_commit(tmp_path / 'looks.md')
