# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Loading of robots from shipped names, files and URDF text, and of their mounting files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
import math
import os
from pathlib import Path
import shlex
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import escape, quoteattr

from armid_ros.errors import meant, RobotError
from armid_ros.files import load_yaml, read_text, reading
from armid_ros.motion import FloatArray
from armid_ros.robots.coupling import couple, moving_joints
from armid_ros.robots.description import (
    Description,
    inertia_attributes,
    Joint,
    MOVABLE,
    parse_description,
    parse_xml,
    text_of,
)
from armid_ros.robots.mjcf import is_mjcf, urdf_of_mjcf
from armid_ros.robots.robot import description_name, joint_fields, parse_gravity, Robot
from armid_ros.robots.selection import driven_joints, several_arms, standing_position
from armid_ros.robots.xacro_expansion import expand_xacro
import numpy as np
import pinocchio as pin

_SHIPPED = {
    'humanoid_arm': (
        'humanoid_arm/humanoid_arm.urdf',
        '6-DOF humanoid arm, 2.8 kg, 0.6 m from shoulder to wrist',
    ),
    'humanoid_arm_loaded': (
        'humanoid_arm/humanoid_arm_loaded.urdf.xacro',
        'the humanoid arm with 0.3 kg in its hand',
    ),
    'human_legs': (
        'human_legs/human_legs.urdf',
        'legs and trunk of a man of 70.5 kg in the sagittal plane, stance foot fixed',
    ),
    'two_link_elastic': (
        'two_link_elastic/two_link_elastic.urdf',
        'two links in the horizontal plane with elastic joints, 1 m, 17 kg',
    ),
    'exoskeleton_legs': (
        'exoskeleton_legs/exoskeleton_legs.urdf',
        'exoskeleton of 12.25 kg that human_legs wears, stance foot fixed',
    ),
}


def shipped_robots() -> dict[str, str]:
    """
    Return the names and one-line descriptions of the robots shipped with the package.

    Returns
    -------
    dict of str to str
        Name and description.

    Examples
    --------
    >>> import armid_ros as ar
    >>> 'humanoid_arm' in ar.shipped_robots()
    True

    """
    return {name: description for name, (_, description) in _SHIPPED.items()}


def shipped_path(name: str) -> Path:
    """Return the path of the description file of a shipped robot."""
    return Path(str(resources.files('armid_ros.robots').joinpath(_SHIPPED[name][0])))


#: Prefix of a package folder among the arguments of a description.
PACKAGE = 'package:'


