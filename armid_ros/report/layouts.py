# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Layout files of PlotJuggler, Foxglove and RViz for the joints and topics of a robot."""

from __future__ import annotations

from collections.abc import Sequence
import json
from typing import Any

from armid_ros.report.page import render

#: Schema in a comment or a variable of each file; files with a schema may be overwritten.
SCHEMA = 'armid/layout/1'
#: Colours of PlotJuggler, in its order.
_COLOURS = (
    '#1f77b4', '#d62728', '#1ac938', '#ff7f0e', '#f14cc1', '#9467bd', '#17becf', '#bcbd22',
)  # fmt: skip
_IDENTIFIER = 'online_identifier'
_PREDICTED = f'{_IDENTIFIER}/predicted_joint_states'
_RESIDUAL = f'{_IDENTIFIER}/residual'


def topic_prefix(namespace: str) -> str:
    """Return the prefix of topic names in a namespace, such as '/' or '/left_arm/'."""
    return '/' + (namespace.strip('/') + '/' if namespace.strip('/') else '')


def plotter_layouts(
    robot: str, joints: Sequence[str], namespace: str = '', base: str = 'base_link'
) -> dict[str, str]:
    """
    Return layout files for PlotJuggler, Foxglove and RViz: content by file name.

    PlotJuggler and Foxglove show motion, torque, residual and convergence, Foxglove the arm and
    the diagnosis as well. RViz shows the model of the arm, which moves with the transforms of
    robot_state_publisher, and the residual on its joints; these markers need no transforms.

    Parameters
    ----------
    robot : str
        Name of the robot, as in /diagnostics.
    joints : sequence of str
        Driven joints, in the order in which joint_states has them.
    namespace : str
        Namespace of the nodes; empty for none.
    base : str
        Base link; the arm and all markers are drawn in its frame.

    """
    at = topic_prefix(namespace)
    status = f'/diagnostics/{robot}/{at.lstrip("/")}{_IDENTIFIER}: state'
    measured = {
        quantity: [f'{at}joint_states/{joint}/{quantity}' for joint in joints]
        for quantity in ('position', 'velocity', 'effort')
    }
    predicted = [f'{at}{_PREDICTED}/{joint}/effort' for joint in joints]
    residual = [f'{at}{_RESIDUAL}/{joint}/effort' for joint in joints]
    rms = [f'{status}/residual_rms {joint}' for joint in joints]
    tabs: dict[str, Sequence[Sequence[str]]] = {
        'motion': [measured['position'], measured['velocity']],
        'torque': list(zip(measured['effort'], predicted, strict=True)),
        'residual': [residual, rms],
        'convergence': [[f'{status}/condition_number'], [f'{status}/samples']],
    }
    torques = _paths(f'{at}joint_states.effort', joints)
    torques += _paths(f'{at}{_PREDICTED}.effort', joints, ' predicted')
    condition = _path(f'{at}{_IDENTIFIER}/estimate.condition_number', 'condition number')
    plots = [
        ('motion', 'Position [rad]', _paths(f'{at}joint_states.position', joints)),
        ('torque', 'Torque, measured and predicted [N m]', torques),
        ('residual', 'Residual [N m]', _paths(f'{at}{_RESIDUAL}.effort', joints)),
        ('condition', 'Condition number', [condition]),
    ]
    common = {'schema': SCHEMA, 'at': at, 'base': base}
    foxglove = json.loads(render('foxglove.json', {**common, 'plots': plots}))
    curves = {'schema': SCHEMA, 'tabs': tabs, 'colours': _COLOURS}
    return {
        'plotjuggler.xml': str(render('plotjuggler.xml', curves)),
        'foxglove.json': json.dumps(foxglove, indent=2) + '\n',
        'arm.rviz': f'{render("arm.rviz", common)}\n',
    }


def _path(value: str, label: str) -> dict[str, Any]:
    """Return Foxglove's settings for one plotted signal."""
    return {'value': value, 'enabled': True, 'timestampMethod': 'headerStamp', 'label': label}


def _paths(field: str, joints: Sequence[str], suffix: str = '') -> list[dict[str, Any]]:
    """Return Foxglove's settings for a plotted field of each joint."""
    return [_path(f'{field}[{k}]', f'{joint}{suffix}') for k, joint in enumerate(joints)]
