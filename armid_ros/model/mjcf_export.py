# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A MuJoCo model (MJCF) of the driven joints of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

from armid_ros.model.pseudo_inertia import require_consistent
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin


def export_mjcf(
    robot: Robot,
    *,
    damping: Mapping[str, float] | None = None,
    friction: Mapping[str, float] | None = None,
    armature: Mapping[str, float] | None = None,
    remarks: Sequence[str] = (),
) -> str:
    """
    Return a MuJoCo model of a robot: bodies, joints and motors, without shapes.

    Parameters
    ----------
    robot : Robot
        The arm, with its gravity.
    damping, friction, armature : mapping of str to float, optional
        Joint, and its viscous coefficient [N m s/rad], Coulomb torque [N m] or rotor inertia
        [kg m^2].
    remarks : sequence of str
        Lines to put into a comment.

    Returns
    -------
    str
        MJCF.

    Raises
    ------
    ModelError
        If the parameters of a link are not those of a body.

    """
    require_consistent(robot.links, robot.rigid_parameters)
    root = ElementTree.Element('mujoco', model=robot.name)
    if remarks:
        lines = ''.join(f'\n    {line.replace("--", "- -")}' for line in remarks)
        root.append(ElementTree.Comment(f'{lines}\n  '))
    ElementTree.SubElement(root, 'compiler', angle='radian')
    ElementTree.SubElement(root, 'option', gravity=_numbers(robot.gravity))
    world = ElementTree.SubElement(root, 'worldbody')
    model = robot.model
    bodies = {0: world}
    for index, joint in enumerate(robot.joints):
        identity = index + 1
        placement = model.jointPlacements[identity]
        x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
        body = ElementTree.SubElement(
            bodies[model.parents[identity]],
            'body',
            name=robot.links[index],
            pos=_numbers(placement.translation),
            quat=_numbers([w, x, y, z]),
        )
        bodies[identity] = body
        inertia = model.inertias[identity]
        tensor = inertia.inertia
        ElementTree.SubElement(
            body,
            'inertial',
            pos=_numbers(inertia.lever),
            mass=repr(float(inertia.mass)),
            fullinertia=_numbers(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
        )
        ElementTree.SubElement(body, 'joint', _joint(robot, index))
        for key, table in (
            ('damping', damping),
            ('frictionloss', friction),
            ('armature', armature),
        ):
            if table and table.get(joint):
                body[-1].set(key, repr(float(table[joint])))
    actuators = ElementTree.SubElement(root, 'actuator')
    for joint in robot.joints:
        ElementTree.SubElement(actuators, 'motor', name=joint, joint=joint)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode') + '\n'


def _joint(robot: Robot, index: int) -> dict[str, str]:
    """Return the attributes of a joint without its friction."""
    slides = bool(robot.prismatic[index])
    subspace = robot.model.joints[index + 1].createData().S
    subspace = np.asarray(getattr(subspace, 'matrix', lambda: subspace)()).reshape(6)
    attributes = {
        'name': robot.joints[index],
        'type': 'slide' if slides else 'hinge',
        'axis': _numbers(subspace[:3] if slides else subspace[3:]),
    }
    lower, upper, limit = robot.lower[index], robot.upper[index], robot.torque_limit[index]
    if np.isfinite(lower) and np.isfinite(upper):
        attributes |= {'limited': 'true', 'range': _numbers([lower, upper])}
    if np.isfinite(limit):
        attributes |= {'actuatorfrclimited': 'true', 'actuatorfrcrange': _numbers([-limit, limit])}
    return attributes


def _numbers(values: Sequence[float] | FloatArray) -> str:
    return ' '.join(repr(float(value)) for value in values)