def load_robot(
    source: str | Path,
    *,
    gravity: str | Sequence[float] | FloatArray = 'earth',
    joints: Sequence[str] | None = None,
) -> Robot:
    """
    Load a robot from a shipped name, a URDF, xacro or MJCF file, or the text of a URDF.

    Parameters
    ----------
    source : str or Path
        A shipped name (see `shipped_robots`), the path of a URDF, xacro or MJCF file, or the text
        of a URDF, such as a /robot_description. Meshes need not exist. A xacro file is a program,
        which can read any file and the environment, so name only one that you trust. It is
        expanded in a separate process, for 20 s of processor time at most; a text is never
        expanded. Its packages are searched in enclosing folders, in ROS_PACKAGE_PATH and in
        AMENT_PREFIX_PATH. Arguments and folders of other packages may follow the path: 'arm.xacro
        tool:=true package:grippers:=../grippers'.
    gravity : str or array_like, shape (3,)
        'earth', 'moon', 'x,y,z' or a vector [m/s^2], in the frame of the base link.
    joints : sequence of str, optional
        The driven joints, in any order; the robot keeps the order of its description. By default,
        all revolute, continuous and prismatic joints except those of a gripper (mimic joints,
        joints they follow, names with finger, gripper or jaw). Other joints are locked at 0, or at
        their limit nearest to it, and their links become part of the body that carries them.

    Returns
    -------
    Robot
        Rigid body, driven joints and limits.

    Raises
    ------
    RobotError
        If the robot does not exist or its description is invalid. The message names the file and
        the line, link or joint.

    Examples
    --------
    >>> import armid_ros as ar
    >>> ar.load_robot('my_arm.urdf', gravity='moon').joints
    ('waist', 'shoulder', 'elbow')

    """
    if isinstance(source, str) and source.lstrip().startswith('<'):
        return robot_from_urdf(source, gravity=gravity, joints=joints)
    source, arguments, packages = _split_arguments(source)
    shipped = isinstance(source, str) and source in shipped_robots()
    path = shipped_path(str(source)) if shipped else Path(source).expanduser()
    if not os.path.lexists(path):
        guess = '; write arguments as NAME:=VALUE' if '.xacro ' in str(source) else ''
        guess = guess or meant(str(source), shipped_robots())
        raise RobotError(
            f'{source}: neither a file nor a shipped robot{guess}; shipped robots: '
            f'{", ".join(shipped_robots())}'
        )
    if path.is_dir():
        inside = path / 'model.yaml'
        file = inside if inside.is_file() else 'the URDF, xacro or MJCF file of the robot'
        raise RobotError(f'{source} is a folder, not a robot; give {file}, before the recordings')
    text = read_text(path, RobotError)
    notes: tuple[str, ...] = ()
    if is_mjcf(text) and not arguments:
        text, notes = urdf_of_mjcf(path)
    elif path.suffix == '.xacro' or '<xacro:' in text:
        text = expand_xacro(path, arguments, packages)
    elif arguments:
        raise RobotError(f'{path}: not a xacro file, so it takes no arguments')
    text = _with_mechanism(text, path)
    for name, folder in packages.items():
        text = text.replace(f'package://{name}/', f'file://{escape(folder)}/')
    robot = robot_from_urdf(text, gravity=gravity, joints=joints, source=str(source), path=path)
    return replace(robot, notes=notes + robot.notes)


def robot_from_urdf(
    text: str,
    *,
    gravity: str | Sequence[float] | FloatArray = 'earth',
    joints: Sequence[str] | None = None,
    source: str = 'robot description',
    path: Path | None = None,
) -> Robot:
    """
    Create a robot from the text of a URDF; see `load_robot`.

    Parameters
    ----------
    text : str
        The URDF.
    gravity, joints
        As for `load_robot`.
    source : str
        Name of the text in error messages.
    path : Path, optional
        File of the text; meshes and the SRDF are searched from its folder.

    Raises
    ------
    RobotError
        If the description is invalid.

    """
    with reading(source, RobotError):
        description = parse_description(parse_xml(text))
        driven = driven_joints(description, joints)
        model, locked = _kinematic_model(description, driven, {})
    model.gravity = pin.Motion(parse_gravity(gravity), np.zeros(3))
    moving = [description.by_name[name] for name in list(model.names)[1:]]
    model.lowerPositionLimit = np.array([joint.lower for joint in moving])
    model.upperPositionLimit = np.array([joint.upper for joint in moving])
    robot = Robot(
        **joint_fields(moving),
        name=description.name,
        model=model,
        links=tuple(joint.child for joint in moving),
        urdf=text,
        notes=(
            *description.inertia_doubts(),
            *description.notes,
            *locked,
            *several_arms(description, [joint.name for joint in driven]),
        ),
        path=path,
    )
    if not np.isfinite(robot.rigid_parameters).all():
        raise RobotError(
            f'{source}: masses, lengths or inertias are too large for floating-point numbers'
        )
    # joints without inertia in several poses cannot be simulated
    generator, moved = np.random.default_rng(0), np.zeros(robot.n_joints)
    for _ in range(4):
        q = generator.uniform(-math.pi, math.pi, robot.n_joints)
        moved = np.maximum(moved, np.abs(np.diag(pin.crba(model, model.createData(), q))))
    light = (
        f"link '{link}', moved by joint '{joint}', has no <inertial>, nor has any link after it. "
        'The inertia can be identified, but a simulation needs a rough value'
        for joint, link, inertia in zip(robot.joints, robot.links, moved, strict=True)
        if inertia < 1e-12  # kg m^2 or kg; the smallest motor rotor has 1e5 times as much
    )
    with reading(source, RobotError):
        return couple(replace(robot, notes=(*robot.notes, *light)), driven, {})


