# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The leg pair free to walk: both machines hang from their hips, which nothing holds.

A description of a body on one foot is hung up anew by its trunk: two slides and a hinge from the
ground to the trunk, then hip, knee and ankle of either leg. Bodies, inertias and anatomical angles
stay what they are; only the root moves from the foot to the hips, so that either foot can stand.

"""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

from armid_ros.model.spring_ties import centroid_ties
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.assumptions import read_assumptions
from armid_ros.papers.exo.plant.leg_pair import TiedPair
from armid_ros.papers.exo.plant.walkable import LegLength
from armid_ros.robots import load_robot, Robot
from armid_ros.robots.load import robot_from_urdf
import numpy as np
import numpy.typing as npt

SIDES = ('right', 'left')
#: What carries the trunk: way forward and up [m], lean [rad].
FLOATING = ('forward', 'up', 'lean')
_LEG = ('hip', 'knee', 'ankle')
#: Links of a leg and their axes: flexion and dorsiflexion are positive.
_LINKS, _AXES = ('thigh', 'shank', 'foot'), ('0 -1 0', '0 1 0', '0 -1 0')
#: Springs of a walking pair, as many as there are thighs and shanks.
SEGMENTS = tuple(f'{side}_{link}' for side in SIDES for link in ('shank', 'thigh'))


def walker(robot: Robot) -> Robot:
    """
    Hang a body on one foot from its trunk.

    Parameters
    ----------
    robot : Robot
        A shipped body, such as human_legs.

    Returns
    -------
    Robot
        With the joints forward, up and lean of the trunk, and hip, knee and ankle of both legs,
        each with the prefix of the body.

    """
    prefix = robot.joints[0].split('_')[0]
    root = ElementTree.Element('robot', name=robot.name.replace('legs', 'walker'))
    ElementTree.SubElement(root, 'link', name=f'{prefix}_ground')
    parent = f'{prefix}_ground'
    axes = ('1 0 0', '0 0 1', '0 1 0')
    trunk = _inertial(robot, f'{prefix}_stance_hip')
    for name, axis in zip(FLOATING, axes, strict=True):
        child = f'{prefix}_trunk' if name == 'lean' else f'{prefix}_{name}_slide'
        _joint(root, f'{prefix}_{name}', parent, child, axis, 0.0, slides=name != 'lean')
        _link(root, child, trunk if name == 'lean' else None)
        parent = child
    lengths = leg_length(robot)
    for side in SIDES:
        parent = f'{prefix}_trunk'
        ends = (0.0, -lengths.thigh, -lengths.shank)
        for joint, link, axis, end in zip(_LEG, _LINKS, _AXES, ends, strict=True):
            child = f'{prefix}_{side}_{link}'
            _joint(root, f'{prefix}_{side}_{joint}', parent, child, axis, end)
            _link(root, child, _inertial(robot, f'{prefix}_swing_{joint}'))
            parent = child
    return robot_from_urdf(ElementTree.tostring(root, encoding='unicode'), source=robot.name)


def leg_length(robot: Robot) -> LegLength:
    """Return the lengths of the legs of a shipped body, on one foot or free to walk."""
    assumed = read_assumptions()['segment_length'].value
    prefix = robot.joints[0].split('_')[0]
    side = 'right' if f'{prefix}_right_knee' in robot.joints else 'swing'
    knee, ankle = (
        robot.model.jointPlacements[robot.index(f'{prefix}_{side}_{joint}') + 1].translation
        for joint in ('knee', 'ankle')
    )
    return LegLength(float(-knee[2]), float(-ankle[2]), float(assumed['foot']))


def walking_pair(stiffness: npt.ArrayLike | None = None) -> TiedPair:
    """
    Return the shipped pair with springs at both shanks and thighs, free to walk.

    Parameters
    ----------
    stiffness : array_like, optional
        Of all springs or of each [N/m]; by default what ``assumptions.yaml`` has.

    """
    exo, human = (walker(load_robot(name)) for name in ('exoskeleton_legs', 'human_legs'))
    moved = {'shank': 'knee', 'thigh': 'hip'}
    joints = [f'{s.split("_")[0]}_{moved[s.split("_")[1]]}' for s in SEGMENTS]
    ties = centroid_ties(exo, human, [(f'exo_{j}', f'human_{j}') for j in joints])
    named = tuple(replace(tie, name=s) for tie, s in zip(ties, SEGMENTS, strict=True))
    if stiffness is None:
        stiffness = read_assumptions()['interaction_stiffness'].value
    return TiedPair(exo, human, named, np.asarray(stiffness, dtype=float))


def columns(robot: Robot, side: str) -> list[int]:
    """Return where hip, knee and ankle of a leg are among the joints."""
    prefix = robot.joints[0].split('_')[0]
    return [robot.index(f'{prefix}_{side}_{joint}') for joint in _LEG]


def floating(robot: Robot) -> list[int]:
    """Return where forward, up and lean of the trunk are among the joints."""
    prefix = robot.joints[0].split('_')[0]
    return [robot.index(f'{prefix}_{name}') for name in FLOATING]


def contacts(robot: Robot, leg: LegLength) -> tuple[list[str], FloatArray]:
    """Return joints and points of right heel, right toe, left heel and left toe, (4, 3) [m]."""
    prefix = robot.joints[0].split('_')[0]
    ankles = [f'{prefix}_{side}_ankle' for side in SIDES for _ in range(2)]
    return ankles, np.tile([[0.0, 0.0, 0.0], [leg.foot, 0.0, 0.0]], (2, 1))


def _inertial(robot: Robot, joint: str) -> tuple[float, FloatArray, FloatArray]:
    body = robot.model.inertias[robot.index(joint) + 1]
    return float(body.mass), np.array(body.lever), np.array(body.inertia)


def _link(
    root: ElementTree.Element, name: str, body: tuple[float, FloatArray, FloatArray] | None
) -> None:
    link = ElementTree.SubElement(root, 'link', name=name)
    if body is None:
        return
    mass, lever, inertia = body
    parts = ElementTree.SubElement(link, 'inertial')
    ElementTree.SubElement(parts, 'origin', xyz=' '.join(map(repr, lever.tolist())))
    ElementTree.SubElement(parts, 'mass', value=repr(mass))
    names = {'ixx': (0, 0), 'ixy': (0, 1), 'ixz': (0, 2), 'iyy': (1, 1), 'iyz': (1, 2)}
    entries = {key: repr(float(inertia[place])) for key, place in names.items()}
    ElementTree.SubElement(parts, 'inertia', {**entries, 'izz': repr(float(inertia[2, 2]))})


def _joint(
    root: ElementTree.Element,
    name: str,
    parent: str,
    child: str,
    axis: str,
    up: float,
    *,
    slides: bool = False,
) -> None:
    kind = 'prismatic' if slides else 'revolute'
    joint = ElementTree.SubElement(root, 'joint', name=name, type=kind)
    ElementTree.SubElement(joint, 'origin', xyz=f'0 0 {up!r}')
    ElementTree.SubElement(joint, 'parent', link=parent)
    ElementTree.SubElement(joint, 'child', link=child)
    ElementTree.SubElement(joint, 'axis', xyz=axis)
    far = '1000' if slides else '3.2'
    ElementTree.SubElement(
        joint, 'limit', lower=f'-{far}', upper=far, velocity='100', effort='1e6'
    )
