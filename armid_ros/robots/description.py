# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reading of the kinematic tree in a URDF; errors name the faulty link or joint."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
import math
from xml.etree import ElementTree
from xml.parsers import expat

from armid_ros.errors import RobotError
from armid_ros.files.documents import LARGEST
from armid_ros.files.regular import TEXT_LIMIT
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

MOVABLE = ('revolute', 'continuous', 'prismatic')
JOINT_TYPES = (*MOVABLE, 'fixed', 'floating', 'planar')

Vector = tuple[float, float, float]
#: Components of an inertia, in the order of a URDF.
INERTIA = ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')


def text_of(numbers: npt.ArrayLike) -> str:
    """Format one or several numbers as the value of an XML attribute, with all digits."""
    return ' '.join(repr(float(number)) for number in np.ravel(numbers))


def inertia_attributes(tensor: FloatArray) -> dict[str, str]:
    """Return an inertia (3, 3) [kg m^2] as the attributes ixx to izz of a URDF."""
    values = tensor[np.triu_indices(3)]
    return {name: text_of(value) for name, value in zip(INERTIA, values, strict=True)}


@dataclass(frozen=True)
class Inertial:
    """Mass [kg], pose of the centre of mass [m, rad] and inertia [kg m^2] of a link."""

    mass: float
    xyz: Vector
    rpy: Vector
    inertia: tuple[float, ...]

    @property
    def tensor(self) -> FloatArray:
        """Inertia about the centre of mass, along the axes of `rpy`, shape (3, 3) [kg m^2]."""
        ixx, ixy, ixz, iyy, iyz, izz = self.inertia
        return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])

    def doubt(self) -> str | None:
        """Return why this inertia is physically impossible; None if the inertia is possible."""
        moments = np.linalg.eigvalsh(self.tensor)
        # descriptions have six digits; moments below 1e-12 kg m^2 are negligible
        tolerance = max(1e-6 * float(np.abs(moments).max()), 1e-12)
        shown = ', '.join(f'{moment:.3g}' for moment in moments)
        if self.mass < 0.0 or moments[0] < -tolerance:
            return f'negative mass or inertia (m = {self.mass:g} kg, moments {shown} kg m^2)'
        if moments[0] + moments[1] < moments[2] - tolerance:
            sum_in_words = shown.replace(', ', ' + ', 1).replace(', ', ' < ')
            why = 'the principal moments violate the triangle inequality'
            return f'impossible inertia, {sum_in_words} kg m^2: {why}'
        if self.mass == 0.0 and moments[2] > 0.0:  # noqa: RUF069 - as described
            return f'an inertia without a mass (moments {shown} kg m^2)'
        return None


@dataclass(frozen=True)
class Mimic:
    """Relation of a mimic joint to its leaders: position = offset + sum of multiplier x leader."""

    multipliers: Mapping[str, float]
    offset: float

    @property
    def joint(self) -> str:
        """Name of the leader joint, or of the first of several leader joints."""
        return next(iter(self.multipliers))


@dataclass(frozen=True)
class Loop:
    """Closed kinematic loop: coincident points of two links [m], and the passive joints."""

    links: tuple[str, str]
    points: tuple[Vector, Vector]
    passive: tuple[str, ...]


@dataclass(frozen=True)
class Joint:
    """Joint of a URDF with its limits, which are infinite if missing."""

    name: str
    kind: str
    parent: str
    child: str
    xyz: Vector
    rpy: Vector
    axis: Vector
    lower: float
    upper: float
    velocity: float
    effort: float
    damping: float
    friction: float
    mimic: Mimic | None

    @property
    def unit(self) -> str:
        """Unit of the joint position: 'rad' or 'm'."""
        return 'm' if self.kind == 'prismatic' else 'rad'


