# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Export of a URDF with new inertial parameters and friction, otherwise unchanged.

A driven joint may move several links, on fixed joints or on joints that are not driven. The child
link of the driven joint gets new inertial parameters, so that the sum over the links is exactly as
given. The other links keep their inertial parameters as far as physical consistency permits.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from xml.dom import expatbuilder, minidom

from armid_ros.errors import ModelError
from armid_ros.model.pseudo_inertia import Consistency, pseudo_inertia, require_consistent
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot, robot_from_urdf
from armid_ros.robots.description import inertia_attributes, text_of
from armid_ros.robots.meshes import find_mesh
from armid_ros.robots.robot import PER_LINK
import numpy as np
import pinocchio as pin
import scipy.linalg

#: Smallest share of a body's pseudo-inertia, in any direction, that the child link keeps.
_MIN_SHARE = 0.05


def export_urdf(
    robot: Robot, values: Mapping[str, Mapping[str, float]], remarks: Sequence[str] = ()
) -> str:
    """
    Return the URDF of a robot with its inertial parameters and with joint friction `values`.

    Parameters
    ----------
    robot : Robot
        The arm; ``robot.urdf`` is the URDF that is changed.
    values : mapping of str to mapping of str to float
        'damping' [N m s/rad] and 'friction' [N m] of <dynamics>, each by joint.
    remarks : sequence of str
        Lines of a comment at the end, such as parameters that a URDF cannot contain.

    Returns
    -------
    str
        URDF. Only <inertial>, <dynamics> and the comment at the end differ; paths of meshes become
        absolute, and <ros2_control> is left out. Other comments stay.

    Raises
    ------
    ModelError
        If the parameters of a link are not physically consistent, or if the file read again would
        not have them.

    """
    require_consistent(robot.links, robot.rigid_parameters)
    document = expatbuilder.parseString(robot.urdf, namespaces=False)
    root = document.documentElement
    assert root is not None
    _set_inertials(root, robot)
    for joint in _children(root, 'joint'):
        for key, table in values.items():
            if joint.getAttribute('name') in table:
                value = repr(float(table[joint.getAttribute('name')]))
                _child(joint, 'dynamics').setAttribute(key, value)
    for element in list(_children(root, 'ros2_control')):  # hosts and passwords of drives
        root.removeChild(element)
    for mesh in root.getElementsByTagName('mesh'):  # the file will be in another folder
        name = mesh.getAttribute('filename')
        found = None if '://' in name else find_mesh(name, robot.path)
        mesh.setAttribute('filename', name if found is None else f'file://{found}')
    if remarks:
        lines = ''.join(f'\n    {line.replace("--", "- -")}' for line in remarks)
        root.appendChild(document.createComment(f'{lines}\n  '))
    nodes = (node.toxml() for node in document.childNodes)
    result = '\n'.join(['<?xml version="1.0"?>', *nodes, ''])
    _check(robot, result)
    return result


def _frame(robot: Robot, link: str) -> pin.Frame:
    """Return the frame of a link in the Pinocchio model of a robot."""
    return robot.model.frames[robot.model.getFrameId(link, pin.FrameType.BODY)]


def _attached(robot: Robot) -> FloatArray:
    """Return described inertial parameters of all links fixed to each moving link, (m, 10)."""
    parameters = np.zeros((len(robot.links), PER_LINK))
    for name, inertial in robot.description.links.items():
        frame = _frame(robot, name)
        if inertial is not None and frame.parentJoint and name not in robot.links:
            axes = pin.rpy.rpyToMatrix(*inertial.rpy)
            tensor = axes @ inertial.tensor @ axes.T
            link = pin.Inertia(inertial.mass, np.array(inertial.xyz), tensor)
            parameters[frame.parentJoint - 1] += frame.placement.act(link).toDynamicParameters()
    return parameters


def _children(parent: minidom.Element, name: str) -> Iterator[minidom.Element]:
    return (
        child
        for child in parent.childNodes
        if isinstance(child, minidom.Element) and child.tagName == name
    )


def _child(parent: minidom.Element, name: str) -> minidom.Element:
    """Return the first child element with tag `name`; add an empty element if there is none."""
    found = next(_children(parent, name), None)
    if found is None:
        document = minidom.Document()
        found = document.createElement(name)
        space = [
            node
            for node in (parent.firstChild, parent.lastChild)
            if isinstance(node, minidom.Text) and node.data.isspace()
        ]
        if space:
            parent.insertBefore(document.createTextNode(space[0].data), space[-1])
            parent.insertBefore(found, space[-1])
        else:
            parent.appendChild(found)
    return found


def _set_inertials(root: minidom.Element, robot: Robot) -> None:
    """Write the inertial parameters of a robot to the links of its URDF."""
    body, attached = robot.rigid_parameters.reshape(-1, PER_LINK), _attached(robot)
    shares = [_share(*pair) for pair in zip(body, attached, strict=True)]
    for link in _children(root, 'link'):
        name = link.getAttribute('name')
        carrier = _frame(robot, name).parentJoint - 1
        if name in robot.links:
            own = body[carrier] - shares[carrier] * attached[carrier]
            inertia = pin.Inertia.FromDynamicParameters(own)
            values = {
                'origin': {'xyz': text_of(inertia.lever), 'rpy': '0 0 0'},
                'mass': {'value': text_of(inertia.mass)},
                'inertia': inertia_attributes(inertia.inertia),
            }
            inertial = _child(link, 'inertial')
            for tag, row in values.items():
                for key, text in row.items():
                    _child(inertial, tag).setAttribute(key, text)
        elif carrier >= 0 and shares[carrier] < 1.0:
            for inertial in _children(link, 'inertial'):
                for element in (_child(inertial, 'mass'), _child(inertial, 'inertia')):
                    for key, value in element.attributes.items():
                        element.setAttribute(key, repr(shares[carrier] * float(value)))


def _share(body: FloatArray, attached: FloatArray) -> float:
    """Return a factor (0 to 1) on inertias of attached links; the child link stays consistent."""
    if not np.any(attached):
        return 1.0
    if not Consistency.of('', attached).eigenvalues[0] > -1e-12:
        return 0.0
    largest = float(scipy.linalg.eigh(pseudo_inertia(attached), pseudo_inertia(body))[0][-1])
    return 1.0 if largest <= 1.0 - _MIN_SHARE else 0.5 / largest


def _check(robot: Robot, urdf: str) -> None:
    """Raise ModelError if a written URDF does not have the inertial parameters of the robot."""
    read = robot_from_urdf(urdf, joints=robot.joints, source=robot.name)
    wanted = robot.rigid_parameters
    worst = np.max(np.abs(read.rigid_parameters - wanted).reshape(-1, PER_LINK), axis=1)
    scale = float(np.max(np.abs(wanted)))
    if np.any(worst > 1e-11 * scale):
        link = robot.links[int(np.argmax(worst))]
        raise ModelError(
            f"{robot.name}: the exported URDF, read again, has other parameters of link '{link}': "
            f'they differ by {worst.max():.3g}; report this as a bug'
        )
