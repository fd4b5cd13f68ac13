# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Launch files, parameter files and the reference name what nodes really have."""

from pathlib import Path
import re

from armid_ros.nodes.base import COMMON
from armid_ros.nodes.parameters.table import declare
import pytest
from rclpy.node import Node
from sensor_msgs.msg import JointState
import yaml

from docsite.nodes import NODES
from tests.ros.launching import declared, LAUNCH, launched

ROOT = Path(__file__).parents[2]
PAGE = ROOT / 'docs' / 'reference' / 'nodes.md'
EVERYWHERE = {'/rosout', '/parameter_events', '/diagnostics', '/clock'}
ANYTHING = ('bag_player', 'recorder')
COLUMNS = 4
TABLES = {
    name: {parameter.name: parameter for parameter in (*node.table, *COMMON)}
    for name, node in NODES.items()
}


@pytest.mark.parametrize('path', sorted((ROOT / 'config').glob('*.yaml')), ids=lambda p: p.name)
def test_parameter_files_hold_parameters_of_the_right_type(path):
    for node, content in yaml.safe_load(path.read_text()).items():
        table = TABLES[node.rpartition('/')[2]]
        for name, value in content['ros__parameters'].items():
            assert type(value) is type(table[name].default), name
            table[name].require(value)


def documented(name, column):
    """Return the full names in a cell of the table; what goes with elastic joints is left out."""
    found = re.findall(rf'^\| `{name}` \|.*$', PAGE.read_text(), re.MULTILINE)
    (row,) = [row for row in found if row.count('|') > COLUMNS]
    cell = row.split('|')[column].split(';')[0]
    names = re.findall(r'`([^`]+)`', cell)
    full = {re.sub('^~', f'/{name}', one) for one in names}
    return {one if one.startswith('/') else f'/{one}' for one in full} - EVERYWHERE


@pytest.mark.parametrize('name', [name for name in NODES if name not in ANYTHING])
def test_topics_and_services_are_those_of_the_table(name, bench):
    quick = {'design_time': 1.0, 'duration': 8.0, 'n_periods': 1, 'harmonics': 1}
    node = bench.add(NODES[name], **{k: v for k, v in quick.items() if k in TABLES[name]})
    who = (node.get_name(), node.get_namespace())

    def subscribed():
        heard = node.get_subscriber_names_and_types_by_node(*who)
        return {topic for topic, _ in heard if '/_action/' not in topic}

    said = documented(name, 2)
    for topic in said:
        if topic.endswith('joint_states'):  # subscribed to in the way of who publishes them
            bench.probe.create_publisher(JointState, topic, 10)
    bench.spin_until(lambda: said <= subscribed(), f'a subscription to {", ".join(said)}')
    published = {topic for topic, _ in node.get_publisher_names_and_types_by_node(*who)}
    services = {
        service
        for service, kinds in node.get_service_names_and_types_by_node(*who)
        if kinds == ['std_srvs/srv/Trigger']
    }
    assert subscribed() - EVERYWHERE == said
    assert published - EVERYWHERE == documented(name, 3)
    assert services == documented(name, 4)


SHIPPED = LAUNCH.parent / 'config' / 'real_robot.yaml'
#: Arguments that a launch file needs, and some that are given: text, node, and two values of the
#: parameter, that of the argument and one of a parameter file.
FILES = {
    'identify': (
        {'robot': 'a.urdf', 'effort_topic': 'currents'},
        {
            'duration': ('30', 'excitation_publisher', 30.0, 12.0),
            'runs': ('5', 'identification_run', 5, 3),
        },
    ),
    'replay': ({'bag': 'monday'}, {'rate': ('3', 'bag_player', 3.0, 2.0)}),
    'simulation': (
        {},
        {
            'rate': ('200', 'simulated_arm', 200.0, 250.0),
            'bag': ('1', 'recorder', '1', 'tuesday'),
        },
    ),
}


def read_back(bench, node, folder):
    """Return the parameters that a process with the arguments of launch has."""
    started = bench.add(Node, node_name='unnamed', cli_args=node.arguments(folder))
    declare(started, TABLES[node.executable].values())
    assert started.get_fully_qualified_name() == f'{node.namespace.rstrip("/")}/{node.name}'
    names = [*TABLES[node.executable], 'use_sim_time']
    return {name: started.get_parameter(name).value for name in names}


@pytest.mark.parametrize('pattern', ['/**/{}', '/left/{}'])
@pytest.mark.parametrize('name', FILES)
def test_an_argument_overrules_the_parameter_file_and_nothing_else_does(
    bench, tmp_path, name, pattern
):
    needed, arguments = FILES[name]
    clock = name != 'replay'
    content = {'/**': {'ros__parameters': {'executor': 'single'}}}
    for key, (_, executable, _, value) in arguments.items():
        parameters = {key: value, 'use_sim_time': clock}
        content[pattern.format(executable)] = {'ros__parameters': parameters}
    (tmp_path / 'own.yaml').write_text(yaml.safe_dump(content, sort_keys=False))
    options = {'namespace': 'left', 'params_file': str(tmp_path / 'own.yaml'), **needed}
    texts = {key: text for key, (text, _, _, _) in arguments.items()}
    by_file = launched(name, **options)
    by_argument = launched(name, **options, **texts, use_sim_time=str(not clock))
    for key, (_, executable, given, written) in arguments.items():
        for nodes, value, time in (by_file, written, clock), (by_argument, given, not clock):
            found = read_back(bench, nodes[executable], tmp_path)
            assert (found[key], found['use_sim_time']) == (value, time)


@pytest.mark.parametrize('name', FILES)
def test_without_a_parameter_file_nodes_get_parameters_they_have(bench, tmp_path, name):
    nodes = launched(name, **FILES[name][0])
    for executable, node in nodes.items():
        values = read_back(bench, node, tmp_path)
        given = {key for p in node.parameters if isinstance(p, dict) for key in p}
        given |= node.defaults.keys()
        assert {p for p in node.parameters if isinstance(p, str)} <= {str(SHIPPED)}
        assert given <= {*TABLES[executable], 'use_sim_time'}
        assert values['use_sim_time'] is (executable == 'online_identifier' and name == 'replay')
    assert all(one.description for one in declared(name))
    assert {'namespace', 'params_file', 'use_sim_time'} <= {one.name for one in declared(name)}


def test_a_replay_ends_with_the_bag_and_saves(bench, tmp_path):
    nodes = launched('replay', bag='monday')
    assert nodes['bag_player'].on_exit and not nodes['online_identifier'].on_exit
    assert read_back(bench, nodes['online_identifier'], tmp_path)['save_to']
    assert read_back(bench, nodes['bag_player'], tmp_path)['clock_rate'] > 0.0
    nodes = launched('replay', bag='monday', use_sim_time='true')
    assert read_back(bench, nodes['bag_player'], tmp_path)['clock_rate'] == 0.0


@pytest.mark.parametrize('text', ['fast', '1,5'])
def test_an_argument_of_another_type_is_refused_by_name(text):
    with pytest.raises(RuntimeError, match=f'rate:={text}'):
        launched('replay', bag='monday', rate=text)