def _split_arguments(source: str | Path) -> tuple[str | Path, dict[str, str], dict[str, str]]:
    """Split 'arm.xacro tool:=true package:grippers:=/a/b' into path, arguments and packages."""
    if not isinstance(source, str) or ':=' not in source:
        return source, {}, {}
    first, *rest = shlex.split(source)
    arguments, packages = {}, {}
    for text in rest:
        name, assigned, value = text.partition(':=')
        if not assigned or not name:
            raise RobotError(f"{source}: '{text}' is not an argument; write name:=value")
        package = name.removeprefix(PACKAGE)
        if package == name:
            arguments[name] = value
        elif not Path(value).is_dir():
            raise RobotError(
                f"{source}: the folder of package '{package}' does not exist: {value}"
            )
        else:
            packages[package] = str(Path(value).resolve())
    return first, arguments, packages


def described_at(robot: Robot, positions: Mapping[str, float]) -> Robot:
    """
    Return the described robot with its undriven joints locked at given positions.

    Parameters
    ----------
    robot : Robot
        The robot; its inertias are replaced by those of the description, its gravity is kept.
    positions : mapping of str to float
        Positions of joints that are not driven [rad or m]. Mimic joints follow their leader.
        Joints that are not named keep the position that ``load_robot`` gives them.

    """
    description = robot.description
    driven = [description.by_name[joint] for joint in robot.joints]
    model, _ = _kinematic_model(description, driven, positions)
    tree = replace(robot.tree, model=model).with_gravity(robot.gravity)
    return tree if robot.mechanism is None else couple(tree, driven, positions)


def _kinematic_model(
    description: Description, driven: Sequence[Joint], known: Mapping[str, float]
) -> tuple[pin.Model, tuple[str, ...]]:
    """Return the Pinocchio model of the moving joints, with a note on each locked joint."""
    moving = moving_joints(description, [joint.name for joint in driven])
    positions = {
        joint.name: standing_position(description, joint, known)
        for joint in description.movable()
        if joint.name not in moving
    }
    notes = tuple(
        f"joint '{name}': not driven, locked at {position:g} {description.by_name[name].unit}"
        for name, position in positions.items()
        if description.by_name[name] not in driven
    )
    try:
        model = pin.buildModelFromXML(_kinematic_urdf(description, positions))
    except (RuntimeError, ValueError) as error:
        raise RobotError(' '.join(str(error).split())) from error
    return model, notes


def _kinematic_urdf(description: Description, positions: Mapping[str, float]) -> str:
    """Return a URDF for Pinocchio with locked joints fixed and continuous joints revolute."""
    root = ElementTree.Element('robot', name=description.name)
    for name, inertial in description.links.items():
        link = ElementTree.SubElement(root, 'link', name=name)
        if inertial is None:
            continue
        element = ElementTree.SubElement(link, 'inertial')
        ElementTree.SubElement(
            element, 'origin', xyz=text_of(inertial.xyz), rpy=text_of(inertial.rpy)
        )
        ElementTree.SubElement(element, 'mass', value=repr(inertial.mass))
        ElementTree.SubElement(element, 'inertia', inertia_attributes(inertial.tensor))
    for joint in description.joints:
        driven = joint.kind in MOVABLE and joint.name not in positions
        kind = 'prismatic' if joint.kind == 'prismatic' else 'revolute'
        xyz, rpy, position = joint.xyz, joint.rpy, positions.get(joint.name, 0.0)
        if position != 0.0:  # noqa: RUF069 - as given
            rotation, axis = pin.rpy.rpyToMatrix(*joint.rpy), np.array(joint.axis)
            if kind == 'prismatic':
                xyz = (np.array(joint.xyz) + rotation @ axis * position).tolist()
            else:
                rpy = pin.rpy.matrixToRpy(rotation @ pin.exp3(axis * position)).tolist()
        element = ElementTree.SubElement(
            root, 'joint', name=joint.name, type=kind if driven else 'fixed'
        )
        ElementTree.SubElement(element, 'origin', xyz=text_of(xyz), rpy=text_of(rpy))
        ElementTree.SubElement(element, 'parent', link=joint.parent)
        ElementTree.SubElement(element, 'child', link=joint.child)
        ElementTree.SubElement(element, 'axis', xyz=text_of(joint.axis))
        ElementTree.SubElement(element, 'limit', lower='-1', upper='1', effort='1', velocity='1')
    return ElementTree.tostring(root, encoding='unicode')


