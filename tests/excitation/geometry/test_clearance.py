# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Distances, their derivatives, obstacles, and the proof that a path is clear."""

from pathlib import Path

from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    ClearanceModel,
    FourierTrajectory,
    load_environment,
    Obstacle,
    with_obstacles,
)
from armid_ros.robots import collision_model, load_robot
import numpy as np
import pinocchio as pin
import pytest

from tests.clearance import path_clearance

TETRAHEDRON = 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n'


@pytest.fixture(scope='module')
def poses(humanoid):
    return np.random.default_rng(0).uniform(humanoid.lower, humanoid.upper, (60, 6))


@pytest.fixture(scope='module')
def clearance(humanoid_collision):
    return ClearanceModel.of(humanoid_collision)


def test_an_obstacle_is_checked_against_the_moving_links_alone():
    """Of arms of any length: the list of bodies moves in memory as it grows."""
    for count in (1, 2, 3, 4, 7, 8, 9, 16, 17, 33):
        text = '<robot name="r">' + ''.join(
            f'<link name="l{k}"><collision><geometry><sphere radius="0.1"/></geometry></collision>'
            '</link>'
            for k in range(count + 1)
        )
        text += ''.join(
            f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
            '<origin xyz="0 0 1"/></joint>'
            for k in range(count)
        )
        bodies = collision_model(load_robot(text + '</robot>'))
        obstacles = [Obstacle('floor', 'plane'), Obstacle('post', 'sphere', size=(0.1,))]
        pairs = with_obstacles(bodies, obstacles).geometry.collisionPairs
        around = [(int(p.first), int(p.second)) for p in pairs if p.second > count]
        assert around == [(k, n) for n in (count + 1, count + 2) for k in range(1, count + 1)]


def test_smallest_distance_is_the_collision_models(clearance, humanoid_collision, poses):
    ours = clearance.smallest(poses)
    np.testing.assert_allclose(ours, path_clearance(humanoid_collision, poses), atol=1e-6)


def test_near_pairs_are_all_pairs_within_reach(clearance, poses):
    near = clearance.near(poses, 0.2)
    expected = np.minimum(clearance.smallest(poses), 0.2)
    found = np.full(len(poses), 0.2)
    np.minimum.at(found, near.sample, near.distance)
    np.testing.assert_allclose(found, expected, atol=1e-6)  # what coal measures to


def test_levers_bound_how_fast_distances_change(clearance, poses):
    rng = np.random.default_rng(1)
    moved = poses + rng.uniform(-0.05, 0.05, poses.shape)
    sample, pair = np.divmod(np.arange(len(poses) * len(clearance.pairs)), len(clearance.pairs))
    change = np.abs(
        clearance._measure(moved, sample, pair)[0] - clearance._measure(poses, sample, pair)[0]
    )
    allowed = (clearance.levers[pair] * np.abs(moved - poses)[sample]).sum(axis=1)
    assert np.all(change <= allowed + 1e-6)


def sweep(two_link):
    """Swing the shoulder from -1 to 1 rad and back in 4 s."""
    a = np.array([[np.pi / 2], [0.0]])
    return FourierTrajectory(two_link.joints, 4.0, np.zeros(2), a, np.zeros((2, 1)))


def in_outer_link(two_link, angle):
    """Return the middle of the outer link at a shoulder angle, in the base frame."""
    data = two_link.model.createData()
    pin.forwardKinematics(two_link.model, data, np.array([angle, 0.0]))
    return tuple(data.oMi[2].act(np.array([0.0, 0.0, 0.15])))


def test_post_between_two_samples_is_found(two_link):
    post = Obstacle('post', 'sphere', (0.002,), in_outer_link(two_link, 0.43))
    blocked = with_obstacles(collision_model(two_link), [post])
    clearance = ClearanceModel.of(blocked, 0.01)
    path = sweep(two_link)
    coarse = np.linspace(0.0, 4.0, 9)
    assert clearance.smallest(path.motion(coarse).q).min() > 0.05
    fault = clearance.first_fault(path.motion, path.acceleration_bound(), coarse)
    assert {fault.first, fault.second} == {'lower', 'post'}
    assert fault.distance < 0.01
    there = clearance.smallest(path.motion(np.array([fault.time])).q)
    np.testing.assert_allclose(there, fault.distance, atol=1e-9)


