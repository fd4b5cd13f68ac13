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
    Return the URDF of a robot, with its present inertial parameters and given friction.

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
    body = robot.rigid_parameters.reshape(-1, PER_LINK)
    others = _parameters(robot, _without_inertials(robot.urdf, robot.links))
    shares = np.array([_share(*pair) for pair in zip(body, others, strict=True)])
    text = robot.urdf
    if np.any(shares < 1.0):
        text = _scaled(robot, shares)
        others = _parameters(robot, _without_inertials(text, robot.links))
    own = dict(zip(robot.links, body - others, strict=True))

    document, root = _parsed(text)
    links = {link.getAttribute('name'): link for link in _children(root, 'link')}
    for name, parameters in own.items():
        _set_inertial(links[name], parameters)
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
    result = _text(document)
    _check(robot, result)
    return result


def _parsed(urdf: str) -> tuple[minidom.Document, minidom.Element]:
    """Parse a URDF, keeping comments and namespaces; return document and root element."""
    document = expatbuilder.parseString(urdf, namespaces=False)
    assert document.documentElement is not None
    return document, document.documentElement


def _text(document: minidom.Document) -> str:
    return '\n'.join(
        ['<?xml version="1.0"?>', *(node.toxml() for node in document.childNodes), '']
    )


def _children(parent: minidom.Element, name: str) -> Iterator[minidom.Element]:
    return (
        child
        for child in parent.childNodes
        if isinstance(child, minidom.Element) and child.tagName == name
    )


def _child(parent: minidom.Element, name: str) -> minidom.Element:
    """Return the first child element with a tag; add an empty one if there is none."""
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


def _parameters(robot: Robot, urdf: str) -> FloatArray:
    """Return the inertial parameters of each driven joint's body in a URDF, shape (n, 10)."""
    read = robot_from_urdf(urdf, joints=robot.joints, source=robot.name)
    return read.rigid_parameters.reshape(-1, PER_LINK)


def _without_inertials(urdf: str, links: Sequence[str]) -> str:
    """Return a URDF in which the masses and inertias of some links are zero."""
    document, root = _parsed(urdf)
    for link in _children(root, 'link'):
        for inertial in _children(link, 'inertial'):
            for element in (_child(inertial, 'mass'), _child(inertial, 'inertia')):
                for key in element.attributes.keys() if link.getAttribute('name') in links else ():
                    element.setAttribute(key, '0')
    return _text(document)


def _share(body: FloatArray, others: FloatArray) -> float:
    """Return a factor on the inertias of attached links that keeps the child link consistent."""
    if not np.any(others):
        return 1.0
    if not Consistency.of('', others).eigenvalues[0] > -1e-12:
        return 0.0
    largest = float(scipy.linalg.eigh(pseudo_inertia(others), pseudo_inertia(body))[0][-1])
    return 1.0 if largest <= 1.0 - _MIN_SHARE else 0.5 / largest


def _scaled(robot: Robot, shares: FloatArray) -> str:
    """Return a URDF with scaled masses and inertias of links attached to moving links."""
    document, root = _parsed(robot.urdf)
    carriers = {joint.child: joint for joint in robot.description.joints}
    for link in _children(root, 'link'):
        name, inertial = link.getAttribute('name'), next(_children(link, 'inertial'), None)
        if inertial is None or name in robot.links:
            continue
        # go up to the nearest driven joint
        carrier = carriers.get(name)
        while carrier is not None and carrier.name not in robot.joints:
            carrier = carriers.get(carrier.parent)
        if carrier is None:
            continue
        share = float(shares[robot.joints.index(carrier.name)])
        for element in (_child(inertial, 'mass'), _child(inertial, 'inertia')):
            for key, value in element.attributes.items() if share < 1.0 else ():
                element.setAttribute(key, repr(share * float(value)))
    return _text(document)


def _set_inertial(link: minidom.Element, parameters: FloatArray) -> None:
    """Write inertial parameters to a URDF link as mass, centre of mass and inertia."""
    body = pin.Inertia.FromDynamicParameters(parameters)
    values = {
        'origin': {'xyz': ' '.join(map(repr, body.lever.tolist())), 'rpy': '0 0 0'},
        'mass': {'value': repr(float(body.mass))},
        'inertia': {
            f'i{"xyz"[i]}{"xyz"[j]}': repr(float(body.inertia[i, j]))
            for i in range(3)
            for j in range(i, 3)
        },
    }
    inertial = _child(link, 'inertial')
    for name, row in values.items():
        for key, value in row.items():
            _child(inertial, name).setAttribute(key, value)


def _check(robot: Robot, urdf: str) -> None:
    """Raise ModelError if a written URDF has other inertial parameters than the robot."""
    found, wanted = _parameters(robot, urdf), robot.rigid_parameters.reshape(-1, PER_LINK)
    worst = np.max(np.abs(found - wanted), axis=1)
    scale = float(np.max(np.abs(wanted)))
    if np.any(worst > 1e-11 * scale):
        link = robot.links[int(np.argmax(worst))]
        raise ModelError(
            f"{robot.name}: the exported URDF, read again, has other parameters of link '{link}': "
            f'they differ by {worst.max():.3g}; report this as a bug'
        )
