# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Layouts of plotters for one robot: its joints by name, its nodes in their namespace."""

from __future__ import annotations

from collections.abc import Sequence
import json
from typing import Any
from xml.etree import ElementTree

#: Of the files, in a comment or a variable: which of them may be written over.
SCHEMA = 'armid/layout/1'
#: Colours of PlotJuggler, in its order.
_COLOURS = (
    '#1f77b4', '#d62728', '#1ac938', '#ff7f0e', '#f14cc1', '#9467bd', '#17becf', '#bcbd22',
)  # fmt: skip
_IDENTIFIER = 'online_identifier'
_PREDICTED = f'{_IDENTIFIER}/predicted_joint_states'
_RESIDUAL = f'{_IDENTIFIER}/residual'
_MARKERS = 'residual_markers/markers'
_DIAGNOSIS = 'live_diagnosis/diagnosis'


def topic_prefix(namespace: str) -> str:
    """Return what stands before the topics of a namespace: '/' or '/left_arm/'."""
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
    root = ElementTree.Element('root')
    window = _inside(root, 'tabbed_widget', name='Main Window', parent='main_window')
    for name, plots in tabs.items():
        _tab(window, name, plots)
    _inside(window, 'currentTabIndex', index='1')
    _inside(root, 'use_relative_time_offset', enabled='1')
    ElementTree.indent(root, ' ')
    return (
        f"<?xml version='1.0' encoding='UTF-8'?>\n<!-- schema: {SCHEMA} -->\n"
        f'{ElementTree.tostring(root, "unicode")}\n'
    )


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
    layout = {
        'globalVariables': {'schema': SCHEMA},
        'configById': {
            'Plot!motion': _plot('Position [rad]', _paths(f'{at}joint_states.position', joints)),
            'Plot!torque': _plot('Torque, measured and predicted [N m]', measured + predicted),
            'Plot!residual': _plot('Residual [N m]', _paths(f'{at}{_RESIDUAL}.effort', joints)),
            'Plot!condition': _plot('Condition number', [condition]),
            '3D!arm': _scene(at, base),
            'RawMessages!diagnosis': _messages(f'{at}{_DIAGNOSIS}.summary'),
            'RawMessages!estimate': _messages(f'{at}{_IDENTIFIER}/estimate'),
            'DiagnosticSummary!nodes': {
                'minLevel': 0,
                'pinnedIds': [],
                'hardwareIdFilter': '',
                'topicToRender': '/diagnostics',
                'sortByLevel': True,
            },
        },
        'userNodes': {},
        'playbackConfig': {'speed': 1},
        'layout': {
            'direction': 'row',
            'splitPercentage': 65,
            'first': {
                'direction': 'column',
                'splitPercentage': 40,
                'first': '3D!arm',
                'second': _column(33, 'Plot!motion', 'Plot!torque', 'Plot!residual'),
            },
            'second': {
                'direction': 'column',
                'splitPercentage': 20,
                'first': 'RawMessages!diagnosis',
                'second': _column(
                    30, 'DiagnosticSummary!nodes', 'Plot!condition', 'RawMessages!estimate'
                ),
            },
        },
    }
    return json.dumps(layout, indent=2) + '\n'


def _scene(at: str, base: str) -> dict[str, Any]:
    """
    Return a view of the arm from the front and above, with what is drawn on its joints.

    The arm is a layer: of all topics, Foxglove takes only /robot_description for a robot.

    """
    return {
        'followTf': base,
        'followMode': 'follow-pose',
        'cameraState': {
            'perspective': True,
            'distance': 3.0,
            'phi': 60.0,
            'thetaOffset': 45.0,
            'targetOffset': [0.0, 0.0, 0.0],
            'target': [0.0, 0.0, 0.0],
            'targetOrientation': [0.0, 0.0, 0.0, 1.0],
            'fovy': 45.0,
            'near': 0.01,
            'far': 500.0,
        },
        'scene': {},
        'transforms': {},
        'topics': {f'{at}{_MARKERS}': {'visible': True}},
        'layers': {
            'arm': {
                'layerId': 'foxglove.Urdf',
                'instanceId': 'arm',
                'label': 'Arm',
                'visible': True,
                'frameLocked': True,
                'sourceType': 'topic',
                'topic': f'{at}robot_description',
                'framePrefix': '',
                'displayMode': 'auto',
            },
            'grid': {
                'layerId': 'foxglove.Grid',
                'instanceId': 'grid',
                'label': 'Grid',
                'visible': True,
                'frameLocked': True,
                'size': 4,
                'divisions': 8,
                'lineWidth': 1,
                'color': '#a0a0a0ff',
                'position': [0, 0, 0],
                'rotation': [0, 0, 0],
            },
        },
        'publish': {},
        'imageMode': {},
    }


def _tab(window: ElementTree.Element, name: str, plots: Sequence[Sequence[str]]) -> None:
    tab = _inside(window, 'Tab', containers='1', tab_name=name)
    container = _inside(tab, 'Container')
    sizes = ';'.join([f'{1.0 / len(plots):.3f}'] * len(plots))
    splitter = _inside(
        container, 'DockSplitter', orientation='-', sizes=sizes, count=str(len(plots))
    )
    # A single curve a plot takes the colours of the plots in turn.
    shift = all(len(curves) == 1 for curves in plots)
    for number, curves in enumerate(plots):
        area = _inside(splitter, 'DockArea', name='...')
        plot = _inside(
            area, 'plot', style='Lines', mode='TimeSeries', flip_x='false', flip_y='false'
        )
        _inside(plot, 'limitY')
        for k, curve in enumerate(curves):
            colour = _COLOURS[(k + number * shift) % len(_COLOURS)]
            _inside(plot, 'curve', name=curve, color=colour)


def _inside(above: ElementTree.Element, tag: str, /, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(above, tag, attributes)


def _path(value: str, label: str) -> dict[str, Any]:
    return {'value': value, 'enabled': True, 'timestampMethod': 'headerStamp', 'label': label}


def _paths(field: str, joints: Sequence[str], suffix: str = '') -> list[dict[str, Any]]:
    return [_path(f'{field}[{k}]', f'{joint}{suffix}') for k, joint in enumerate(joints)]


def _plot(title: str, paths: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        'foxglovePanelTitle': title,
        'paths': paths,
        'showXAxisLabels': True,
        'showYAxisLabels': True,
        'showLegend': True,
        'legendDisplay': 'floating',
        'isSynced': True,
        'showPlotValuesInLegend': False,
        'xAxisVal': 'timestamp',
        'sidebarDimension': 240,
    }


def _messages(path: str) -> dict[str, Any]:
    """Return a view of messages as they are, without a comparison."""
    return {
        'topicPath': path,
        'diffEnabled': False,
        'diffMethod': 'custom',
        'diffTopicPath': '',
        'showFullMessageForDiff': False,
    }


def _column(share: int, first: str, second: str, third: str) -> dict[str, Any]:
    below = {'direction': 'column', 'first': second, 'second': third}
    return {'direction': 'column', 'splitPercentage': share, 'first': first, 'second': below}
