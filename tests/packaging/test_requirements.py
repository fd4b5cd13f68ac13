# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Lock files pin all requirements, and the check of a machine names missing programs."""

import importlib.util
from pathlib import Path
import re
import shutil
import subprocess
import sys
import sysconfig

import pytest

TESTS = ['test', 'convert', 'docs', 'fleet', 'residual', 'mujoco', 'view', 'run', 'ros']
LOCKS = {'build': ['build'], 'run': ['run', 'ros'], 'test': TESTS, 'bench': ['bench', *TESTS]}


def normal(name):
    """Return the normalised name of a project on PyPI."""
    return re.sub(r'[-_.]+', '-', name).lower()


def wanted(root, group):
    """Return the project names in requirements/<group>.in."""
    lines = (root / 'requirements' / f'{group}.in').read_text().splitlines()
    names = (re.match(r'[A-Za-z][\w.-]*', line) for line in lines)
    return {normal(name.group()) for name in names if name}


def pinned(root, lock):
    """Return the versions in requirements/<lock>.txt by name; check that each has a hash."""
    text = (root / 'requirements' / f'{lock}.txt').read_text()
    assert not re.search(r'://|--(extra-)?index-url|--find-links', text)  # users choose the index
    pins = {}
    for entry in re.findall(r'^[a-z].*(?:\n    .*)*', text, re.MULTILINE):
        name, version = re.match(r'([\w.-]+)(?:\[.*\])?==([^ ]+)', entry).groups()
        assert re.search(r'--hash=sha256:[0-9a-f]{64}\b', entry), name
        pins[normal(name)] = version
    return pins


@pytest.mark.parametrize('lock', LOCKS)
def test_lock_pins_all_that_is_asked_for(root, lock):
    """The lock files are those that `make lock` makes from the .in files."""
    asked = set().union(*(wanted(root, group) for group in LOCKS[lock]))
    assert asked <= set(pinned(root, lock))


@pytest.mark.parametrize('lock', LOCKS)
def test_locks_agree(root, lock):
    """Two lock files pin a common project to one version."""
    assert pinned(root, lock).items() <= pinned(root, 'bench').items()


def test_the_constraints_are_the_versions_of_the_tests(root):
    lines = (root / 'requirements' / 'constraints.txt').read_text().splitlines()
    pins = dict(line.split(' ')[0].split('==') for line in lines)
    assert {normal(name): version for name, version in pins.items()} == pinned(root, 'bench')


@pytest.mark.parametrize('group', ['run', 'convert', 'fleet', 'residual', 'view', 'mujoco'])
def test_requirements_of_users_have_a_lowest_and_a_highest_version(root, group):
    lines = (root / 'requirements' / f'{group}.in').read_text().splitlines()
    for line in filter(lambda line: not line.startswith('#'), lines):
        assert re.search(r'>=\d[\d.]*,<\d', line), line


@pytest.fixture
def host(root, monkeypatch, tmp_path):
    """Load the check of the machine in a folder without a virtual environment."""
    path = root / 'requirements' / 'check_host.py'
    spec = importlib.util.spec_from_file_location('check_host', path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.chdir(tmp_path)
    for variable in ('CC', 'CXX'):
        monkeypatch.delenv(variable, raising=False)
    return module


@pytest.mark.parametrize('version', [(2, 7, 18), (3, 10, 13), (3, 13, 0)])
def test_unsupported_python_is_named(host, monkeypatch, version):
    """The message has the supported Python versions, the present one, and how to choose."""
    monkeypatch.setattr(sys, 'version_info', version)
    message = host.missing()
    for fact in ('3.11', '3.12', '.'.join(map(str, version)), 'PYTHON='):
        assert fact in message


def test_what_debian_leaves_out_of_python_is_named(host, monkeypatch, tmp_path):
    assert host.missing() is None
    monkeypatch.setattr(sysconfig, 'get_path', lambda name: str(tmp_path))
    assert 'python3-dev' in host.missing()
    monkeypatch.setitem(sys.modules, 'ensurepip', None)
    assert 'python3-venv' in host.missing()


def test_missing_compiler_is_named(host, monkeypatch):
    """The compiler is on the path, or is named by CC and CXX."""
    monkeypatch.setattr(shutil, 'which', lambda name: None if '+' in name else name)
    assert 'clang++' in host.missing()
    monkeypatch.setenv('CXX', 'mine++ -O2')
    assert 'mine++' in host.missing()


def test_environment_of_another_python_is_not_mixed_with(host, tmp_path):
    """`make PYTHON=...` refuses an existing environment of another Python."""
    (tmp_path / '.venv').mkdir()
    (tmp_path / '.venv' / 'pyvenv.cfg').write_text('home = /usr/bin\nversion = 3.9.1\n')
    assert 'Python 3.9' in host.missing()


def test_the_linter_finds_nothing(root):
    command = [Path(sys.prefix, 'bin', 'hadolint'), root / 'Dockerfile']
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_what_it_names_in_the_tree_is_there(root):
    text = (root / 'Dockerfile').read_text()
    for path in re.findall(r'src/armid_ros/([\w./]+)', text):
        assert (root / path).exists(), path
    for script in (root / 'docker').iterdir():
        assert script.stat().st_mode & 0o111 == 0o111
        assert subprocess.run(['bash', '-n', script]).returncode == 0


def test_nothing_that_was_built_goes_into_the_image(root):
    """The container image leaves out the files that git ignores."""
    ignored = (root / '.dockerignore').read_text().split()
    assert {'.git', '.venv', 'build', 'install', 'log', 'dist'} <= set(ignored)
