# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Distances between links: against geometry on paper, and against a robot that really moved."""

from collections.abc import Callable
from pathlib import Path

from armid_ros.errors import RobotError
from armid_ros.robots import collision_model, CollisionModel, load_robot, robot_from_urdf
from armid_ros.robots.meshes import convex_bodies
import numpy as np
import pytest

from tests.clearance import path_clearance

TABLE = '<collision><origin xyz="0 0 -1"/><geometry><box size="4 4 1.6"/></geometry></collision>'
BALL = '<sphere radius="0.05"/>'
CAPSULE = '<capsule radius="0.05" length="0.2"/>'
DUMBBELL = ((0.0, 0.2, 0.3), (0.2, 0.8, 0.1), (0.8, 1.0, 0.3))  # from, to, width [m]


def arm(hand: str = BALL, base: str = TABLE, elbow: str = '1') -> str:
    """Two links of 0.5 m that swing about y above a table; at zero they point along x."""
    links = {'base': base, 'upper': '', 'lower': f'<collision>{at_tip(hand)}</collision>'}
    inertial = (
        '<inertial><mass value="1"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    limit = '<limit lower="-3" upper="3" velocity="1" effort="1"/><axis xyz="0 1 0"/>'
    return (
        '<robot name="swing">'
        + ''.join(f'<link name="{name}">{inertial}{body}</link>' for name, body in links.items())
        + '<joint name="one" type="revolute"><parent link="base"/><child link="upper"/>'
        + f'{limit}</joint>'
        + '<joint name="two" type="revolute"><parent link="upper"/><child link="lower"/>'
        + f'<origin xyz="0.5 0 0"/>{limit}</joint></robot>'
    )


def at_tip(geometry: str) -> str:
    return f'<origin xyz="0.5 0 0"/><geometry>{geometry}</geometry>'


def box_faces(low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """Twelve triangles of a box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    points = low + corners * (high - low)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return [points[list(corner)] for a, b, c, d in sides for corner in ((a, b, c), (a, c, d))]


def write_stl(path: Path, triangles: list[np.ndarray]) -> Path:
    facets = [
        'facet normal 0 0 0\nouter loop\n'
        + ''.join(f'vertex {x:.9g} {y:.9g} {z:.9g}\n' for x, y, z in triangle)
        + 'endloop\nendfacet\n'
        for triangle in triangles
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text('solid s\n' + ''.join(facets) + 'endsolid s\n')
    return path


@pytest.fixture
def dumbbell(tmp_path: Path) -> Path:
    """Mesh of a bar along x with a thick block at each end."""
    triangles: list[np.ndarray] = []
    for start, end, width in DUMBBELL:
        half = width / 2.0
        triangles += box_faces(np.array([start, -half, -half]), np.array([end, half, half]))
    return write_stl(tmp_path / 'swing_description' / 'meshes' / 'dumbbell.stl', triangles)


def distance(model: CollisionModel, *q: float) -> float:
    """Return the smallest clearance in one pose [m]."""
    return float(path_clearance(model, np.array([q]))[0])


class TestDistances:
    @pytest.mark.parametrize('angle', [0.0, -0.3, 0.3])
    @pytest.mark.parametrize(('hand', 'half'), [(BALL, 0.0), (CAPSULE, 0.1)])
    def test_a_hand_above_or_within_a_table(self, hand: str, half: float, angle: float) -> None:
        model = collision_model(robot_from_urdf(arm(hand)))
        height = np.sin(-angle) - half * np.cos(angle) + 0.2  # the top of the table is at z = -0.2
        assert distance(model, angle, 0.0) == pytest.approx(height - 0.05, abs=1e-4)
        assert model.pairs == (('base', 'lower'),)

    def test_a_robot_without_collision_bodies_is_always_free(self) -> None:
        bare = arm(base='').replace(f'<collision>{at_tip(BALL)}</collision>', '')
        model = collision_model(robot_from_urdf(bare))
        assert distance(model, 0.0, 0.0) == np.inf
        assert model.pairs == ()

    def test_a_body_without_numbers_is_refused(self) -> None:
        with pytest.raises(RobotError, match="'lower'"):
            collision_model(robot_from_urdf(arm(hand='<sphere/>')))


class TestPairs:
    def test_links_that_touch_at_zero_are_left_out_and_noted(self) -> None:
        sunk = TABLE.replace('-1"', '-0.6"')
        model = collision_model(robot_from_urdf(arm(base=sunk)))
        assert model.pairs == ()
        (note,) = model.notes
        assert "'base'" in note and "'lower'" in note

    def test_an_srdf_beside_the_urdf_says_what_is_left_out(self, tmp_path: Path) -> None:
        path = tmp_path / 'swing.urdf'
        path.write_text(arm())
        assert collision_model(load_robot(path)).pairs == (('base', 'lower'),)
        (tmp_path / 'swing.srdf').write_text(
            '<robot name="swing"><disable_collisions link1="lower" link2="base"/></robot>'
        )
        assert collision_model(load_robot(path)).pairs == ()

    def test_a_pair_that_one_joint_moves_counts_only_if_it_can_touch(self) -> None:
        post = '<collision><origin xyz="-0.5 0 0"/><geometry>{}</geometry></collision>'
        for radius, pairs in (('0.1', ()), ('0.3', (('base', 'lower'),))):
            body = post.format(f'<sphere radius="{radius}"/>')
            robot = robot_from_urdf(arm(base=body), joints=['two'])
            reaching = robot_from_urdf(arm(base=body.replace('-0.5', '-0.2')), joints=['two'])
            assert collision_model(robot).pairs == ()
            assert collision_model(reaching).pairs == pairs


class TestMeshes:
    def test_the_bodies_contain_the_mesh_and_little_else(self, dumbbell: Path) -> None:
        bodies = convex_bodies(dumbbell, np.ones(3))
        volume = sum((end - start) * width**2 for start, end, width in DUMBBELL)
        assert volume <= sum(body.computeVolume() for body in bodies) * (1 + 1e-6)
        assert sum(body.computeVolume() for body in bodies) < 1.15 * volume
        corners = np.vstack([np.array(body.points()) for body in bodies])
        np.testing.assert_allclose(corners.min(axis=0), (0.0, -0.15, -0.15), atol=1e-6)
        np.testing.assert_allclose(corners.max(axis=0), (1.0, 0.15, 0.15), atol=1e-6)

    def test_a_ball_fits_between_the_blocks_of_a_dumbbell(self, dumbbell: Path) -> None:
        mesh = '<mesh filename="package://swing_description/meshes/dumbbell.stl"/>'
        lying = f'<collision><origin xyz="0.5 0 -0.2"/><geometry>{mesh}</geometry></collision>'
        path = dumbbell.parents[1] / 'urdf' / 'swing.urdf'
        path.parent.mkdir()
        path.write_text(arm(base=lying))
        model = collision_model(load_robot(path))
        assert model.notes == ()
        # the ball at x = 1, z = 0 is 0.15 above the bar; the hull would be 0.05 below it
        assert distance(model, 0.0, 0.0) == pytest.approx(0.1, abs=1e-3)

    def test_a_flat_mesh_is_a_body_too(self, tmp_path: Path) -> None:
        corners = np.array([[0.0, -1, 0], [2, -1, 0], [2, 1, 0], [0, 1, 0]])
        plate = write_stl(tmp_path / 'plate.stl', [corners[[0, 1, 2]], corners[[0, 2, 3]]])
        lying = '<collision><origin xyz="0 0 -0.2"/><geometry>{}</geometry></collision>'
        body = lying.format(f'<mesh filename="file://{plate}"/>')
        model = collision_model(robot_from_urdf(arm(base=body)))
        assert distance(model, 0.0, 0.0) == pytest.approx(0.15, abs=1e-6)

    def test_a_file_that_is_no_mesh_is_refused(self, tmp_path: Path) -> None:
        broken = tmp_path / 'broken.stl'
        broken.write_bytes(b'\x00\x01')
        with pytest.raises(RobotError, match=r'broken\.stl'):
            convex_bodies(broken, np.ones(3))


class TestHumanoidArm:
    @pytest.mark.parametrize('name', ['humanoid_arm', 'humanoid_arm_loaded'])
    def test_it_hangs_beside_the_torso_and_hits_it_when_it_swings_inwards(self, name: str) -> None:
        model = collision_model(load_robot(name))
        assert model.notes == ()
        assert 'humanoid_arm.srdf' in model.excluded and '4' in model.excluded
        hanging = distance(model, *np.radians((90.0, -90.0, 0.0, 0.0, 0.0, 0.0)))
        assert hanging == pytest.approx(0.25 - 0.16 - 0.05, abs=1e-6)
        assert distance(model, *np.radians((90.0, -110.0, 0.0, 0.0, 0.0, 0.0))) < -0.05


def test_a_pose_in_which_a_ur10_was_recorded_is_free(
    example_robot: Callable[[str], Path],
) -> None:
    model = collision_model(load_robot(example_robot('ur10_robot.urdf')))
    recorded = (2.21623, -1.79307, -1.51882, 1.53329, 1.99613, -2.35667)
    assert distance(model, *recorded) > 0.01
    folded = (0.0, 0.0, 3.1, 0.0, 0.0, 0.0)
    assert distance(model, *folded) < 0.0
