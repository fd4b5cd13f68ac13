# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Layouts for any robot are those that are shipped, with its joints and its namespace."""

import json
from pathlib import Path
from xml.etree import ElementTree

from armid_ros.files.output import is_own
from armid_ros.report.layouts import plotter_layouts
from armid_ros.robots import load_robot
import yaml

CONFIG = Path(__file__).parents[2] / 'config'
JOINTS = load_robot('humanoid_arm').joints
BASE = load_robot('humanoid_arm').base


def test_layouts_of_the_shipped_arm_are_the_shipped_layouts():
    """What somebody tried in the plotters is what everybody gets."""
    layouts = plotter_layouts('humanoid_arm', JOINTS, base=BASE)
    shipped = (CONFIG / 'plotjuggler_layout.xml').read_text()
    same = {'strip_text': True}
    assert ElementTree.canonicalize(
        layouts['plotjuggler.xml'], **same
    ) == ElementTree.canonicalize(shipped, **same)
    shipped = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    assert json.loads(layouts['foxglove.json']) == shipped


def test_a_namespace_is_before_every_topic_of_the_nodes():
    layouts = plotter_layouts('arm', ('a', 'b'), '/left/')
    plotjuggler = ElementTree.fromstring(layouts['plotjuggler.xml'])
    curves = [curve.get('name') for curve in plotjuggler.iter('curve')]
    assert '/left/joint_states/a/effort' in curves
    assert '/diagnostics/arm/left/online_identifier: state/samples' in curves
    assert all(name.startswith(('/left/', '/diagnostics/arm/left/')) for name in curves)
    layout = json.loads(layouts['foxglove.json'])['configById']
    assert layout['RawMessages!estimate']['topicPath'] == '/left/online_identifier/estimate'
    values = [path['value'] for path in layout['Plot!torque']['paths']]
    assert values[0] == '/left/joint_states.effort[0]'
    assert values[-1] == '/left/online_identifier/predicted_joint_states.effort[1]'


def test_the_arm_is_shown_in_the_frame_of_its_base():
    layouts = plotter_layouts('arm', ('a',), 'left', 'foot')
    scene = json.loads(layouts['foxglove.json'])['configById']['3D!arm']
    assert scene['followTf'] == 'foot'
    assert scene['layers']['arm']['topic'] == '/left/robot_description'
    manager = yaml.safe_load(layouts['arm.rviz'])['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == 'foot'
    _, arm, markers = manager['Displays']
    assert arm['Description Topic']['Value'] == '/left/robot_description'
    assert markers['Topic']['Value'] == '/left/residual_markers/markers'


def test_layouts_say_that_they_may_be_written_over(tmp_path):
    for name, text in plotter_layouts('arm', ('a',)).items():
        (tmp_path / name).write_text(text)
        assert is_own(tmp_path / name)
        (tmp_path / name).write_text('<root/>')
        assert not is_own(tmp_path / name)
