# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A verdict is only given with what was not checked, and never without."""

from dataclasses import replace
import re

from armid_ros.excitation import CollisionScene, fitness, Floor, Obstacle
from armid_ros.excitation.scene import FIT, PARTLY, UNFIT
from armid_ros.motion import Motion
from armid_ros.robots import collision_model, robot_from_urdf
import numpy as np
import pytest

from .conftest import TWO_LINKS, urdf

GROUND = Floor(0.0, np.array([0.0, 0.0, 1.0]), 'base plane')
PLANE = (Obstacle('floor', 'plane'),)


def unchecked(text=None, floor=GROUND, obstacles=PLANE, **limits):
    robot = replace(robot_from_urdf(text or urdf(*TWO_LINKS)), **limits)
    return CollisionScene(collision_model(robot), floor, obstacles, 0.01).unchecked


def without(tag):
    return re.sub(f'<{tag}>.*?</{tag}>', '', urdf(*TWO_LINKS), count=1)


MESH = '<mesh filename="nowhere/link.stl"/>'
CASES = {
    'floor': (
        {'floor': Floor(None, GROUND.up, 'given'), 'obstacles': ()},
        'floor.*none',
    ),
    'environment': (
        {
            'floor': Floor(None, GROUND.up, 'environment'),
            'obstacles': (Obstacle('post', 'sphere', (0.1,), (5.0, 0.0, 0.0)),),
        },
        'environment.*plane',
    ),
    'mesh': (
        {'text': urdf(*TWO_LINKS).replace('<cylinder radius="0.04" length="0.3"/>', MESH, 1)},
        'upper.*mesh',
    ),
    'collision': ({'text': without('collision')}, 'upper.*collision'),
    'a link fixed to a body': (
        {
            'text': urdf(*TWO_LINKS).replace(
                '</robot>',
                '<link name="tool"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/>'
                '</inertial></link><joint name="flange" type="fixed"><parent link="lower"/>'
                '<child link="tool"/></joint></robot>',
            )
        },
        'tool.*collision',
    ),
    'inertia': ({'text': without('inertial')}, 'upper.*inertia'),
    'position': (
        {'text': urdf(*TWO_LINKS).replace('lower="-2.5" upper="2.5"', '', 1)},
        'position of shoulder',
    ),
    'velocity': (
        {'velocity_limit': np.array([np.inf, 1.0])},
        'velocity of shoulder',
    ),
    'torque': ({'torque_limit': np.array([1.0, np.inf])}, 'torque of elbow'),
}


def test_of_a_whole_description_everything_is_checked():
    assert unchecked() == ()


def test_a_joint_that_is_described_as_turning_without_end_needs_no_limit():
    endless = urdf(*TWO_LINKS).replace('type="revolute"', 'type="continuous"', 1)
    assert unchecked(endless) == ()


@pytest.mark.parametrize('case', CASES)
def test_what_is_missing_is_named_and_is_in_the_verdict(case):
    options, words = CASES[case]
    (found,) = unchecked(**options)
    assert re.search(words, found)
    result = judged({'floor': GROUND, 'obstacles': PLANE, 'text': urdf(*TWO_LINKS), **options})
    assert result.word == PARTLY and FIT not in str(result)
    assert found in str(result)
    assert result.remedy.startswith('Give ')


def judged(options):
    """Judge an arm that holds still."""
    text, floor, obstacles = (options.pop(name) for name in ('text', 'floor', 'obstacles'))
    robot = replace(robot_from_urdf(text), **options)
    scene = CollisionScene(collision_model(robot), floor, obstacles, 0.01)
    rest = np.zeros((2, 2))
    motion = Motion(robot.joints, np.arange(2.0), rest, rest, rest)
    return fitness(motion, scene)


def swung(angle):
    """Look at an arm that swings down from zero to an angle of its shoulder."""
    robot = robot_from_urdf(urdf(*TWO_LINKS))
    q = np.column_stack([np.linspace(0.0, angle, 50), np.zeros(50)])
    motion = Motion(robot.joints, np.linspace(0.0, 1.0, 50), q, 0.0 * q, 0.0 * q)
    scene = CollisionScene(collision_model(robot), GROUND, PLANE, 0.01)
    return fitness(motion, scene)


def test_a_verdict_without_reserve_has_the_lowest_point_above_the_floor():
    result = swung(1.6)
    assert result.word == FIT
    assert result.lowest.link == 'lower' and result.lowest.time == 1.0
    assert result.lowest.height == pytest.approx(result.nearest.distance, abs=1e-6)
    assert f'{result.lowest.height:.3f} m' in str(result) and '(lower)' in str(result)


def test_what_goes_through_the_floor_is_never_fit_to_run():
    result = swung(2.2)
    assert 'Do not run' in result.remedy and 'below' in result.sentences()[0]
    assert result.word == UNFIT and 'below' in str(result) and '(lower)' in str(result)
