# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""colcon finds, builds and installs the two ROS packages of the source tree."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

pytest.importorskip('colcon_core', reason='colcon is not installed: run make test')

pytestmark = pytest.mark.slow
LEFT_BEHIND = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'dist', 'demo', 'out', 'bags'
)


def run(command, folder):
    """Run a command in a sourced workspace; return its output."""
    measured = ('COVERAGE_', 'PYTHONPATH')  # coverage of colcon itself is slow and not needed
    env = {name: value for name, value in os.environ.items() if not name.startswith(measured)}
    env['PATH'] = os.pathsep.join([str(Path(sys.prefix, 'bin')), env['PATH']])
    env['AMENT_PREFIX_PATH'] = sys.prefix
    env['COLCON_HOME'] = str(folder / '.colcon')
    result = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope='module')
def workspace(root, tmp_path_factory):
    """Make the workspace of docs/howto/install.md: a clone, and a link into it."""
    folder = tmp_path_factory.mktemp('workspace')
    shutil.copytree(root, folder / 'src' / 'armid_ros', ignore=LEFT_BEHIND)
    (folder / 'src' / 'armid_msgs').symlink_to('armid_ros/msg_schemas')
    return folder


@pytest.fixture(
    scope='module',
    params=[(), pytest.param(('--symlink-install',), marks=pytest.mark.long)],
    ids=['copied', 'linked'],
)
def install(request, workspace, tmp_path_factory):
    """Build armid_ros without armid_msgs, whose messages the environment has."""
    folder = tmp_path_factory.mktemp('package')
    (folder / 'src').mkdir()
    (folder / 'src' / 'armid_ros').symlink_to(workspace / 'src' / 'armid_ros')
    run(['colcon', 'build', *request.param], folder)
    return folder / 'install'


def test_both_packages_are_found_messages_first(workspace):
    """Colcon finds the packages from the workspace, and from the clone itself without options."""
    listed = ['colcon', 'list', '--topological-order', '--names-only']
    assert run(listed, workspace).split() == ['armid_msgs', 'armid_ros']
    assert run(listed, workspace / 'src' / 'armid_ros').split() == ['armid_msgs', 'armid_ros']


def test_build_installs_what_ros2_looks_for(install, root, request):
    """The installation has marker, manifest, and exactly one executable per script."""
    share = install / 'armid_ros' / 'share'
    assert (share / 'ament_index' / 'resource_index' / 'packages' / 'armid_ros').is_file()
    assert (share / 'armid_ros' / 'package.xml').is_file()
    libexec = install / 'armid_ros' / 'lib' / 'armid_ros'
    executables = {path.name for path in libexec.iterdir() if os.access(path, os.X_OK)}
    assert executables == {path.name for path in (root / 'scripts').iterdir()}
    first = {(libexec / name).read_text().partition('\n')[0] for name in executables}
    if (
        'copied' in request.node.name
    ):  # the Python of the active environment, with the packages of pip
        assert first <= {'#!/usr/bin/env python3', '#!/bin/sh'}


@pytest.mark.long
def test_sourced_workspace_is_what_python_imports(workspace):
    """Package and compiled messages are imported from the workspace, not from the environment."""
    run(['colcon', 'build'], workspace)
    install = workspace / 'install'
    code = 'import armid_ros, armid_msgs.msg as m; print(armid_ros.__file__, m.__file__)'
    use = 'from rclpy.serialization import serialize_message as s; s(m.ParameterEstimate())'
    output = run(['sh', '-c', f'. install/setup.sh && python -c "{code}; {use}"'], workspace)
    for path in output.split():
        assert Path(path).is_relative_to(install)