def read_mounting(robot: Robot) -> tuple[float | None, Path] | None:
    """
    Read the floor height from NAME.mounting.yaml next to a description; None without file.

    Returns
    -------
    floor : float or None
        Height of the floor above the origin of the base [m]; None: no floor is within reach.
    path : Path
        The mounting file.

    Raises
    ------
    RobotError
        If the file cannot be read, or does not contain `floor: HEIGHT` or `floor: none`.

    """
    if robot.path is None:
        return None
    path = robot.path.with_name(f'{description_name(robot.path)}.mounting.yaml')
    if not path.is_file():
        return None
    with reading(path, RobotError):
        content = load_yaml(read_text(path, RobotError))
    floor = content.get('floor') if isinstance(content, dict) else None
    if floor == 'none':
        return None, path
    if isinstance(floor, bool) or not isinstance(floor, int | float) or not math.isfinite(floor):
        raise RobotError(f'{path}: no valid floor; write floor: HEIGHT [m], or floor: none')
    return float(floor), path


def _with_mechanism(text: str, path: Path) -> str:
    """Add the coupled joints of NAME.mechanism.yaml, if it exists, to the text of NAME.urdf."""
    # other readers of a URDF ignore the additional elements
    path = path.with_name(f'{description_name(path)}.mechanism.yaml')
    if not path.is_file():
        return text
    with reading(path, RobotError):
        document = load_yaml(read_text(path, RobotError))
        if not isinstance(document, dict) or document.keys() - {'mimic', 'motors', 'loops'}:
            raise RobotError('the content has to be a mapping with keys mimic, motors or loops')
        try:
            lines = _elements(document, text)
        except (AttributeError, KeyError, TypeError) as error:
            raise RobotError(f'an entry of mimic, motors or loops is malformed: {error}') from None
    head, end, tail = text.rpartition('</robot>')
    return ''.join([head, *(f'  {line}\n' for line in lines), end, tail])


def _elements(document: Mapping[str, Any], urdf: str) -> list[str]:
    """Convert NAME.mechanism.yaml to URDF elements: mimic joints, motors and loops."""

    def tag(kind: str, /, *inside: str, **attributes: Any) -> str:
        pairs = ''.join(f' {key}={quoteattr(str(value))}' for key, value in attributes.items())
        return f'<{kind}{pairs}>{"".join(inside)}</{kind}>'

    root, lines = parse_xml(urdf), []
    carried = {child.get('link') for child in root.iterfind('joint/child')}
    base = next(
        link.get('name') for link in root.iterfind('link') if link.get('name') not in carried
    )
    for name, limits in (document.get('motors') or {}).items():
        ends = {'lower': -np.inf, 'upper': np.inf, 'effort': np.inf, 'velocity': np.inf}
        inside = tag('parent', link=base), tag('child', link=f'{name}_motor')
        limit = tag('limit', **(ends | (limits or {})))
        lines.append(tag('link', name=f'{name}_motor'))
        lines.append(tag('joint', *inside, limit, name=name, type='revolute'))
    for name, factors in (document.get('mimic') or {}).items():
        offset = factors.pop('offset', 0.0)
        for leader, factor in factors.items():
            values = {'joint': leader, 'multiplier': factor, 'offset': offset}
            lines.append(tag('mimic', follower=name, **values))
            offset = 0.0
    for loop in document.get('loops') or ():
        points = [
            tag('point', link=link, xyz=' '.join(map(str, xyz)))
            for link, xyz in loop['points'].items()
        ]
        lines.append(tag('loop', *points, passive=' '.join(loop['passive'])))
    return lines
