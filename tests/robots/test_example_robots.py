# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arms of other people: each loads as it is, and its regressor is its dynamics."""

from collections.abc import Callable
from pathlib import Path

from armid_ros.robots import load_robot, Robot
import numpy as np
import pinocchio as pin
import pytest

ARMS = {
    'TwoDofs.urdf': 2,
    'borinot_flying_arm_2.urdf': 2,
    'double_pendulum.urdf': 2,
    'double_pendulum_continuous.urdf': 2,
    'finger_edu.urdf': 3,
    'kinova.urdf': 6,
    'panda.urdf': 7,
    'so100.urdf': 5,
    'talos_left_arm.urdf': 6,
    'tiago_no_hand.urdf': 12,
    'ur3_robot.urdf': 6,
    'ur5_gripper.urdf': 6,
    'ur10_robot.urdf': 6,
    'xarm7.urdf': 7,
    'z1.urdf': 6,
    'baxter.urdf': 15,
}

FindRobot = Callable[[str], Path]


def random_states(robot: Robot, count: int) -> np.ndarray:
    """Return q, dq, ddq of each sample, shape (count, 3, n)."""
    states = np.random.default_rng(3).standard_normal((count, 3, robot.n_joints))
    return states * np.array((2.0, 3.0, 10.0))[:, None]


@pytest.mark.parametrize(('name', 'n_joints'), ARMS.items())
def test_regressor_times_parameters_is_inverse_dynamics(
    name: str, n_joints: int, example_robot: FindRobot
) -> None:
    robot = load_robot(example_robot(name), gravity=(0.5, -3.0, -9.0))
    assert robot.n_joints == robot.model.nq == robot.model.nv == n_joints
    data = robot.model.createData()
    for q, dq, ddq in random_states(robot, 20):
        tau = pin.rnea(robot.model, data, q, dq, ddq).copy()
        regressor = pin.computeJointTorqueRegressor(robot.model, data, q, dq, ddq)
        error = np.linalg.norm(regressor @ robot.rigid_parameters - tau)
        assert error <= 1e-9 * np.linalg.norm(tau)


def test_the_panda_is_seven_joints_and_a_closed_hand(example_robot: FindRobot) -> None:
    robot = load_robot(example_robot('panda.urdf'))
    assert robot.joints == tuple(f'panda_joint{number}' for number in range(1, 8))
    assert robot.links == tuple(f'panda_link{number}' for number in range(1, 8))
    assert any('panda_finger_joint2' in note and ' 0 m' in note for note in robot.notes)


def test_a_link_may_have_the_name_of_its_joint(example_robot: FindRobot) -> None:
    everything = ('shoulder_pan', 'shoulder_lift', 'elbow_flex', 'wrist_flex', 'wrist_roll')
    robot = load_robot(example_robot('so100.urdf'), joints=(*everything, 'gripper'))
    assert robot.joints == (*everything, 'gripper')