@pytest.mark.parametrize(
    ('kind', 'size', 'near'),
    [
        ('sphere', (0.1,), 0.1),
        ('box', (0.2, 0.3, 0.2), 0.1),
        ('cylinder', (0.5, 0.2), 0.1),
        ('plane', (), 0.0),
    ],
)
def test_every_kind_of_obstacle_stands_where_it_was_put(two_link, kind, size, near):
    def apart(height):
        above = Obstacle('it', kind, size, (0.0, 0.0, height), (np.pi, 0.0, 0.0))
        model = with_obstacles(collision_model(two_link), [above])
        return ClearanceModel.of(model).smallest(np.zeros((1, 2)))[0]

    assert apart(4.0) - apart(3.0) == pytest.approx(1.0, abs=0.05)
    tip = in_outer_link(two_link, 0.0)[2] + 0.15
    assert apart(3.0) == pytest.approx(3.0 - near - tip, abs=0.1)


def test_mesh_is_an_obstacle(two_link, tmp_path):
    path = tmp_path / 'rock.obj'
    path.write_text(TETRAHEDRON)
    robot = collision_model(two_link)
    q = np.zeros((1, 2))
    rock = Obstacle('rock', 'mesh', (0.2,), (0.0, 0.0, 3.0), mesh=path)
    far = ClearanceModel.of(with_obstacles(robot, [rock])).smallest(q)[0]
    lower = Obstacle('rock', 'mesh', (0.2,), (0.0, 0.0, 2.5), mesh=path)
    near = ClearanceModel.of(with_obstacles(robot, [lower])).smallest(q)[0]
    assert far - near == pytest.approx(0.5, abs=0.05)
    with pytest.raises(TrajectoryError, match=r'rock.*mesh'):
        with_obstacles(robot, [Obstacle('rock', 'mesh', mesh=Path(tmp_path / 'none.stl'))])


def test_ignored_link_may_touch(two_link):
    robot = collision_model(two_link)
    floor = Obstacle('floor', 'plane', (), (0.0, 0.0, 0.55))
    assert ClearanceModel.of(with_obstacles(robot, [floor])).smallest(np.zeros((1, 2)))[0] < 0.0
    floor = Obstacle('floor', 'plane', (), (0.0, 0.0, 0.55), ignore=('upper',))
    assert ClearanceModel.of(with_obstacles(robot, [floor])).smallest(np.zeros((1, 2)))[0] > 0.1
    with pytest.raises(TrajectoryError, match=r"'leg'.*upper, lower"):
        with_obstacles(robot, [Obstacle('floor', 'plane', ignore=('leg',))])


def test_environment_file_is_read(tmp_path):
    path = tmp_path / 'cell.yaml'
    path.write_text(
        '- {name: table, kind: box, size: [1, 2, 0.1], position: [0, 0, -0.1]}\n'
        '- {name: ball, kind: sphere, size: 0.1}\n'
        '- {name: floor, kind: plane, ignore: [upper]}\n'
    )
    table, ball, floor = load_environment(path)
    assert table.size == (1.0, 2.0, 0.1)
    assert ball.size == (0.1,)
    assert floor.ignore == ('upper',)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('name: table', 'list'),
        ('- {name: table}', 'obstacle 1 '),
        ('- {name: table, kind: cube}', "'table'.* 'cube'.* box"),
        ('- {name: table, kind: box, size: [1, 2]}', 'x, y, z'),
        ('- {name: ball, kind: sphere, size: -1}', 'positive'),
        ('- {name: floor, kind: plane, position: [0, 0]}', 'position.* 3'),
        ('- {name: rock, kind: mesh}', 'file'),
        ('- [', 'cell.yaml'),
        ('- {name: 3, kind: plane}', 'strings'),
        ('- {name: floor, kind: plane, ignore: 3}', 'obstacle 1'),
    ],
)
def test_bad_environment_is_refused_with_the_entry(text, message, tmp_path):
    path = tmp_path / 'cell.yaml'
    path.write_text(text)
    with pytest.raises(TrajectoryError, match=message) as error:
        load_environment(path)
    assert 'cell.yaml' in str(error.value)