@dataclass(frozen=True)
class Description:
    """Content of a URDF in file order: links with inertial data, joints and closed loops."""

    name: str
    links: dict[str, Inertial | None]
    joints: tuple[Joint, ...]
    notes: tuple[str, ...]
    loops: tuple[Loop, ...] = ()

    @property
    def passive(self) -> tuple[str, ...]:
        """Names of the passive joints, whose positions follow from closed loops."""
        return tuple(dict.fromkeys(joint for loop in self.loops for joint in loop.passive))

    def movable(self) -> tuple[Joint, ...]:
        """Return the revolute, continuous and prismatic joints."""
        return tuple(joint for joint in self.joints if joint.kind in MOVABLE)

    def inertia_doubts(self) -> tuple[str, ...]:
        """Return a line of text for each link with a physically impossible inertia."""
        doubts = {link: inertial.doubt() for link, inertial in self.links.items() if inertial}
        return tuple(f"link '{link}': {doubt}" for link, doubt in doubts.items() if doubt)

    @cached_property
    def by_name(self) -> Mapping[str, Joint]:
        """Joints of the URDF, by name."""
        return {joint.name: joint for joint in self.joints}


def parse_xml(text: str) -> ElementTree.Element:
    """
    Return the root element of a URDF; a RobotError names the line of malformed XML.

    Namespace prefixes need no declaration, because tools add attributes without declaring them.

    """
    if len(text) > TEXT_LIMIT:
        raise RobotError(f'the URDF has {len(text)} characters; the maximum is {TEXT_LIMIT}')
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text, True)
        root = builder.close()
    except ValueError as error:  # unknown encoding or invalid characters
        raise RobotError(f'malformed XML: {error}') from None
    except expat.ExpatError as error:
        reason = str(error).split(':')[0]
        raise RobotError(
            f'malformed XML at line {error.lineno}, column {error.offset + 1}: {reason}'
        ) from None
    if root.tag != 'robot':
        hints = {'mujoco': 'an MJCF is loaded by its path'}
        hints['mujocoinclude'] = 'load the MJCF that includes it'
        hint = f'; {hints[root.tag]}' if root.tag in hints else ''
        raise RobotError(f'not a URDF: its root element is <{root.tag}>, not <robot>{hint}')
    return root


#: Name of a parent link that means the ground in Drake, Bullet and Gazebo; it needs no <link>.
GROUND = 'world'


def parse_description(root: ElementTree.Element) -> Description:
    """
    Return links, joints and closed loops of a URDF.

    Raises
    ------
    RobotError
        If the URDF is invalid (a name used twice, a missing link, a loop, more than one root, a
        value that is not a number) or a joint is floating or planar. The message names the link or
        joint.

    """
    notes: list[str] = []
    links: dict[str, Inertial | None] = {}
    for element in root.findall('link'):
        name = _name(element, links)
        links[name] = _inertial(element, name)
    if not links:
        raise RobotError('not a URDF: <robot> has no links')
    joints: dict[str, Joint] = {}
    for element in root.findall('joint'):
        name = _name(element, joints)
        joints[name] = _joint(element, name, notes)
    for element in root.findall('mimic'):
        name = element.get('follower', '')
        if name not in joints:
            raise RobotError(f"a <mimic> names the follower joint '{name}', which does not exist")
        mimic = _mimic(element, f"joint '{name}'", joints[name].mimic)
        joints[name] = replace(joints[name], mimic=mimic)
    if GROUND not in links and any(joint.parent == GROUND for joint in joints.values()):
        notes.append(f"link '{GROUND}' is not in the file; assumed to be the ground")
        links = {GROUND: None, **links}
    _check_tree(links, joints.values())
    return Description(
        name=root.get('name') or 'robot',
        links=links,
        joints=tuple(joints.values()),
        notes=tuple(notes),
        loops=tuple(_loop(element, links, joints) for element in root.findall('loop')),
    )


def _loop(element: ElementTree.Element, links: Iterable[str], joints: Mapping[str, Joint]) -> Loop:
    ends = [(end.get('link', ''), _vector(end, 'xyz', 'a <loop>')) for end in element]
    passive = tuple(element.get('passive', '').split())
    unknown = [link for link, _ in ends if link not in links]
    unknown += [name for name in passive if name not in joints or joints[name].kind not in MOVABLE]
    if len(ends) != 2 or not passive or unknown:
        raise RobotError(
            'a <loop> needs two points of links and the passive movable joints that close it'
            + (f"; '{unknown[0]}' is not among the links and joints" if unknown else '')
        )
    return Loop((ends[0][0], ends[1][0]), (ends[0][1], ends[1][1]), passive)


