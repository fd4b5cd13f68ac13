# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One launch file has an arm identified, and ends."""

import json
import os
from pathlib import Path
import subprocess
import sys
import time

from armid_ros.excitation import save_excitation
from armid_ros.nodes.lockstep import EPOCH_NS
from armid_ros.nodes.qos import STREAM
from armid_ros.recording import topics
import pytest
from sensor_msgs.msg import JointState
import yaml

from tests.ros.controller import seconds_of
from tests.ros.launching import declared, LAUNCH, launched
from tests.ros.test_processes import short_excitation

#: Of /clock, in lock step [ns].
STEP_NS = 10**7
CONFIG = LAUNCH.parent / 'config' / 'real_robot.yaml'


def identify(**arguments):
    return launched('identify', **arguments)


def parameters(node):
    """Return what a node gets in the end."""
    found = dict(node.defaults)
    for given in node.parameters:
        if isinstance(given, str):
            content = yaml.safe_load(Path(given).read_text())
            patterns = [content.get(name, {}) for name in ('/**', f'/**/{node.executable}')]
            given = {k: v for own in patterns for k, v in own.get('ros__parameters', {}).items()}
        found |= given
    return found


def test_every_argument_has_an_effect_and_the_robot_has_to_be_known():
    with pytest.raises(RuntimeError, match='robot'):
        identify()
    before = {k: (parameters(v), v.remappings) for k, v in identify(robot='a').items()}
    for one in declared('identify'):
        other = {'diagnose': 'false', 'rehearse': 'true', 'simulate': 'true'}.get(one.name, '7')
        if one.name in ('namespace', 'params_file', 'use_sim_time'):
            continue
        nodes = identify(**{'robot': 'a', one.name: other})
        after = {k: (parameters(v), v.remappings) for k, v in nodes.items()}
        assert after != before, one.name


def test_a_parameter_file_without_robot_moves_no_default_robot(tmp_path):
    (tmp_path / 'own.yaml').write_text('{}')
    nodes = identify(params_file=str(tmp_path / 'own.yaml'))
    for name in ('excitation_publisher', 'identification_run'):
        assert parameters(nodes[name])['robot'] == ''


def test_the_arm_begins_when_the_node_asks_and_all_end_with_it(tmp_path):
    nodes = identify(robot='arm.urdf', save_to=str(tmp_path), effects='a,b', controller='jtc')
    assert parameters(nodes['excitation_publisher'])['start'] is False
    assert parameters(nodes['recorder'])['record'] is False
    assert parameters(nodes['recorder'])['bag'] == str(tmp_path / 'run')
    run = parameters(nodes['identification_run'])
    assert (run['save_to'], run['effects'], run['robot']) == (
        str(tmp_path),
        ['a', 'b'],
        'arm.urdf',
    )
    assert nodes['identification_run'].on_exit
    assert nodes['excitation_publisher'].parameters[0] == str(CONFIG)
    remapped = dict(nodes['excitation_publisher'].remappings)
    assert remapped['joint_trajectory'] == 'jtc/joint_trajectory'


def test_torque_from_elsewhere_is_what_everybody_hears():
    nodes = identify(robot='arm.urdf', effort_topic='currents', joint_states='arm/joint_states')
    merged = 'joint_state_merger/joint_states'
    assert merged in parameters(nodes['recorder'])['topics']
    for name in ('excitation_publisher', 'online_identifier'):
        assert dict(nodes[name].remappings)['joint_states'] == merged
    assert dict(nodes['joint_state_merger'].remappings)['joint_states'] == 'arm/joint_states'


def step_together(bench, arms, done):
    """Let /clock go on when all arms have published what it was, and no faster than time."""
    states = [bench.listen(JointState, f'/{arm}/joint_states', STREAM) for arm in arms]
    begun, now = time.monotonic_ns(), EPOCH_NS

    def stepped():
        behind = [
            one for one in states if one and seconds_of(one[-1].header.stamp) < 1e-9 * now - 1e-6
        ]
        return done() or (not behind and time.monotonic_ns() - begun >= now - EPOCH_NS)

    while not done():
        bench.tick(now)
        bench.spin_until(stepped, f'the states of all arms at {now}')
        now += STEP_NS


@pytest.mark.long
@pytest.mark.parametrize('lock_step', [False, True])
def test_two_arms_at_a_time_are_identified_and_diagnosed_to_the_end(bench, tmp_path, lock_step):
    """As two `ros2 launch ... simulate:=true`, each node a process, with arms that are quick."""
    save_excitation(short_excitation(), tmp_path / 'run.yaml')
    environment = {
        **os.environ,
        'ROS_DOMAIN_ID': str(bench.context.get_domain_id()),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'PYTHONPATH': os.pathsep.join(p for p in sys.path if p),
    }
    running = {}
    for arm in ('left', 'right'):
        folder = tmp_path / arm
        folder.mkdir()
        nodes = identify(
            robot='humanoid_arm',
            namespace=arm,
            simulate='true',
            file=str(tmp_path / 'run.yaml'),
            save_to=str(folder / 'result'),
            runs='1',
            use_sim_time=str(lock_step),
        )
        for name, node in nodes.items():
            code = f'from armid_ros.cli.node import main; main({name!r})'
            command = [sys.executable, '-c', code, *node.arguments(folder)]
            with (folder / f'{name}.log').open('w') as output:
                running[arm, name] = subprocess.Popen(
                    command, env=environment, stdout=output, stderr=subprocess.STDOUT
                )
    try:
        if lock_step:
            runs = [running[arm, 'identification_run'] for arm in ('left', 'right')]
            step_together(
                bench, ('left', 'right'), lambda: all(p.poll() is not None for p in runs)
            )
        for arm in ('left', 'right'):
            log = tmp_path / arm / 'identification_run.log'
            assert running.pop((arm, 'identification_run')).wait(300) == 0, log.read_text()
    finally:
        for process in running.values():
            process.terminate()
        codes = {process.wait(60) for process in running.values()}
    assert codes == {0}
    for arm in ('left', 'right'):
        folder = tmp_path / arm / 'result'
        result = json.loads((folder / 'identification' / 'identification.json').read_text())
        assert result['robot'] == 'humanoid_arm'
        assert (folder / 'identification' / 'report.html').is_file()
        diagnosis = json.loads((folder / 'diagnosis' / 'diagnosis.json').read_text())
        assert diagnosis['verdict']
        assert (folder / 'live' / 'estimate.yaml').is_file()
        names = {topic.name for topic in topics(folder / 'run')}
        assert names and all(name.startswith(f'/{arm}/') for name in names)
