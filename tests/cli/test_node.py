# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Executables run the node of their name, and say in one line what is missing."""

import os
import signal
import subprocess
import sys

from armid_ros.cli import node
import pytest


@pytest.fixture(autouse=True)
def signal_handlers():
    """Restore the handlers, as a node that ends leaves signals ignored, also by later children."""
    handlers = {
        one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    yield
    for one, handler in handlers.items():
        signal.signal(one, handler)


def test_an_executable_runs_the_node_of_its_name(monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', ['/somewhere/bin/recorder', '--ros-args', '-p', 'bag:=7'])
    with pytest.raises(SystemExit) as end:
        node.main()
    assert end.value.code == 2
    assert "'bag'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ('name', 'parameter'),
    [('recorder', 'topics'), ('excitation_publisher', 'state_timeout'), ('simulated_arm', 'rate')],
)
def test_help_has_the_parameters_and_starts_nothing(monkeypatch, capsys, name, parameter):
    monkeypatch.setattr(sys, 'argv', [f'/somewhere/bin/{name}', '--help'])
    monkeypatch.setattr('rclpy.init', lambda **_: pytest.fail('the node was started'))
    node.main()
    said = capsys.readouterr().out
    assert said.startswith(f'Usage: {name} ')
    assert f'\n  {parameter}:=' in said


def without(module, root, lines, folder):
    """Run lines of Python that cannot import a module."""
    code = f'import sys\nsys.modules[{module!r}] = None\n{lines}'
    environment = {**os.environ, 'PYTHONPATH': str(root)}
    command = [sys.executable, '-c', code]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)


@pytest.mark.parametrize(
    ('module', 'advice'), [('rclpy', 'armid_ros[ros]'), ('armid_msgs', 'colcon build')]
)
def test_what_is_missing_of_ros_is_said_in_a_line(pytestconfig, tmp_path, module, advice):
    lines = (
        "sys.argv = ['/somewhere/bin/online_identifier']\n"
        'from armid_ros.cli.node import main\nmain()'
    )
    done = without(module, pytestconfig.rootpath, lines, tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith('online_identifier: ')
    assert module in done.stderr and advice in done.stderr
    assert done.stderr.count('\n') == 1


def test_a_command_without_ros_says_so_in_a_line(pytestconfig, tmp_path):
    lines = "from armid_ros.cli import main\nmain(['demo', '--out', 'demo'])"
    done = without('rclpy', pytestconfig.rootpath, lines, tmp_path)
    assert done.returncode == 2
    assert 'ROS 2' in done.stderr
    assert done.stderr.count('\n') == 1


def test_another_missing_module_is_a_defect(monkeypatch):
    assert node.install_hint(ModuleNotFoundError(name='numpy')) is None
