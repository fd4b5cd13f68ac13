# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A configuration of RViz for one robot: the arm, and what its model does not explain."""

from __future__ import annotations

from typing import Any

from armid_ros.report.layouts import SCHEMA, topic_prefix
import yaml

#: Topics that keep their last message for those who come late, and those that do not.
_LATCHED, _STREAM = 'Transient Local', 'Volatile'


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
    document = {
        'Panels': [
            {'Class': 'rviz_common/Displays', 'Name': 'Displays'},
            {'Class': 'rviz_common/Views', 'Name': 'Views'},
        ],
        'Visualization Manager': {
            'Class': '',
            'Displays': _displays(namespace),
            'Enabled': True,
            'Global Options': {
                'Background Color': '255; 255; 255',
                'Fixed Frame': base,
                'Frame Rate': 30,
            },
            'Name': 'root',
            'Tools': [
                {'Class': 'rviz_default_plugins/MoveCamera'},
                {'Class': 'rviz_default_plugins/Select'},
            ],
            'Transformation': {'Current': {'Class': 'rviz_default_plugins/TF'}},
            'Value': True,
            'Views': {
                'Current': {
                    'Class': 'rviz_default_plugins/Orbit',
                    'Name': 'Current View',
                    'Distance': 3.0,
                    'Focal Point': {'X': 0.0, 'Y': 0.0, 'Z': 0.0},
                    'Pitch': 0.5,
                    'Yaw': 0.8,
                    'Target Frame': base,
                    'Value': 'Orbit (rviz)',
                },
                'Saved': None,
            },
        },
        'Window Geometry': {'Height': 900, 'Width': 1300},
    }
    return f'# schema: {SCHEMA}\n{yaml.safe_dump(document, sort_keys=False)}'


def _displays(namespace: str) -> list[dict[str, Any]]:
    """Return what is drawn: a grid, the arm, and what is published of it."""
    at = topic_prefix(namespace)
    return [
        _display('rviz_default_plugins/Grid', 'Grid', {'Plane Cell Count': 8, 'Cell Size': 0.5}),
        _display(
            'rviz_default_plugins/RobotModel',
            'Arm',
            {
                'Description Source': 'Topic',
                'Description Topic': _topic(f'{at}robot_description', _LATCHED),
                'Alpha': 0.6,
                'Visual Enabled': True,
                'Collision Enabled': False,
                'TF Prefix': '',
            },
        ),
        _display(
            'rviz_default_plugins/MarkerArray',
            'Residual and diagnosis',
            {
                'Topic': _topic(f'{at}residual_markers/markers', _STREAM),
                'Namespaces': dict.fromkeys(('residual', 'share', 'joint', 'diagnosis'), True),
            },
        ),
    ]


def _display(kind: str, name: str, more: dict[str, Any]) -> dict[str, Any]:
    return {'Class': kind, 'Name': name, 'Enabled': True, 'Value': True, **more}


def _topic(name: str, durability: str) -> dict[str, Any]:
    return {
        'Value': name,
        'Depth': 5,
        'History Policy': 'Keep Last',
        'Reliability Policy': 'Reliable',
        'Durability Policy': durability,
    }
