# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Launch files, parameter files and the reference name what nodes really have."""

from pathlib import Path
import re

from armid_ros.nodes.base import COMMON
import pytest
from sensor_msgs.msg import JointState
import yaml

from docsite.nodes import NODES

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
