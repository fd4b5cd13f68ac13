# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Descriptions for MuJoCo to read by itself: bodies and axes, without looks and limits."""

from __future__ import annotations

from xml.etree import ElementTree

from armid_ros.robots import Robot


def bare_urdf(robot: Robot) -> str:
    """Return the robot's URDF without what is not dynamics; joints without a drive are fixed."""
    root = _bare(robot.urdf)
    for joint in root.findall('joint'):
        if joint.get('name') not in robot.joints:
            joint.set('type', 'fixed')
    return _compiled(root)


def side_by_side(*descriptions: str) -> str:
    """Put URDFs on one ground."""
    whole = ElementTree.Element('robot', name='pair')
    ElementTree.SubElement(whole, 'link', name='ground')
    for urdf in descriptions:
        parts = _bare(urdf)
        moved = {joint.find('child').get('link') for joint in parts.findall('joint')}
        for link in parts.findall('link'):
            if link.get('name') not in moved:
                root = ElementTree.SubElement(
                    whole, 'joint', name=f'{link.get("name")}_on_ground', type='fixed'
                )
                ElementTree.SubElement(root, 'parent', link='ground')
                ElementTree.SubElement(root, 'child', link=link.get('name'))
        whole.extend(parts)
    return _compiled(whole)


def _bare(urdf: str) -> ElementTree.Element:
    """Return links with their inertia alone, and joints without limits."""
    root = ElementTree.fromstring(urdf)
    for link in root.iter('link'):
        for element in [e for e in link if e.tag != 'inertial']:
            link.remove(element)
    for joint in root.findall('joint'):
        if joint.get('type') == 'revolute':
            joint.set('type', 'continuous')
        for element in [e for e in joint if e.tag not in ('origin', 'parent', 'child', 'axis')]:
            joint.remove(element)
    for element in [e for e in root if e.tag not in ('link', 'joint')]:
        root.remove(element)
    return root


def _compiled(root: ElementTree.Element) -> str:
    compiler = ElementTree.SubElement(root, 'mujoco')
    ElementTree.SubElement(compiler, 'compiler', fusestatic='true', balanceinertia='false')
    return ElementTree.tostring(root, encoding='unicode')