def _mimic(element: ElementTree.Element, where: str, known: Mimic | None) -> Mimic:
    """Add the leader in a <mimic> element to the mimic relation `known` of a joint."""
    joint = element.get('joint', '')
    before = {} if known is None else dict(known.multipliers)
    before[joint] = before.get(joint, 0.0) + _number(element, 'multiplier', where, 1.0)
    offset = _number(element, 'offset', where, 0.0)
    return Mimic(before, offset + (0.0 if known is None else known.offset))


def _check_tree(links: Iterable[str], joints: Iterable[Joint]) -> None:
    """Raise RobotError if links and joints do not form a tree with a single base link."""
    carriers: dict[str, Joint] = {}  # joint above each link
    for joint in joints:
        for role, link in (('parent', joint.parent), ('child', joint.child)):
            if link not in links:
                raise RobotError(
                    f"joint '{joint.name}' has the {role} link '{link}', which does "
                    f'not exist; links: {", ".join(links)}'
                )
        if joint.child in carriers:
            raise RobotError(
                f"link '{joint.child}' is the child of two joints, "
                f"'{carriers[joint.child].name}' and '{joint.name}'; a URDF is a tree"
            )
        carriers[joint.child] = joint
    roots = [link for link in links if link not in carriers]
    if len(roots) > 1:
        raise RobotError(
            f'{len(roots)} links have no parent joint ({", ".join(roots)}); only the base link '
            'may have none'
        )
    depth = dict.fromkeys(links, 0)
    above = {link: [joint.parent] for link, joint in carriers.items()}
    try:
        for link in TopologicalSorter(above).static_order():
            depth[link] = depth[carriers[link].parent] + 1 if link in carriers else 0
    except CycleError as error:
        raise RobotError(
            f"link '{error.args[1][0]}' is part of a closed loop of joints; a URDF is a tree"
        ) from None
    deepest = max(depth, key=depth.__getitem__)
    most = 500  # the reader of Pinocchio is recursive
    if depth[deepest] > most:
        raise RobotError(
            f"link '{deepest}' is {depth[deepest]} joints from the base; the maximum is {most}"
        )


def _name(element: ElementTree.Element, taken: Iterable[str]) -> str:
    name = element.get('name')
    if not name:
        raise RobotError(f'a <{element.tag}> of the URDF has no name; add name="..."')
    if name in taken:
        raise RobotError(f"two {element.tag}s are named '{name}'; rename one")
    return name


def _inertial(link: ElementTree.Element, name: str) -> Inertial | None:
    element = link.find('inertial')
    if element is None:
        return None
    link_name = f"link '{name}'"
    mass, inertia = element.find('mass'), element.find('inertia')
    if mass is None or inertia is None:
        missing = 'mass' if mass is None else 'inertia'
        raise RobotError(f'{link_name}: its <inertial> has no <{missing}>; add this element')
    xyz, rpy = _origin(element, link_name)
    inertial = Inertial(
        mass=_number(mass, 'value', link_name),
        xyz=xyz,
        rpy=rpy,
        inertia=tuple(
            _number(inertia, key, link_name, None if key[1] == key[2] else 0.0) for key in INERTIA
        ),
    )
    if inertial.mass < 0.0:
        raise RobotError(
            f'{link_name} has a negative mass, {inertial.mass:g} kg: correct the mass, or export '
            'the URDF of an identification with --physical'
        )
    return inertial


