# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of the driven joints of a robot as a MuJoCo model (MJCF)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from armid_ros.model.pseudo_inertia import require_consistent
from armid_ros.robots import held_joints, Robot
from armid_ros.robots.description import text_of
from armid_ros.robots.geometry import shapes_of
import numpy as np
import pinocchio as pin

#: Suffixes of the mesh files that MuJoCo can read.
_MESHES = ('.stl', '.obj', '.msh')
#: Solver parameters of dry friction, as stiff as the time step of 2 ms allows. With the softer
#: default of MuJoCo, a slow joint of an arm has a tenth of its friction.
_FRICTION_SOLVER = {'solreffriction': '0.004 1', 'solimpfriction': '0.9999 0.9999 0.001 0.5 2'}
#: Contact attributes: visuals have no contacts; collision shapes have contacts with the
#: environment and not with each other, because neighbouring links overlap.
_CLASSES: dict[Literal['visual', 'collision'], dict[str, str]] = {
    'visual': {'contype': '0', 'conaffinity': '0', 'group': '2', 'mass': '0'},
    'collision': {'contype': '1', 'conaffinity': '0', 'group': '3', 'mass': '0'},
}


def export_mjcf(
    robot: Robot, values: Mapping[str, Mapping[str, float]], remarks: Sequence[str] = ()
) -> tuple[str, tuple[str, ...]]:
    """
    Return a MuJoCo model (MJCF) of a robot: links, shapes, joints and motors.

    Parameters
    ----------
    robot : Robot
        The arm, with its gravity.
    values : mapping of str to mapping of str to float
        'damping' [N m s/rad], 'frictionloss' [N m] and 'armature' [kg m^2], each by joint.
    remarks : sequence of str
        Lines of a comment in the file.

    Returns
    -------
    text : str
        MJCF with absolute paths of mesh files.
    left_out : tuple of str
        Parts of the description that the MJCF lacks; a comment in the file lists them too.

    Raises
    ------
    ModelError
        If the parameters of a link are not physically consistent.
    RobotError
        If a shape of the description is invalid.

    """
    require_consistent(robot.links, robot.rigid_parameters)
    root = ElementTree.Element('mujoco', model=robot.name)
    ElementTree.SubElement(root, 'compiler', angle='radian')
    ElementTree.SubElement(root, 'option', gravity=text_of(robot.gravity))
    defaults = ElementTree.SubElement(root, 'default')
    for of, contacts in _CLASSES.items():
        default = ElementTree.SubElement(defaults, 'default', {'class': of})
        ElementTree.SubElement(default, 'geom', contacts)
    assets = ElementTree.SubElement(root, 'asset')
    world = ElementTree.SubElement(root, 'worldbody')
    model = robot.model
    base = robot.base
    bodies = {0: world if base == 'world' else ElementTree.SubElement(world, 'body', name=base)}
    for index, joint in enumerate(robot.moving):
        identity = index + 1
        body = ElementTree.SubElement(
            bodies[model.parents[identity]],
            'body',
            {'name': robot.links[index]} | _place(model.jointPlacements[identity]),
        )
        bodies[identity] = body
        inertia = model.inertias[identity]
        upper = inertia.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        mass = {'pos': text_of(inertia.lever), 'mass': repr(float(inertia.mass))}
        ElementTree.SubElement(body, 'inertial', mass | {'fullinertia': text_of(upper)})
        ElementTree.SubElement(body, 'joint', _joint(robot.tree, index))
        for key, table in values.items():
            if table.get(joint):
                body[-1].set(key, repr(float(table[joint])))
        if 'frictionloss' in body[-1].attrib:
            body[-1].attrib.update(_FRICTION_SOLVER)
    left_out = [
        *_shapes(robot, bodies, assets),
        'contacts of links with each other',
        *(['velocity limits'] if np.any(np.isfinite(robot.velocity_limit)) else []),
        *(f'joint {joint.name}' for joint in held_joints(robot)),
        *_couplings(root, robot),
    ]
    lines = ''.join(
        f'\n    {line.replace("--", "- -")}'
        for line in (*remarks, f'without {", ".join(left_out)}')
    )
    root.insert(0, ElementTree.Comment(f'{lines}\n  '))
    actuators = ElementTree.SubElement(root, 'actuator')
    for joint in robot.joints:
        if joint in robot.moving:
            ElementTree.SubElement(actuators, 'motor', name=joint, joint=joint)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode') + '\n', tuple(left_out)


