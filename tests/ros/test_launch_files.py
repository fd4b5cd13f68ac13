# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Launch files: what an argument says overrules the parameter file, and nothing else does."""

from __future__ import annotations

import sys

from armid_ros.nodes.parameters.table import declare
import pytest
from rclpy.node import Node
import yaml

from tests.ros.launching import declared, launched, modules
from tests.ros.test_files import TABLES

#: Arguments that a launch file needs, and some that are given, by the parameters they become.
FILES = {
    'identify': (
        {'robot': 'a.urdf', 'effort_topic': 'currents'},
        {'duration': ('30', 'excitation_publisher', 30.0), 'runs': ('5', 'identification_run', 5)},
    ),
    'replay': ({'bag': 'monday'}, {'rate': ('3', 'bag_player', 3.0)}),
    'simulation': ({}, {'rate': ('200', 'simulated_arm', 200.0), 'bag': ('1', 'recorder', '1')}),
}
TEXTS = ('changed', 'moon', '0.5', '0,0,-1')


@pytest.fixture(autouse=True)
def launch(monkeypatch):
    """Let launch files import the double of launch."""
    for name, module in modules().items():
        monkeypatch.setitem(sys.modules, name, module)


def changed(parameter):
    """Return a value that a parameter may have and has not by default."""
    default = parameter.default
    if isinstance(default, bool):
        return not default
    if isinstance(default, list):
        return ['changed'] if isinstance(default[0], str) else [0.25, 0.5]
    if isinstance(default, str):
        values = (*parameter.choices, *TEXTS)
    else:
        lower, upper = parameter.limits
        values = (lower + k * (upper - lower) / 8 for k in range(9))
        values = (type(default)(value) for value in values)
    fits = (v for v in values if v != default and not parameter.objection(v))
    return next(fits, default)


def read_back(bench, node, folder):
    """Return the parameters that a process with the arguments of launch has."""
    started = bench.add(Node, node_name='unnamed', cli_args=node.arguments(folder))
    declare(started, TABLES[node.executable].values())
    assert started.get_fully_qualified_name() == f'{node.namespace.rstrip("/")}/{node.name}'
    names = [*TABLES[node.executable], 'use_sim_time']
    return {name: started.get_parameter(name).value for name in names}


def parameter_file(folder, nodes, pattern, clock):
    """Write a parameter file that changes every parameter, and return what it says by node."""
    said = {
        name: {p.name: changed(p) for p in TABLES[name].values()} | {'use_sim_time': clock}
        for name in nodes
    }
    content = {pattern.format(name): {'ros__parameters': said[name]} for name in nodes}
    content = {'/**': {'ros__parameters': {'executor': 'single'}}} | content
    (folder / 'own.yaml').write_text(yaml.safe_dump(content, sort_keys=False))
    return said


@pytest.mark.parametrize('pattern', ['/**/{}', '/left/{}', '/*/{}'])
@pytest.mark.parametrize('name', FILES)
def test_a_parameter_file_is_read_back_as_it_is(bench, tmp_path, name, pattern):
    needed, arguments = FILES[name]
    clock = name != 'replay'
    nodes = launched(name, namespace='left', **needed)
    said = parameter_file(tmp_path, nodes, pattern, clock)
    options = {'namespace': 'left', 'params_file': str(tmp_path / 'own.yaml'), **needed}
    for executable, node in launched(name, **options).items():
        given = {k: v for k, v in needed.items() if k in said[executable]}
        assert read_back(bench, node, tmp_path) == said[executable] | given, executable
    texts = {key: text for key, (text, _, _) in arguments.items()}
    nodes = launched(name, **options, **texts, use_sim_time=str(not clock))
    for key, (_, executable, value) in arguments.items():
        found = read_back(bench, nodes[executable], tmp_path)
        assert (found[key], found['use_sim_time']) == (value, not clock)


@pytest.mark.parametrize('name', FILES)
def test_without_a_parameter_file_nodes_get_parameters_they_have(bench, tmp_path, name):
    nodes = launched(name, **FILES[name][0])
    for executable, node in nodes.items():
        values = read_back(bench, node, tmp_path)
        given = {key for p in node.parameters if isinstance(p, dict) for key in p}
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
    with pytest.raises(RuntimeError, match='params_file'):
        launched('replay', bag='monday', params_file='none.yaml')
