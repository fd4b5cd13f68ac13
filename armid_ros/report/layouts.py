# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Layouts of plotters for one robot: its joints by name, its nodes in their namespace."""

from __future__ import annotations

from collections.abc import Sequence
import json
from typing import Any

from armid_ros.report.page import render

#: Of the files, in a comment or a variable: which of them may be written over.
SCHEMA = 'armid/layout/1'
#: Colours of PlotJuggler, in its order.
_COLOURS = (
    '#1f77b4', '#d62728', '#1ac938', '#ff7f0e', '#f14cc1', '#9467bd', '#17becf', '#bcbd22',
)  # fmt: skip
_IDENTIFIER = 'online_identifier'
_PREDICTED = f'{_IDENTIFIER}/predicted_joint_states'
_RESIDUAL = f'{_IDENTIFIER}/residual'


def topic_prefix(namespace: str) -> str:
    """Return the prefix of the topics of a namespace: '/' or '/left_arm/'."""
    return '/' + (namespace.strip('/') + '/' if namespace.strip('/') else '')


def plotjuggler_layout(robot: str, joints: Sequence[str], namespace: str = '') -> str:
    """
    Return a layout of PlotJuggler: motion, torque, residual, convergence.

    Parameters
    ----------
    robot : str
        Name of the robot, as /diagnostics has it.
    joints : sequence of str
        Its driven joints.
    namespace : str
        Of the nodes; empty for none.

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
    return str(render('plotjuggler.xml', {'schema': SCHEMA, 'tabs': tabs, 'colours': _COLOURS}))


def foxglove_layout(joints: Sequence[str], namespace: str = '', base: str = 'base_link') -> str:
    """
    Return a layout of Foxglove: the arm, torque, residual, condition number, diagnosis as text.

    Parameters
    ----------
    joints : sequence of str
        Driven joints, in the order in which joint_states has them.
    namespace : str
        Of the nodes; empty for none.
    base : str
        Base link, in whose frame the arm and what is drawn on it are shown.

    """
    at = topic_prefix(namespace)
    measured = _paths(f'{at}joint_states.effort', joints)
    predicted = _paths(f'{at}{_PREDICTED}.effort', joints, ' predicted')
    condition = _path(f'{at}{_IDENTIFIER}/estimate.condition_number', 'condition number')
    plots = [
        ('motion', 'Position [rad]', _paths(f'{at}joint_states.position', joints)),
        ('torque', 'Torque, measured and predicted [N m]', measured + predicted),
        ('residual', 'Residual [N m]', _paths(f'{at}{_RESIDUAL}.effort', joints)),
        ('condition', 'Condition number', [condition]),
    ]
    text = render('foxglove.json', {'schema': SCHEMA, 'at': at, 'base': base, 'plots': plots})
    return json.dumps(json.loads(text), indent=2) + '\n'


def rviz_config(base: str, namespace: str = '') -> str:
    """
    Return a configuration of RViz, with the model of the arm and the residual on its joints.

    The model moves with the transforms of robot_state_publisher; the markers need none.

    Parameters
    ----------
    base : str
        Base link, which is the fixed frame.
    namespace : str
        Of the nodes; empty for none.

    """
    at = topic_prefix(namespace)
    return f'{render("arm.rviz", {"schema": SCHEMA, "base": base, "at": at})}\n'


def _path(value: str, label: str) -> dict[str, Any]:
    return {'value': value, 'enabled': True, 'timestampMethod': 'headerStamp', 'label': label}


def _paths(field: str, joints: Sequence[str], suffix: str = '') -> list[dict[str, Any]]:
    return [_path(f'{field}[{k}]', f'{joint}{suffix}') for k, joint in enumerate(joints)]
