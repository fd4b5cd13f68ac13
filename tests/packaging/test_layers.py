# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The layers of the package are kept, and a breach would be seen."""

from pathlib import Path
import re
import shutil
import subprocess
import sys
import tomllib

import pytest

LAYERS = (
    ('fleet', 'papers', 'view'),
    ('cli',),
    ('nodes',),
    ('live',),
    ('api',),
    ('residual',),
    ('report',),
    ('diagnosis', 'inspection'),
    ('identification',),
    ('recording', 'simulation', 'excitation'),
    ('arm',),
    ('effects',),
    ('model',),
    ('robots',),
    ('changes', 'estimate'),
    ('motion',),
    ('files',),
    ('plug_ins',),
    ('errors', 'version'),
)


def lint_imports(folder):
    """Run import-linter in a folder; return its exit code and what it says."""
    command = [Path(sys.prefix, 'bin', 'lint-imports'), '--no-cache']
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    return result.returncode, result.stdout + result.stderr


@pytest.fixture
def project(root, tmp_path):
    """Copy the package and its contracts to where they can be broken."""
    shutil.copy(root / 'pyproject.toml', tmp_path)
    ignore = shutil.ignore_patterns('__pycache__')
    shutil.copytree(root / 'armid_ros', tmp_path / 'armid_ros', ignore=ignore)
    return tmp_path


def test_contracts_are_kept(project):
    """No module imports from its own height or above, and only the nodes import ROS 2."""
    code, output = lint_imports(project)
    assert code == 0, output


def test_contract_lists_the_layers_in_order(root):
    """A layer in parentheses may be missing."""
    contracts = tomllib.loads((root / 'pyproject.toml').read_text())['tool']['importlinter']
    written = [layer.split(' | ') for layer in contracts['contracts'][0]['layers']]
    assert tuple(tuple(name.strip('()') for name in layer) for layer in written) == LAYERS


@pytest.mark.parametrize(
    'place, line, offence',
    [
        ('errors.py', 'import armid_ros.motion', 'armid_ros.errors is not allowed to import'),
        ('model/x.py', 'import armid_ros.arm', 'armid_ros.model is not allowed to import'),
        ('robots/x.py', 'import armid_ros.effects', 'armid_ros.robots is not allowed to import'),
        ('effects/x.py', 'from rclpy.node import Node', 'is not allowed to import rclpy'),
        ('model/x.py', 'import sensor_msgs.msg', 'is not allowed to import sensor_msgs'),
        ('novelty.py', 'import numpy', 'novelty'),
        (
            'cli/x.py',
            'import armid_ros.papers.exo.plant',
            'armid_ros.cli is not allowed to import',
        ),
        ('cli/x.py', 'import armid_ros.fleet.bags', 'armid_ros.cli is not allowed'),
        ('papers/lunar/x.py', 'import armid_ros.papers.exo', 'not allowed to import'),
        ('papers/exo/plant/x.py', 'import rclpy', 'is not allowed to import rclpy'),
    ],
)
def test_breach_is_seen(project, place, line, offence):
    """An import upwards, ROS 2 outside the nodes, and a module that has no layer."""
    with open(project / 'armid_ros' / place, 'a') as file:
        file.write(f'\n{line}\n')
    code, output = lint_imports(project)
    assert code != 0
    assert offence in re.sub(r'\s+', ' ', output)


def test_nodes_may_import_ros(project):
    """Nodes are the one place, and what imports them is not blamed for it."""
    nodes = project / 'armid_ros' / 'nodes'
    nodes.mkdir(exist_ok=True)
    (nodes / '__init__.py').touch()
    (nodes / 'novelty.py').write_text('import rclpy\nimport sensor_msgs.msg\n')
    with open(project / 'armid_ros' / 'cli.py', 'a') as file:
        file.write('\nimport armid_ros.nodes.novelty\n')
    code, output = lint_imports(project)
    assert code == 0, output
