# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the floor of an arm is, who says so, and how low a motion comes."""

import re

from armid_ros.errors import TrajectoryError
from armid_ros.excitation import ClearanceModel, Floor, Obstacle, with_obstacles
from armid_ros.excitation.geometry.floor import (
    find_floor,
    floor_obstacles,
    link_heights,
    lowest_point,
)
from armid_ros.motion import Motion
from armid_ros.robots import collision_model, load_robot, robot_from_urdf, shipped_robots
import numpy as np
import pytest

from ..conftest import urdf
from .test_clearance import TETRAHEDRON

Z = np.array([0.0, 0.0, 1.0])
ABOVE = ('shoulder', 'revolute', 'base', 'upper', '0 0 0.3', '0 1 0', -2.5, 2.5, 60)
LOW = ('shoulder', 'revolute', 'base', 'upper', '0 0 0.15', '0 1 0', -2.5, 2.5, 60)
BELOW = ('shoulder', 'revolute', 'base', 'upper', '0 0 -0.2', '0 1 0', -2.5, 2.5, 60)
TURRET = ('turn', 'revolute', 'base', 'upper', '0 0 0.0', '0 0 1', -3, 3, 60)
ON_TURRET = ('lift', 'revolute', 'upper', 'lower', '0 0 0.3', '0 1 0', -2.5, 2.5, 30)

#: Shape of the links of `urdf`.
CYLINDER = '<cylinder radius="0.04" length="0.3"/>'


def bodies(*joints, **options):
    return collision_model(robot_from_urdf(urdf(*joints), **options))


def test_an_arm_that_stands_has_a_floor_at_its_base_plane():
    floor = find_floor(bodies(ABOVE))
    assert (floor.height, floor.source) == (0.0, 'base plane')
    np.testing.assert_array_equal(floor.up, Z)


@pytest.mark.parametrize('gravity', [(9.81, 0.0, 0.0), (0.0, 0.0, 9.81)], ids=['wall', 'ceiling'])
def test_an_arm_on_a_wall_or_a_ceiling_is_asked_for(gravity):
    with pytest.raises(TrajectoryError, match='gravity'):
        find_floor(bodies(ABOVE, gravity=gravity))


@pytest.mark.parametrize('mount', ['0 1.5708 0', '3.1416 0 0'], ids=['wall', 'ceiling'])
def test_a_mount_below_a_world_is_no_floor(mount):
    """The usual root link: its plane is the floor, and not what the arm is screwed to."""
    carried = (
        '<link name="world"/><joint name="mount" type="fixed"><parent link="world"/>'
        f'<child link="base"/><origin xyz="0 0 2.4" rpy="{mount}"/></joint></robot>'
    )
    collision = collision_model(robot_from_urdf(urdf(ABOVE).replace('</robot>', carried)))
    with pytest.raises(TrajectoryError, match=r'base.*(90|180) degrees'):
        find_floor(collision)
    assert find_floor(collision, '0').height == 0.0


@pytest.mark.parametrize('pedestal', ['', '<box size="0.2 0.2 0.1"/>'])
def test_an_arm_that_reaches_further_below_its_base_than_above_is_asked_for(pedestal):
    text = urdf(BELOW)
    if pedestal:
        body = f'<link name="base"><collision><geometry>{pedestal}</geometry></collision></link>'
        text = text.replace('<link name="base"/>', body)
    collision = collision_model(robot_from_urdf(text))
    with pytest.raises(TrajectoryError, match=r'0\.\d+ m.*upper.*--floor.*none'):
        find_floor(collision)
    assert find_floor(collision, 'none').height is None
    assert find_floor(collision, '-0.93').height == -0.93


@pytest.mark.parametrize('name', shipped_robots())
def test_shipped_robots_say_where_their_floor_is(name):
    floor = find_floor(collision_model(load_robot(name)))
    assert floor.source == f'{name}.mounting.yaml'


