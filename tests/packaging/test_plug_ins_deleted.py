# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fleet and each paper can be deleted by deleting its folder; the core does not know them."""

import os
import shutil
import subprocess
import sys

import pytest

#: Folders of plug-ins; each brings the command of its name.
PLUG_INS = ('fleet', 'papers/elastic', 'papers/exo', 'papers/lunar')
#: Imports every module of the core but for what needs a terminal, then lists the commands.
PROGRAM = """
from importlib import import_module
from pkgutil import walk_packages
import armid_ros
from armid_ros.cli import main

for module in walk_packages(armid_ros.__path__, 'armid_ros.'):
    if not module.name.startswith(('armid_ros.fleet', 'armid_ros.papers')):
        if not module.name.endswith('.__main__'):
            import_module(module.name)
main(['--help'])
"""
#: Tests of the core that use its rooms from recordings to a diagnosis.
FEW = (
    'arm/test_arm_model.py',
    'cli/test_completion.py',
    'cli/test_node.py',
    'diagnosis/test_fit.py',
    'identification/fitting/test_triangle.py',
)


@pytest.fixture(scope='module', params=PLUG_INS)
def without(request, root, tmp_path_factory):
    """Return a copy of the tree without a plug-in and the tests that import it, its command."""
    copy = tmp_path_factory.mktemp('copy')
    for name in ('pyproject.toml', 'setup.py', 'README.md'):
        shutil.copy(root / name, copy)
    ignored = shutil.ignore_patterns('__pycache__', 'data')
    for name in ('armid_ros', 'tests', 'benchmarks', 'docsite', 'requirements', 'scripts'):
        shutil.copytree(root / name, copy / name, ignore=ignored)
    shutil.rmtree(copy / 'armid_ros' / request.param)
    for path in (copy / 'tests').rglob('*.py'):
        if 'armid_ros.' + request.param.replace('/', '.') in path.read_text():
            path.unlink()
    return copy, request.param.rpartition('/')[2]


def python(folder, *arguments):
    """Run Python with the package of a folder."""
    environment = {**os.environ, 'PYTHONPATH': str(folder)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, cwd=folder, capture_output=True, text=True
    )


def test_the_core_imports_and_lists_the_other_commands(without):
    folder, command = without
    done = python(folder, '-c', PROGRAM)
    assert done.returncode == 0, done.stderr
    listed = {line.split()[0] for line in done.stdout.splitlines() if line.startswith('  ')}
    assert {'identify', 'fleet', 'elastic', 'exo', 'lunar'} - {command} <= listed
    assert command not in listed


def test_the_command_is_unknown(without):
    folder, command = without
    done = python(folder, '-m', 'armid_ros.cli', command)
    assert done.returncode == 2
    assert f"No such command '{command}'" in done.stderr


def test_a_few_tests_of_the_core_pass(without):
    folder, _ = without
    done = python(folder, '-m', 'pytest', '-q', *(f'tests/{name}' for name in FEW))
    assert done.returncode == 0, done.stdout


@pytest.mark.long
def test_all_tests_of_the_core_pass(without):
    folder, _ = without
    others = [f'--ignore=tests/{name}' for name in ('packaging', 'docsite', 'examples')]
    done = python(folder, '-m', 'pytest', '-q', '-m', 'not long', *others)
    assert done.returncode == 0, done.stdout