def _joint(element: ElementTree.Element, name: str, notes: list[str]) -> Joint:
    joint = f"joint '{name}'"
    kind = element.get('type', '')
    if kind not in JOINT_TYPES:
        raise RobotError(f"{joint} has the type '{kind}', not {', '.join(JOINT_TYPES)}")
    if kind in ('floating', 'planar'):
        raise RobotError(
            f"{joint} is {kind}, but an arm needs a fixed base: set type='fixed' in this joint, "
            'or give a URDF of the arm alone'
        )
    xyz, rpy = _origin(element, joint)
    axis = element.find('axis')
    x, y, z = (1.0, 0.0, 0.0) if axis is None else _vector(axis, 'xyz', joint)
    length = math.hypot(x, y, z)
    if length < 1e-100:  # a zero vector cannot be normalised
        if kind in MOVABLE:
            raise RobotError(f'{joint}: its <axis> is a zero vector; correct the axis')
        x, y, z, length = 1.0, 0.0, 0.0, 1.0
    lower, upper, velocity, effort = _limits(element, kind, joint, notes)
    mimic, followed = None, element.find('mimic')
    if followed is not None:
        mimic = _mimic(followed, joint, None)
    dynamics = element.find('dynamics')
    damping, friction = (
        0.0 if dynamics is None else _number(dynamics, key, joint, 0.0)
        for key in ('damping', 'friction')
    )
    return Joint(
        name=name,
        kind=kind,
        parent=_link(element, 'parent', joint),
        child=_link(element, 'child', joint),
        xyz=xyz,
        rpy=rpy,
        axis=(x / length, y / length, z / length),
        lower=lower,
        upper=upper,
        velocity=velocity,
        effort=effort,
        damping=damping,
        friction=friction,
        mimic=mimic,
    )


def _limits(
    element: ElementTree.Element, kind: str, joint: str, notes: list[str]
) -> tuple[float, float, float, float]:
    limit = element.find('limit')
    if kind not in MOVABLE or limit is None:
        if kind in ('revolute', 'prismatic'):
            notes.append(f'{joint}: no <limit>; assumed unlimited')
        return -math.inf, math.inf, math.inf, math.inf
    rates = []
    for name in ('velocity', 'effort'):
        rate = abs(_number(limit, name, joint, math.inf, endless=True))
        if rate == 0.0:  # noqa: RUF069 - as described
            notes.append(f'{joint}: {name} limit 0; assumed unlimited')
            rate = math.inf
        rates.append(rate)
    if kind == 'continuous':
        return -math.inf, math.inf, rates[0], rates[1]
    lower = _number(limit, 'lower', joint, 0.0, endless=True)
    upper = _number(limit, 'upper', joint, 0.0, endless=True)
    if lower > upper:
        raise RobotError(f'{joint}: its lower limit {lower:g} is above its upper limit {upper:g}')
    if lower == upper:
        notes.append(f'{joint}: no range of motion in <limit>; assumed unlimited')
        lower, upper = -math.inf, math.inf
    return lower, upper, rates[0], rates[1]


def _link(element: ElementTree.Element, role: str, joint: str) -> str:
    reference = element.find(role)
    link = None if reference is None else reference.get('link')
    if not link:
        raise RobotError(f'{joint} has no {role} link; add <{role} link="...">')
    return link


def _origin(element: ElementTree.Element, where: str) -> tuple[Vector, Vector]:
    origin = element.find('origin')
    if origin is None:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return _vector(origin, 'xyz', where), _vector(origin, 'rpy', where)


def _vector(element: ElementTree.Element, name: str, where: str) -> Vector:
    """Read three numbers from an XML attribute; zeros if the attribute is missing."""
    text = element.get(name, '0 0 0')
    attribute = f"{where}: {name}='{text}' of <{element.tag}>"
    try:
        x, y, z = (float(number) for number in text.split())
    except ValueError:
        x = y = z = math.nan
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise RobotError(f'{attribute} is not three finite numbers')
    if max(abs(x), abs(y), abs(z)) > LARGEST:
        raise RobotError(f'{attribute} has an absolute value above {LARGEST:g}')
    return x, y, z


def _number(
    element: ElementTree.Element,
    name: str,
    where: str,
    default: float | None = None,
    *,
    endless: bool = False,
) -> float:
    """Read a number from an XML attribute; infinity is allowed only if `endless` is True."""
    text = element.get(name, '' if default is None else repr(default))
    attribute = f"{where}: {name}='{text}' of <{element.tag}>"
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise RobotError(f'{attribute} is not a number')
    if not endless and math.isinf(number):
        raise RobotError(f'{attribute} is not finite')
    if not endless and abs(number) > LARGEST:
        raise RobotError(f'{attribute} has an absolute value above {LARGEST:g}')
    return number