def test_what_is_given_counts_most_and_an_environment_more_than_a_guess():
    collision, table = bodies(ABOVE), Obstacle('table', 'box', (1, 1, 0.1))
    assert find_floor(collision, '0.1', [table]).height == 0.1
    assert find_floor(collision, None, [table]).source == 'environment'
    with pytest.raises(TrajectoryError, match="not 'low'"):
        find_floor(collision, 'low')


@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize(
    'shape',
    [
        CYLINDER,
        '<box size="0.1 0.2 0.3"/>',
        '<sphere radius="0.1"/>',
        '<mesh filename="{}" scale="0.2 0.2 0.2"/>',
    ],
)
def test_the_floor_is_where_its_height_and_normal_say(seed, shape, tmp_path):
    """The clearance of every link is its height above the floor, whatever way is up."""
    (tmp_path / 'rock.obj').write_text(TETRAHEDRON)
    rng = np.random.default_rng(seed)
    text = urdf(ABOVE, ON_TURRET).replace(CYLINDER, shape.format(tmp_path / 'rock.obj'))
    collision, up = collision_model(robot_from_urdf(text)), rng.normal(size=3)
    up /= np.linalg.norm(up)
    floor = Floor(-3.0, up, 'given')
    model = ClearanceModel.of(
        with_obstacles(collision_without_pairs(collision), floor_obstacles(collision, floor, 0.0))
    )
    q = rng.uniform(-2.0, 2.0, (20, 2))
    lowest = np.min([low for _, low, _ in link_heights(collision, up, q)], axis=0)
    np.testing.assert_allclose(model.smallest(q), lowest + 3.0, atol=1e-6)


def collision_without_pairs(collision):
    geometry = collision.geometry.copy()
    geometry.removeAllCollisionPairs()
    return type(collision)(collision.robot, geometry)


def test_a_turret_may_stand_on_the_floor_and_what_it_carries_may_not():
    collision = bodies(TURRET, ON_TURRET)
    floor = find_floor(collision)
    (obstacle,) = floor_obstacles(collision, floor, 0.01)
    assert obstacle.ignore == ('upper',)


@pytest.mark.parametrize('bare', [('lower',), ('upper', 'lower')])
def test_a_pose_that_is_clear_of_the_floor_is_above_it_with_links_that_have_no_body(bare):
    """What is said of a run is what a search has kept."""
    text = urdf(LOW, ON_TURRET)
    for link in bare:
        body = rf'(<link name="{link}">.*?)<collision>.*?</collision>'
        text = re.sub(body, r'\1', text, count=1, flags=re.DOTALL)
    collision = collision_model(robot_from_urdf(text))
    assert len(collision.geometry.geometryObjects) == 2 - len(bare)
    floor = find_floor(collision)
    around = floor_obstacles(collision, floor, 0.01)
    model = ClearanceModel.of(with_obstacles(collision, around))
    clear = []
    for pose in np.random.default_rng(0).uniform(-2.5, 2.5, (200, 1, 2)):
        motion = Motion(collision.robot.joints, np.zeros(1), pose, 0.0 * pose, 0.0 * pose)
        above = lowest_point(collision, floor.up, motion, around[0].ignore).height > 0.0
        clear.append(model.closest(motion).distance > 0.0)
        assert above or not clear[-1]
    assert 20 < sum(clear) < 180


def test_the_lowest_point_is_that_of_the_link_and_the_time():
    collision = bodies(ABOVE)
    t = np.linspace(0.0, 1.0, 101)
    q = (2.0 * np.sin(np.pi * t))[:, np.newaxis]
    motion = Motion(collision.robot.joints, t, q, 0.0 * q, 0.0 * q)
    lowest = lowest_point(collision, Z, motion)
    assert lowest.link == 'upper' and lowest.time == pytest.approx(0.5)
    assert lowest.height < 0.2
    assert lowest_point(collision, Z, motion, exempt=['upper']).link == ''
