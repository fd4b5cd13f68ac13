# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The package keeps its layers, and import-linter reports a violation."""

from pathlib import Path
import re
import shutil
import subprocess
import sys
import tomllib

import grimp
import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

LAYERS = (
    ('fleet', 'papers', 'positions', 'view', 'zero'),
    ('cli',),
    ('nodes',),
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
    """Run import-linter in a folder; return its exit code and output."""
    command = [Path(sys.prefix, 'bin', 'lint-imports'), '--no-cache']
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    return result.returncode, result.stdout + result.stderr


@pytest.fixture
def project(root, tmp_path):
    """Copy the package and its contracts to a folder in which tests break them."""
    shutil.copy(root / 'pyproject.toml', tmp_path)
    ignore = shutil.ignore_patterns('__pycache__')
    shutil.copytree(root / 'armid_ros', tmp_path / 'armid_ros', ignore=ignore)
    return tmp_path


def test_contracts_are_kept(project):
    """Modules import from lower layers only, and only nodes import ROS 2."""
    code, output = lint_imports(project)
    assert code == 0, output


def test_contract_lists_the_layers_in_order(root):
    """An optional layer, in parentheses, may be missing."""
    contracts = tomllib.loads((root / 'pyproject.toml').read_text())['tool']['importlinter']
    written = [layer.split(' | ') for layer in contracts['contracts'][0]['layers']]
    assert tuple(tuple(name.strip('()') for name in layer) for layer in written) == LAYERS


#: Imports upwards, of one paper by another, and of ROS 2 outside the nodes and in `nodes.live`.
BREACHES = (
    ('errors', 'armid_ros.motion'),
    ('model.x', 'armid_ros.arm'),
    ('robots.x', 'armid_ros.effects'),
    ('effects.x', 'rclpy'),
    ('model.y', 'sensor_msgs'),
    ('cli.x', 'armid_ros.papers.exo.plant'),
    ('cli.y', 'armid_ros.fleet.bags'),
    ('papers.lunar.x', 'armid_ros.papers.exo'),
    ('papers.exo.plant.x', 'rclpy'),
    ('nodes.live.x', 'rclpy'),
)


def test_every_breach_is_seen(project):
    for module, imported in BREACHES:
        with open(project / 'armid_ros' / f'{module.replace(".", "/")}.py', 'a') as file:
            file.write(f'\nimport {imported}\n')
    code, output = lint_imports(project)
    assert code != 0
    seen = set(re.findall(r'armid_ros\.(\S+) -> (\S+)', output))
    assert set(BREACHES) <= seen


def test_a_module_without_a_layer_is_seen(project):
    (project / 'armid_ros' / 'novelty.py').write_text('import numpy\n')
    code, output = lint_imports(project)
    assert code != 0
    assert 'novelty' in output


def test_nodes_may_import_ros(project):
    """Only nodes may import ROS 2; modules that import nodes are no violation."""
    (project / 'armid_ros' / 'nodes' / 'novelty.py').write_text('import rclpy\n')
    (project / 'armid_ros' / 'cli' / 'x.py').write_text('import armid_ros.nodes.novelty\n')
    code, output = lint_imports(project)
    assert code == 0, output


def circles(package):
    """Return the sets of modules that import each other, type-checking imports included."""
    graph = grimp.build_graph(package)
    modules = sorted(graph.modules)
    place = {module: k for k, module in enumerate(modules)}
    pairs = [
        (place[module], place[other])
        for module in modules
        for other in graph.find_modules_directly_imported_by(module)
    ]
    rows, columns = np.array(pairs).T
    matrix = coo_matrix((np.ones(len(pairs)), (rows, columns)), shape=(len(modules),) * 2)
    _, label = connected_components(matrix, directed=True, connection='strong')
    found = [{m for m, own in zip(modules, label, strict=True) if own == k} for k in set(label)]
    return [sorted(circle) for circle in found if len(circle) > 1]


def test_no_module_needs_itself():
    assert circles('armid_ros') == []
