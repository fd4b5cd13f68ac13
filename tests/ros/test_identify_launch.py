# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One launch file has an arm identified, and ends.

The package launch has no wheel; what the file uses of it stands in here, and takes the values
that launch would take.

"""

from __future__ import annotations

import json
import os
from pathlib import Path
import runpy
import subprocess
import sys
from types import ModuleType, SimpleNamespace

from armid_ros.excitation import save_excitation
import pytest
import yaml

from tests.ros.test_files import TABLES
from tests.ros.test_processes import short_excitation

FILE = Path(__file__).parents[2] / 'launch' / 'identify.launch.py'
CONFIG = FILE.parents[1] / 'config' / 'real_robot.yaml'


def stand_in():
    """Return modules that keep what they are called with."""

    def keep(*args, **named):
        return SimpleNamespace(args=args, **named)

    class LaunchConfiguration:
        """An argument by name, in a context that is a mapping."""

        def __init__(self, name):
            self._name = name

        def perform(self, context):
            return context[self._name]

    names = {
        'launch': {'LaunchDescription': list},
        'launch.actions': dict.fromkeys(
            ('DeclareLaunchArgument', 'OpaqueFunction', 'Shutdown'), keep
        ),
        'launch.substitutions': {'LaunchConfiguration': LaunchConfiguration},
        'launch_ros': {},
        'launch_ros.actions': {'Node': keep},
        'launch_ros.parameter_descriptions': {
            'ParameterValue': lambda value, value_type: value_type(value)
        },
    }
    modules = {}
    for name, content in names.items():
        modules[name] = ModuleType(name)
        vars(modules[name]).update(content)
    return modules


@pytest.fixture
def launched(monkeypatch):
    """Return what makes the nodes that a launch with arguments starts, by executable."""
    for name, module in stand_in().items():
        monkeypatch.setitem(sys.modules, name, module)
    (*declared, function) = runpy.run_path(str(FILE))['generate_launch_description']()

    def launch(**arguments):
        context = {one.args[0]: one.default_value for one in declared} | arguments
        assert context.keys() == {one.args[0] for one in declared}
        return {node.executable: node for node in function.function(context)}

    launch.declared = {one.args[0]: one for one in declared}
    return launch


def parameters(node):
    """Return what a node gets in the end."""
    found = {}
    for given in node.parameters:
        if isinstance(given, str):
            content = yaml.safe_load(Path(given).read_text())
            given = content.get(f'/**/{node.executable}', {}).get('ros__parameters', {})
        found |= given
    return found


@pytest.mark.parametrize(
    'arguments',
    [
        {},
        {'simulate': 'true'},
        {'effort_topic': 'dynamic_joint_states', 'joints': 'a, b', 'effects': 'joint_spring'},
    ],
    ids=['robot', 'simulated', 'torque elsewhere'],
)
def test_every_node_gets_parameters_that_it_has(launched, arguments):
    nodes = launched(robot='ur10.urdf', namespace='left', **arguments)
    for name, node in nodes.items():
        assert node.package == 'armid_ros'
        assert node.namespace == 'left'
        for key, value in parameters(node).items():
            if key == 'use_sim_time':
                continue
            assert type(value) is type(TABLES[name][key].default), (name, key)
            assert not TABLES[name][key].objection(value)


def test_every_argument_is_described_and_robot_alone_is_asked_for(launched):
    assert all(one.description for one in launched.declared.values())
    asked = [name for name, one in launched.declared.items() if one.default_value is None]
    assert asked == ['robot']
    before = {k: (v.parameters, v.remappings) for k, v in launched(robot='a').items()}
    for name, one in launched.declared.items():
        other = {'true': 'false', 'false': 'true'}.get(one.default_value, '7')
        nodes = launched(**{'robot': 'a', name: other})
        after = {k: (v.parameters, v.remappings) for k, v in nodes.items()}
        spaced = {node.namespace for node in nodes.values()} != {''}
        assert after != before or spaced, name


def test_the_arm_begins_when_the_node_asks_and_all_end_with_it(launched, tmp_path):
    nodes = launched(robot='arm.urdf', save_to=str(tmp_path), effects='a,b', controller='jtc')
    assert parameters(nodes['excitation_publisher'])['start'] is False
    assert parameters(nodes['recorder'])['record'] is False
    assert parameters(nodes['recorder'])['bag'] == str(tmp_path / 'run')
    run = parameters(nodes['identification_run'])
    assert (run['save_to'], run['effects'], run['robot']) == (
        str(tmp_path),
        ['a', 'b'],
        'arm.urdf',
    )
    assert hasattr(nodes['identification_run'], 'on_exit')
    assert nodes['excitation_publisher'].parameters[0] == str(CONFIG)
    remapped = dict(nodes['excitation_publisher'].remappings)
    assert remapped['joint_trajectory'] == 'jtc/joint_trajectory'


def test_torque_from_elsewhere_is_what_everybody_hears(launched):
    nodes = launched(robot='arm.urdf', effort_topic='currents', joint_states='arm/joint_states')
    merged = 'joint_state_merger/joint_states'
    assert merged in parameters(nodes['recorder'])['topics']
    for name in ('excitation_publisher', 'online_identifier'):
        assert dict(nodes[name].remappings)['joint_states'] == merged
    assert dict(nodes['joint_state_merger'].remappings)['joint_states'] == 'arm/joint_states'


def test_it_ends_by_itself_with_the_result_saved(bench, launched, tmp_path):
    """As `ros2 launch ... simulate:=true`, each node a process, but with an arm that is quick."""
    save_excitation(short_excitation(), tmp_path / 'run.yaml')
    nodes = launched(
        robot='humanoid_arm',
        namespace='left',
        simulate='true',
        file=str(tmp_path / 'run.yaml'),
        save_to=str(tmp_path / 'result'),
        runs='1',
        diagnose='false',
    )
    environment = {
        **os.environ,
        'ROS_DOMAIN_ID': str(bench.context.get_domain_id()),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'PYTHONPATH': os.pathsep.join(p for p in sys.path if p),
    }
    running = {}
    for name, node in nodes.items():
        file = tmp_path / f'{name}.yaml'
        content = {'/**': {'ros__parameters': parameters(node)}}
        file.write_text(yaml.safe_dump(content))
        command = [sys.executable, '-m', f'armid_ros.nodes.{name}', '--ros-args']
        command += ['--params-file', str(file), '-r', f'__ns:=/{node.namespace}']
        for pair in node.remappings:
            command += ['-r', ':='.join(pair)]
        with (tmp_path / f'{name}.log').open('w') as output:
            running[name] = subprocess.Popen(
                command, env=environment, stdout=output, stderr=subprocess.STDOUT
            )
    try:
        assert running.pop('identification_run').wait(300) == 0, (
            tmp_path / 'identification_run.log'
        ).read_text()
    finally:
        for process in running.values():
            process.terminate()
        codes = {name: process.wait(60) for name, process in running.items()}
    assert set(codes.values()) == {0}
    folder = tmp_path / 'result' / 'identification'
    result = json.loads((folder / 'identification.json').read_text())
    assert result['robot'] == 'humanoid_arm'
    assert (folder / 'report.html').is_file()
    assert (tmp_path / 'result' / 'live' / 'estimate.yaml').is_file()
    assert 'identify: ' in (tmp_path / 'identification_run.log').read_text()
