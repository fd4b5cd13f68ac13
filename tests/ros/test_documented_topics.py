# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The reference names the topics and services that a node really has."""

from pathlib import Path
import re

import pytest
from sensor_msgs.msg import JointState

from docsite.nodes import NODES

PAGE = Path(__file__).parents[2] / 'docs' / 'reference' / 'nodes.md'
#: What every node has, and what depends on parameters.
EVERYWHERE = {'/rosout', '/parameter_events', '/diagnostics', '/clock'}
#: They play and record whatever there is.
ANYTHING = ('bag_player', 'recorder')
#: What is heard, said and served has a table with so many columns; the others have fewer.
COLUMNS = 4


def documented(name, column):
    """Return the full names in a cell of the table; what goes with elastic joints is left out."""
    found = re.findall(rf'^\| `{name}` \|.*$', PAGE.read_text(), re.MULTILINE)
    (row,) = [row for row in found if row.count('|') > COLUMNS]
    cell = row.split('|')[column].split(';')[0]
    names = re.findall(r'`([^`]+)`', cell)
    full = {re.sub('^~', f'/{name}', one) for one in names}
    return {one if one.startswith('/') else f'/{one}' for one in full} - EVERYWHERE


def test_every_executable_has_a_place_in_the_reference():
    scripts = Path(__file__).parents[2] / 'scripts'
    assert set(NODES) == {path.name for path in scripts.iterdir()} - {'armid'}


@pytest.mark.parametrize('name', [name for name in NODES if name not in ANYTHING])
def test_topics_and_services_are_those_of_the_table(name, bench):
    node = bench.add(NODES[name])
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
