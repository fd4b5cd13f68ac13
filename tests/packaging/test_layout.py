# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The installation has the files that `ros2 pkg`, `ros2 run` and `ros2 interface` read."""

import os
from pathlib import Path
import re
import stat
import subprocess
import sys
from xml.etree import ElementTree

from ament_index_python import get_package_prefix, get_package_share_directory, get_resource
import armid_ros
import pytest

from docsite.blocks import blocks

SCRIPTS = Path(__file__).parents[2] / 'scripts'
MAIN = re.compile(r'^(def )?main\b', re.MULTILINE)
NODES = {path.name for path in SCRIPTS.iterdir()} - {'armid'}


@pytest.fixture(autouse=True)
def index(prefix, monkeypatch):
    """Restrict the ament index to the environment."""
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))


def executables(prefix, package):
    """List executable regular files in lib/<package>, as `ros2 pkg executables` does."""
    paths = Path(prefix, 'lib', package).rglob('*')
    return {path.name for path in paths if path.is_file() and os.access(path, os.X_OK)}


@pytest.fixture
def console_scripts(distribution):
    """Return 'module:function' of each console script of the installed package, by name."""
    entries = distribution.entry_points
    return {entry.name: entry.value for entry in entries if entry.group == 'console_scripts'}


@pytest.mark.parametrize('package', ['armid_ros', 'armid_msgs'])
def test_index_finds_the_package_and_its_manifest(prefix, package):
    """Find prefix and manifest as `ros2 pkg prefix` and `ros2 pkg xml` do."""
    assert Path(get_package_prefix(package)) == prefix
    manifest = Path(get_package_share_directory(package), 'package.xml')
    assert ElementTree.parse(manifest).findtext('name') == package


def test_executables_are_the_scripts_and_the_console_scripts(prefix, root, console_scripts):
    """Pip and colcon install equal files to lib/armid_ros, from two lists."""
    scripts = {path.name for path in (root / 'scripts').iterdir()}
    assert scripts == executables(prefix, 'armid_ros') == set(console_scripts)
    assert 'armid' in scripts


def test_scripts_are_executable_in_the_source_tree(root):
    """Scripts are executable, and all scripts of nodes are equal."""
    for path in (root / 'scripts').iterdir():
        assert stat.S_IMODE(path.stat().st_mode) & 0o111 == 0o111, path
    assert len({(root / 'scripts' / name).read_bytes() for name in NODES}) == 1


def test_console_scripts_of_nodes_say_what_is_missing_of_ros(console_scripts):
    """A script runs the node of the same name."""
    expected = dict.fromkeys(NODES, 'armid_ros.cli.node:main')
    assert console_scripts == expected | {'armid': 'armid_ros.cli:main'}


def test_nodes_are_those_that_are_installed(root):
    """Every node has an executable, and every executable has a node."""
    files = (root / 'armid_ros').rglob('nodes/*.py')
    with_main = {path.stem for path in files if MAIN.search(path.read_text())}
    assert with_main == NODES


@pytest.mark.parametrize('name', ['armid', 'recorder'])  # those of nodes are equal
def test_script_runs_its_module_with_the_python_of_its_prefix(prefix, tmp_path, name):
    """A script runs without an active environment, and passes on arguments and exit code."""
    script = tmp_path / 'lib' / 'armid_ros' / name
    script.parent.mkdir(parents=True)
    script.write_bytes((prefix / 'lib' / 'armid_ros' / name).read_bytes())
    script.chmod(0o755)
    module = 'armid_ros.cli' if name == 'armid' else 'armid_ros.cli.node'
    python = tmp_path / 'bin' / 'python3'
    python.parent.mkdir()
    python.write_text(
        f'#!{sys.executable}\n'
        'import sys, types\n'
        "names = ('armid_ros', 'armid_ros.cli', 'armid_ros.cli.node')\n"
        'sys.modules.update({name: types.ModuleType(name) for name in names})\n'
        f"sys.modules['{module}'].main = lambda *name: print(*name, sys.argv[4:]) or 3\n"
        'exec(sys.argv[2])\n'
    )
    python.chmod(0o755)
    result = subprocess.run([script, 'x', 'a b'], capture_output=True, text=True)
    asked = '' if name == 'armid' else f'{name} '
    assert (result.returncode, result.stdout) == (3, f"{asked}['a b']\n")


def fields(path):
    """Return the lines of a message definition without comments."""
    return [line for line in path.read_text().splitlines() if line and line[0] != '#']


def test_interface_show_finds_the_definition(prefix, root):
    """Find ParameterEstimate as `ros2 interface show` does, by index and share folder."""
    listed, where = get_resource('rosidl_interfaces', 'armid_msgs')
    assert Path(where) == prefix
    assert 'msg/ParameterEstimate.msg' in listed.splitlines()
    share = Path(get_package_share_directory('armid_msgs'))
    name = 'msg/ParameterEstimate.msg'
    assert fields(share / name) == fields(root / 'msg_schemas' / name)


@pytest.mark.parametrize(
    'name',
    [
        'effects/test_contract.py',
        'simulation/test_against_mujoco.py',
        'hidden/test_independence.py',
        'recording/test_writer.py',
        'diagnosis/test_traps.py',
        'packaging/test_layers.py',
    ],
)
def test_proofs_that_every_change_has_to_pass_are_not_long(root, name):
    assert 'mark.long' not in (root / 'tests' / name).read_text()


def test_all_say_one_version(root, distribution):
    """Manifests, setup.py, package and changelog have one version."""
    manifests = (root / 'package.xml', root / 'msg_schemas' / 'package.xml')
    versions = {ElementTree.parse(path).findtext('version') for path in manifests}
    setup = (root / 'setup.py').read_text()
    changelog = (root / 'CHANGELOG.md').read_text()
    versions.add(re.search(r"version='([^']+)'", setup).group(1))
    versions.add(re.search(r'^## (\S+)', changelog, re.MULTILINE).group(1))
    versions.add(distribution.version)
    versions.add(armid_ros.__version__)
    assert versions == {armid_ros.__version__}


def test_manifest_names_what_the_code_imports(root):
    """package.xml lists every ROS 2 package that the nodes import."""
    manifest = ElementTree.parse(root / 'package.xml').getroot()
    declared = {element.text for element in manifest if element.tag.endswith('depend')}
    known = {'ament_index_python', 'launch', 'launch_ros', 'rclpy', 'rcl_interfaces', 'xacro'}
    pattern = re.compile(r'^\s*(?:from|import) (\w+)', re.MULTILINE)
    sources = [*(root / 'armid_ros').rglob('*.py'), *(root / 'launch').glob('*.py')]
    imported = {name for path in sources for name in pattern.findall(path.read_text())}
    used = {name for name in imported if name in known or name.endswith(('_msgs', '_srvs'))}
    assert used <= declared


def test_documents_start_nodes_by_executables_that_the_environment_has():
    """The environment has no command `ros2`; blocks of pages with `ros2` are marked as not run."""
    root = Path(__file__).parents[2]
    started = set()
    for path in (root / 'README.md', *sorted((root / 'docs').rglob('*.md'))):
        for block in blocks(path):
            programs = {line.split()[0] for line in block.text.splitlines() if line.strip()}
            if block.language == 'bash' and 'ros2' in programs:
                assert 'no command' in block.excuse, f'{path.name}:{block.line}'
            started |= programs & NODES
    assert {'excitation_publisher', 'online_identifier', 'recorder'} <= started
    for node in started:
        assert Path(sys.executable).with_name(node).is_file()
