# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What MoveIt knows to stand around an arm stands there for the excitation, too."""

import json

from armid_ros.errors import TrajectoryError
from armid_ros.excitation import load_environment
from armid_ros.robots import load_robot
import numpy as np
import pytest
import yaml

ROBOT = load_robot('humanoid_arm')


def pose(x=0.0, y=0.0, z=0.0, turn=(0.0, 0.0, 0.0, 1.0)):
    orientation = dict(zip('xyzw', turn, strict=True))
    return {'position': {'x': x, 'y': y, 'z': z}, 'orientation': orientation}


def collision_object(name, kind, dimensions, where, frame='world', at=None):
    return {
        'header': {'stamp': {'sec': 0, 'nanosec': 0}, 'frame_id': frame},
        'pose': at or pose(),
        'id': name,
        'type': {'key': '', 'db': ''},
        'primitives': [{'type': kind, 'dimensions': dimensions, 'polygon': {'points': []}}],
        'primitive_poses': [where],
        'meshes': [],
        'mesh_poses': [],
        'planes': [],
        'plane_poses': [],
        'operation': 0,
    }


def scene(*objects):
    return {
        'name': '(noname)+',
        'robot_model_name': 'arm',
        'world': {'collision_objects': list(objects), 'octomap': {'octomap': {'data': []}}},
        'is_diff': False,
    }


def written(path, document):
    """Write a document as `ros2 topic echo` prints it."""
    path.write_text(yaml.safe_dump(document, sort_keys=False) + '---\n')
    return path


TURNED = (0.0, 0.0, 0.5**0.5, 0.5**0.5)  # a quarter about z


def test_primitives_stand_where_object_and_shape_say(tmp_path):
    objects = (
        collision_object('table', 1, [1.0, 0.5, 0.1], pose(0.2), at=pose(1.0, 0.0, 0.3, TURNED)),
        collision_object('ball', 2, [0.2], pose(0.0, 1.0)),
        collision_object('post', 3, [0.8, 0.05], pose(0.5)),
        collision_object('cone', 4, [0.4, 0.1], pose(-0.5)),
    )
    path = written(tmp_path / 'scene.yaml', scene(*objects))
    table, ball, post, cone = load_environment(path, ROBOT)
    assert (table.kind, table.size) == ('box', (1.0, 0.5, 0.1))
    np.testing.assert_allclose(table.position, (1.0, 0.2, 0.3), atol=1e-12)
    np.testing.assert_allclose(table.rpy, (0.0, 0.0, np.pi / 2), atol=1e-9)
    assert (ball.kind, ball.size, ball.position) == ('sphere', (0.2,), (0.0, 1.0, 0.0))
    assert (post.kind, post.size) == ('cylinder', (0.05, 0.8))  # the height came first
    assert (cone.kind, cone.size) == ('cylinder', (0.1, 0.4))
    alone = written(tmp_path / 'object.yaml', objects[1])
    assert load_environment(alone, ROBOT) == (ball,)
    world = tmp_path / 'world.json'
    world.write_text(json.dumps(scene(*objects)['world']))
    assert load_environment(world, ROBOT) == (table, ball, post, cone)


def test_meshes_and_planes_take_at_least_their_room(tmp_path):
    entry = collision_object('thing', 1, [], pose())
    entry['primitives'], entry['primitive_poses'] = [], []
    corners = [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.6)]
    entry['meshes'] = [
        {
            'triangles': [{'vertex_indices': [0, 1, 2]}],
            'vertices': [dict(zip('xyz', corner, strict=True)) for corner in corners],
        }
    ]
    entry['mesh_poses'] = [pose(1.0)]
    entry['planes'], entry['plane_poses'] = [{'coef': [0.0, 0.0, 2.0, 1.0]}], [pose()]
    box, plane = load_environment(written(tmp_path / 'scene.yaml', scene(entry)), ROBOT)
    assert (box.name, plane.name) == ('thing 1', 'thing 2')
    np.testing.assert_allclose(box.size, (0.4, 0.2, 0.6))
    np.testing.assert_allclose(box.position, (1.2, 0.1, 0.3))
    assert plane.kind == 'plane'
    np.testing.assert_allclose(plane.position, (0.0, 0.0, -0.5), atol=1e-12)


def test_objects_in_frames_that_move_or_are_unknown_are_refused(tmp_path):
    path = tmp_path / 'scene.yaml'
    hand = str(ROBOT.model.frames[-1].name)
    for frame in (hand, 'camera'):
        written(path, scene(collision_object('box', 1, [1.0, 1.0, 1.0], pose(), frame)))
        with pytest.raises(TrajectoryError, match=rf"scene\.yaml.*'{frame}'"):
            load_environment(path, ROBOT)


def test_what_was_cut_off_in_printing_is_said(tmp_path):
    entry = collision_object('thing', 1, [1.0, 1.0, 1.0], pose())
    entry['primitive_poses'] = ['...']
    with pytest.raises(TrajectoryError, match='--full-length'):
        load_environment(written(tmp_path / 'scene.yaml', scene(entry)), ROBOT)
