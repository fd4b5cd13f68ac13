# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each plug-in can be deleted with its folder; the core imports none of them."""

import os
import re
import shutil
import subprocess
import sys

import pytest

#: Folders of plug-ins with a command, and the name of the command.
WITH_COMMAND = {
    'fleet': 'fleet',
    'papers/elastic': 'elastic',
    'papers/exo': 'exo',
    'papers/lunar': 'lunar',
    'positions': 'positions',
    'view': 'view',
    'zero': 'zero',
}
#: Folders of plug-ins that commands of the core use, and one of these commands.
SERVING = {
    'residual': ('diagnose', 'bag', '--robot', 'ur10', '--out', 'found', '--residual', 'gp'),
    'recording/tables': ('convert', 'run.csv', '--dry-run'),
}
PLUG_INS = (*WITH_COMMAND, *SERVING)
#: Folders of Python code; the others are linked.
CODE = ('armid_ros', 'tests', 'benchmarks', 'docsite')
#: Program that lists the commands, and runs one.
ASK = """
import sys
from armid_ros.cli import main
main(['--help'], standalone_mode=False)
main(sys.argv[1:])
"""
#: Program that imports every module of the core.
IMPORT = """
from importlib import import_module
from pkgutil import walk_packages
import armid_ros
for module in walk_packages(armid_ros.__path__, 'armid_ros.'):
    if not module.name.endswith('.__main__'):
        import_module(module.name)
"""
#: Tests of the core that run without plug-ins: a regression, and commands.
FEW = ('cli/test_driven.py', 'identification/fitting/test_normal_equations.py')
#: Tests that need the whole tree, and tests of the core that only read tables.
OTHERS = (
    *('packaging', 'docsite', 'examples', 'golden'),
    *('cli/test_convert.py', 'cli/test_convert_real.py', 'fuzz/test_tables.py'),
    'recording/test_turns.py',
)
#: Other tests of the core that read a table.
OF_TABLES = (
    'api/test_front_door.py::test_a_recording_is_read_by_robot_or_by_names_from_bags_and_tables',
    'api/test_front_door.py::test_columns_without_names_are_read_by_number_from_zero',
    'cli/test_inspect.py::test_a_table_is_inspected_as_a_bag_is',
)


def code_of(folder):
    """List the files that may import a plug-in: tests, benchmarks and docsite."""
    return [path for name in CODE[1:] for path in (folder / name).rglob('*.py')]


def copied(root, folder):
    """Copy the tree without plug-ins and the files that import them; link other folders."""
    ignored = shutil.ignore_patterns('__pycache__')
    for name in CODE:
        shutil.copytree(root / name, folder / name, ignore=ignored)
    for path in root.iterdir():
        if path.name not in CODE and not path.name.startswith('.'):
            (folder / path.name).symlink_to(path)
    gone = []
    for plug_in in PLUG_INS:
        shutil.rmtree(folder / 'armid_ros' / plug_in)
        shutil.rmtree(folder / 'tests' / plug_in, ignore_errors=True)
        gone += [f'{place}.{plug_in.replace("/", ".")}' for place in ('armid_ros', 'tests')]
    texts = {path: path.read_text() for path in code_of(folder)}
    while gone:
        named = re.compile(rf'\b({"|".join(map(re.escape, gone))})\b')
        using = [path for path, text in texts.items() if named.search(text)]
        gone = ['.'.join(path.relative_to(folder).with_suffix('').parts) for path in using]
        for path in using:
            del texts[path]
            path.unlink()
    return folder


def python(folder, *arguments):
    """Run Python with the package of a copied tree."""
    environment = {**os.environ, 'PYTHONPATH': str(folder)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, cwd=folder, capture_output=True, text=True
    )


@pytest.mark.parametrize('plug_in', WITH_COMMAND)
def test_the_other_commands_stay(root, tmp_path, plug_in):
    command = WITH_COMMAND[plug_in]
    shutil.copytree(root / 'armid_ros', tmp_path / 'armid_ros')
    shutil.rmtree(tmp_path / 'armid_ros' / plug_in)
    done = python(tmp_path, '-c', ASK, command)
    assert done.returncode == 2, done.stderr
    assert f"'{command}'" in done.stderr
    listed = {line.split()[0] for line in done.stdout.splitlines() if line.startswith('  ')}
    assert {'identify', *WITH_COMMAND.values()} - {command} <= listed
    assert command not in listed


@pytest.mark.parametrize('plug_in', SERVING)
def test_a_command_names_the_package_that_it_needs(root, tmp_path, plug_in):
    shutil.copytree(root / 'armid_ros', tmp_path / 'armid_ros')
    shutil.rmtree(tmp_path / 'armid_ros' / plug_in)
    (tmp_path / 'run.csv').write_text('time,q1\n0.0,0.0\n')
    done = python(tmp_path, '-c', ASK, *SERVING[plug_in])
    assert done.returncode == 2, done.stderr
    assert f'needs armid_ros.{plug_in.replace("/", ".")}' in done.stderr


def test_the_core_imports_and_a_few_of_its_tests_pass_without_all_of_them(root, tmp_path):
    folder = copied(root, tmp_path)
    done = python(folder, '-c', IMPORT)
    assert done.returncode == 0, done.stderr
    done = python(folder, '-m', 'pytest', '-q', *(f'tests/{name}' for name in FEW))
    assert done.returncode == 0, done.stdout


@pytest.mark.long
def test_all_tests_of_the_core_pass_without_all_of_them(root, tmp_path):
    others = [f'--ignore=tests/{name}' for name in OTHERS]
    others += [f'--deselect=tests/{name}' for name in OF_TABLES]
    folder = copied(root, tmp_path)
    done = python(folder, '-m', 'pytest', '-q', '-m', 'not long', *others)
    assert done.returncode == 0, done.stdout
