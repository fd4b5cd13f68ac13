# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The shipped humanoid arm is the one of the literature."""

from armid_ros.robots import load_robot, shipped_robots
import numpy as np
import pinocchio as pin
import pytest

ARMS = ('humanoid_arm', 'humanoid_arm_loaded')
MASSES = (0.8, 0.7, 0.5, 0.3, 0.3, 0.2)  # kg
CENTROIDS = (  # m, in the link frames
    (0.0005, 0.0035, -0.070),
    (0.0015, 0.0040, 0.0050),
    (0.0055, 0.0130, 0.150),
    (0.0075, -0.030, 0.0045),
    (0.0035, 0.0110, 0.100),
    (0.0020, 0.0055, 0.0030),
)


def test_masses_and_centroids() -> None:
    bodies = list(load_robot('humanoid_arm').model.inertias)[1:]
    np.testing.assert_allclose([body.mass for body in bodies], MASSES, rtol=1e-12)
    np.testing.assert_allclose([body.lever for body in bodies], CENTROIDS, atol=1e-12)
    assert sum(body.mass for body in bodies) == pytest.approx(2.8)


def test_the_load_is_in_the_hand_and_leaves_its_centroid() -> None:
    empty, loaded = (list(load_robot(name).model.inertias) for name in ARMS)
    assert loaded[6].mass == pytest.approx(0.5)
    np.testing.assert_allclose(loaded[6].lever, CENTROIDS[5], atol=1e-12)
    for before, after in zip(empty[1:6], loaded[1:6], strict=True):
        np.testing.assert_array_equal(before.toDynamicParameters(), after.toDynamicParameters())


def test_at_zero_the_arm_is_stretched_sideways_and_the_first_axis_is_lateral() -> None:
    robot = load_robot('humanoid_arm')
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, np.zeros(6))
    np.testing.assert_allclose(data.oMi[1].rotation[:, 2], (0.0, 1.0, 0.0), atol=1e-12)
    shoulder, elbow, wrist = (data.oMi[joint].translation for joint in (1, 3, 6))
    np.testing.assert_allclose(elbow - shoulder, (0.0, -0.35, 0.0), atol=1e-12)
    np.testing.assert_allclose(wrist - shoulder, (0.0, -0.60, 0.0), atol=1e-12)


@pytest.mark.parametrize('name', ARMS)
def test_every_link_could_exist(name: str) -> None:
    robot = load_robot(name)
    assert robot.notes == ()
    for body in list(robot.model.inertias)[1:]:
        pseudo = body.toPseudoInertia().toMatrix()
        assert np.linalg.eigvalsh(pseudo).min() > 0.0


def test_what_is_shipped_loads_under_its_name() -> None:
    assert set(ARMS) <= set(shipped_robots())
    for name, description in shipped_robots().items():
        assert load_robot(name).name == name
        assert description
