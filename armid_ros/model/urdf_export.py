# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A URDF with other inertial parameters, and otherwise unchanged.

A driven joint may move several links, on fixed joints or on joints that are not driven. The other
links keep their inertials as far as physical consistency permits. The driven joint's own link gets
the remainder, so that the file, when read again, has exactly the given parameters.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import escape

from armid_ros.errors import ModelError
from armid_ros.model.pseudo_inertia import (
    Consistency,
    PER_LINK,
    pseudo_inertia,
    require_consistent,
)
from armid_ros.model.xml_edit import Element, XmlText
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot, robot_from_urdf
from armid_ros.robots.meshes import find_mesh
import numpy as np
import pinocchio as pin
import scipy.linalg

#: Least share of a body's pseudo-inertia, in any direction, that its own link keeps.
LEAST_SHARE = 0.05
#: Largest error of the parameters when the file is read again, over the largest parameter.
ROUNDING = 1e-11


def export_urdf(
    robot: Robot,
    *,
    damping: Mapping[str, float] | None = None,
    friction: Mapping[str, float] | None = None,
    remarks: Sequence[str] = (),
) -> str:
    """
    Return the robot's description with its present inertial parameters.

    Parameters
    ----------
    robot : Robot
        The arm; ``robot.urdf`` is the description that is changed.
    damping, friction : mapping of str to float, optional
        Viscous coefficient [N m s/rad] and Coulomb torque [N m] by joint, for <dynamics>.
    remarks : sequence of str
        Lines of a comment at the end, such as parameters that a URDF cannot contain.

    Returns
    -------
    str
        URDF. Only <inertial>, <dynamics> and the comment at the end differ; paths of meshes become
        absolute, and <ros2_control> is left out.

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

    document = XmlText(text)
    for link in document.root.all('link'):
        if link.attributes['name'] in own:
            _set_inertial(document, link, own[link.attributes['name']])
    for joint in document.root.all('joint'):
        values = {
            key: repr(float(table[joint.attributes['name']]))
            for key, table in (('damping', damping or {}), ('friction', friction or {}))
            if joint.attributes['name'] in table
        }
        element = joint.find('dynamics')
        if element is not None:
            document.set_attributes(element, values)
        elif values:
            row = ' '.join(f'{key}="{value}"' for key, value in values.items())
            document.append(joint, [f'<dynamics {row}/>'])
    for element in document.root.all('ros2_control'):  # hosts and passwords of drives
        document.remove(element)
    _set_meshes(document, document.root, robot.path)
    if remarks:
        lines = [line.replace('--', '- -') for line in remarks]
        document.append(document.root, ['<!--', *(f'  {line}' for line in lines), '-->'])
    result = document.text()
    _check(robot, result)
    return result


def _parameters(robot: Robot, urdf: str) -> FloatArray:
    read = robot_from_urdf(urdf, joints=robot.joints, source=robot.name)
    return read.rigid_parameters.reshape(-1, PER_LINK)


def _without_inertials(urdf: str, links: Sequence[str]) -> str:
    """Return a URDF without the inertials of some links."""
    document = XmlText(urdf)
    for link in document.root.all('link'):
        inertial = link.find('inertial')
        if link.attributes['name'] in links and inertial is not None:
            document.remove(inertial)
    return document.text()


def _share(body: FloatArray, others: FloatArray) -> float:
    """Return the share of the other links' inertia that leaves a consistent own link, 0 to 1."""
    if not np.any(others):
        return 1.0
    if not Consistency.of('', others).eigenvalues[0] > -1e-12:
        return 0.0
    largest = float(scipy.linalg.eigh(pseudo_inertia(others), pseudo_inertia(body))[0][-1])
    return 1.0 if largest <= 1.0 - LEAST_SHARE else 0.5 / largest


def _scaled(robot: Robot, shares: FloatArray) -> str:
    """Return the URDF with scaled mass and inertia of links that are fixed to driven ones."""
    document = XmlText(robot.urdf)
    carriers = _carriers(robot, document.root)
    for link in document.root.all('link'):
        name, inertial = link.attributes['name'], link.find('inertial')
        if inertial is None or name in robot.links or name not in carriers:
            continue
        share = float(shares[carriers[name]])
        if share >= 1.0:
            continue
        for element, keys in (
            (inertial.find('mass'), ('value',)),
            (inertial.find('inertia'), ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')),
        ):
            assert element is not None
            known = {key: element.attributes[key] for key in keys if key in element.attributes}
            values = {key: repr(share * float(value)) for key, value in known.items()}
            document.set_attributes(element, values)
    return document.text()


def _carriers(robot: Robot, root: Element) -> dict[str, int]:
    """Return the nearest driven joint of every link that a driven joint moves."""
    parents: dict[str, tuple[str, str]] = {}
    for joint in root.all('joint'):
        parent, child = joint.find('parent'), joint.find('child')
        if parent is not None and child is not None:
            names = parent.attributes['link'], joint.attributes['name']
            parents[child.attributes['link']] = names
    carriers = {}
    for link in parents:
        at: str | None = link
        while at in parents:
            above, joint_name = parents[at]
            if joint_name in robot.joints:
                carriers[link] = robot.joints.index(joint_name)
                break
            at = above
    return carriers


def _set_inertial(document: XmlText, link: Element, parameters: FloatArray) -> None:
    """Write ten parameters as mass, centre and inertia about it, in the axes of the link."""
    body = pin.Inertia.FromDynamicParameters(parameters)
    tensor = body.inertia
    values = {
        'origin': {'xyz': ' '.join(map(repr, body.lever.tolist())), 'rpy': '0 0 0'},
        'mass': {'value': repr(float(body.mass))},
        'inertia': {
            'ixx': repr(float(tensor[0, 0])),
            'ixy': repr(float(tensor[0, 1])),
            'ixz': repr(float(tensor[0, 2])),
            'iyy': repr(float(tensor[1, 1])),
            'iyz': repr(float(tensor[1, 2])),
            'izz': repr(float(tensor[2, 2])),
        },
    }
    tags = {
        name: f'<{name} ' + ' '.join(f'{key}="{value}"' for key, value in row.items()) + '/>'
        for name, row in values.items()
    }
    inertial = link.find('inertial')
    if inertial is None:
        inner = [f'  {tag}' for tag in tags.values()]
        document.append(link, ['<inertial>', *inner, '</inertial>'])
        return
    missing = []
    for name, row in values.items():
        element = inertial.find(name)
        if element is None:
            missing.append(tags[name])
        else:
            document.set_attributes(element, row)
    if missing:
        document.append(inertial, missing)


def _set_meshes(document: XmlText, element: Element, urdf: Path | None) -> None:
    """Replace paths of meshes by absolute ones, as the file will be in another folder."""
    for child in element.children:
        name = child.attributes.get('filename', '')
        if child.name == 'mesh' and '://' not in name:
            found = find_mesh(name, urdf)
            if found is not None:
                document.set_attributes(child, {'filename': f'file://{escape(str(found))}'})
        _set_meshes(document, child, urdf)


def _check(robot: Robot, urdf: str) -> None:
    """Raise ModelError if the result, read again, has other parameters."""
    found, wanted = _parameters(robot, urdf), robot.rigid_parameters.reshape(-1, PER_LINK)
    worst = np.max(np.abs(found - wanted), axis=1)
    scale = float(np.max(np.abs(wanted)))
    if np.any(worst > ROUNDING * scale):
        link = robot.links[int(np.argmax(worst))]
        raise ModelError(
            f"{robot.name}: the exported description has other parameters of link '{link}' when "
            f'read again: they differ by {worst.max():.3g}'
        )
