# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Hidden effects are not made by the code that looks for them."""

import ast
import os
from pathlib import Path
import subprocess
import sys

HERE = Path(__file__).parent
ALLOWED = {'armid_ros.robots', 'armid_ros.recording', 'armid_ros.errors', 'armid_ros.motion'}
JUDGING = {'test_catalogue'}  # it compares with what looks
LOOKING = ('effects', 'arm', 'model', 'simulation', 'excitation', 'identification', 'diagnosis')


def imports(path):
    """Return the modules that a file imports anywhere."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, path
            yield node.module


def test_files_import_descriptions_and_arrays_only():
    for path in HERE.rglob('*.py'):
        if path.stem in JUDGING:
            continue
        ours = {name for name in imports(path) if name.split('.')[0] == 'armid_ros'}
        assert ours <= ALLOWED, f'{path.name} imports {ours - ALLOWED}'


def test_nothing_else_comes_along():
    """Not even what is imported imports a model, an effect or a simulator."""
    paths = [p.relative_to(HERE).with_suffix('') for p in HERE.rglob('*.py')]
    modules = ['.'.join(p.parts) for p in paths if not p.stem.startswith(('test_', '__'))]
    code = (
        f'import importlib, sys\n'
        f'for name in {modules!r}:\n'
        f"    importlib.import_module('tests.hidden.' + name)\n"
        f"print(*(m for m in sys.modules if m.startswith('armid_ros.')), sep='\\n')"
    )
    result = subprocess.run(
        [sys.executable, '-c', code],
        env={**os.environ, 'PYTHONPATH': str(HERE.parents[1])},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    loaded = {name.split('.')[1] for name in result.stdout.split()}
    assert 'robots' in loaded
    assert not loaded & set(LOOKING)