def _couplings(root: ElementTree.Element, robot: Robot) -> list[str]:
    """Add joint couplings and loops as constraints; return texts on unsupported couplings."""
    if robot.mechanism is None:
        return []
    tendons = ElementTree.SubElement(root, 'tendon')
    equal, left_out = ElementTree.SubElement(root, 'equality'), []
    for joint in robot.moving:
        mimic = robot.description.by_name[joint].mimic
        if mimic is None:
            continue
        if not set(mimic.multipliers) <= set(robot.moving):
            left_out.append(f'the coupling of joint {joint}, whose motors move no body')
            continue
        name = f'{joint}_coupling'
        fixed = ElementTree.SubElement(tendons, 'fixed', name=name)
        for leader, factor in {
            joint: 1.0,
            **{k: -x for k, x in mimic.multipliers.items()},
        }.items():
            ElementTree.SubElement(fixed, 'joint', joint=leader, coef=repr(factor))
        constant = text_of([mimic.offset, 0.0, 0.0, 0.0, 0.0])
        ElementTree.SubElement(equal, 'tendon', tendon1=name, polycoef=constant)
    for loop in robot.description.loops:
        frames = [robot.model.getFrameId(link, pin.FrameType.BODY) for link in loop.links]
        bodies = [robot.model.frames[frame].parentJoint for frame in frames]
        names = [robot.links[body - 1] if body else robot.base for body in bodies]
        place = robot.model.frames[frames[0]].placement.act(np.array(loop.points[0]))
        ends = dict(zip(('body1', 'body2'), names, strict=True))
        ElementTree.SubElement(equal, 'connect', ends, anchor=text_of(place))
    return left_out


def _shapes(
    robot: Robot, bodies: Mapping[int, ElementTree.Element], assets: ElementTree.Element
) -> list[str]:
    """Add the shapes of links to MJCF bodies; return the names of meshes MuJoCo cannot read."""
    left_out: dict[str, None] = {}
    files: dict[tuple[Path, tuple[float, ...]], str] = {}
    for of in _CLASSES:
        for shape in shapes_of(robot, of):
            if shape.kind in ('box', 'sphere'):  # half edges, or the radius
                share = 0.5 if shape.kind == 'box' else 1.0
                size = {'size': text_of([share * x for x in shape.size])}
            elif shape.kind != 'mesh':  # radius and half length
                size = {'size': text_of([shape.size[0], 0.5 * shape.size[1]])}
            else:
                if shape.path is None or shape.path.suffix.lower() not in _MESHES:
                    left_out[f'{of} mesh {shape.mesh.rsplit("/", 1)[-1]}'] = None
                    continue
                key = shape.path.resolve(), shape.size
                if key not in files:
                    files[key] = f'{shape.path.stem}_{len(files)}'
                    values = {'name': files[key], 'file': str(key[0]), 'inertia': 'shell'}
                    ElementTree.SubElement(assets, 'mesh', values, scale=text_of(shape.size))
                size = {'mesh': files[key]}
            body = bodies[robot.model.frames[shape.frame].parentJoint]
            values = {'class': of, 'type': shape.kind, **size, **_place(shape.placement)}
            ElementTree.SubElement(body, 'geom', values)
    return list(left_out)


def _place(placement: pin.SE3) -> dict[str, str]:
    """Return a placement as MJCF attributes: position and quaternion."""
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    return {'pos': text_of(placement.translation), 'quat': text_of([w, x, y, z])}


def _joint(robot: Robot, index: int) -> dict[str, str]:
    """Return a joint as MJCF attributes: type, axis and limits."""
    slides = bool(robot.prismatic[index])
    geometry = robot.geometry[index]
    attributes = {
        'name': robot.joints[index],
        'type': 'slide' if slides else 'hinge',
        'axis': text_of(geometry.slide if slides else geometry.turn),
    }
    lower, upper, limit = robot.lower[index], robot.upper[index], robot.torque_limit[index]
    if np.isfinite(lower) and np.isfinite(upper):
        attributes |= {'limited': 'true', 'range': text_of([lower, upper])}
    if np.isfinite(limit):
        attributes |= {'actuatorfrclimited': 'true', 'actuatorfrcrange': text_of([-limit, limit])}
    return attributes
