# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page of all nodes, with the tables of their parameters."""

from __future__ import annotations

from armid_ros.nodes.bag_player import BagPlayerNode
from armid_ros.nodes.base import ArmidNode, COMMON
from armid_ros.nodes.excitation_publisher import ExcitationPublisherNode
from armid_ros.nodes.identification_run import IdentificationRunNode
from armid_ros.nodes.joint_state_merger import JointStateMergerNode
from armid_ros.nodes.live_diagnosis import LiveDiagnosisNode
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.papers.exo.nodes.interaction_identifier import InteractionIdentifierNode
from armid_ros.papers.exo.nodes.simulated_pair import SimulatedPairNode
from armid_ros.view.nodes.residual_markers import ResidualMarkersNode

from docsite.markdown import cell, prose, table

#: Executable and class, in the order of the work.
NODES: dict[str, type[ArmidNode]] = {
    'excitation_publisher': ExcitationPublisherNode,
    'simulated_arm': SimulatedArmNode,
    'online_identifier': OnlineIdentifierNode,
    'live_diagnosis': LiveDiagnosisNode,
    'joint_state_merger': JointStateMergerNode,
    'identification_run': IdentificationRunNode,
    'recorder': RecorderNode,
    'residual_markers': ResidualMarkersNode,
    'bag_player': BagPlayerNode,
    'simulated_pair': SimulatedPairNode,
    'interaction_identifier': InteractionIdentifierNode,
}


def nodes_page(introduction: str) -> str:
    """Return the introduction, followed by purpose and parameters of every node."""
    lines = [introduction]
    for name, node in NODES.items():
        lines += [f'## {name}', '', _purpose(node), '']
        rows = [_row(parameter) for parameter in (*node.table, *COMMON)]
        lines += table(('parameter', 'default', 'range', 'meaning'), rows)
    return '\n'.join(lines)


def _purpose(node: type[ArmidNode]) -> str:
    """Return the docstring of a node without its section of attributes."""
    return prose(node.__doc__ or '').split('\nAttributes\n')[0].strip()


def _row(parameter: NodeParameter) -> tuple[str, ...]:
    changeable = '' if parameter.read_only else ' May be set while the node runs.'
    unit = f' [{parameter.unit}]' if parameter.unit else ''
    return (
        f'`{parameter.name}`',
        f'`{parameter.default}`' if parameter.default != '' else 'empty',
        _range(parameter),
        cell(f'{parameter.description}{unit}{changeable}'),
    )


def _range(parameter: NodeParameter) -> str:
    if parameter.choices:
        return ', '.join(f'`{choice}`' for choice in parameter.choices)
    if parameter.limits is None:
        return ''
    return f'{parameter.limits[0]:g} to {parameter.limits[1]:g}'
