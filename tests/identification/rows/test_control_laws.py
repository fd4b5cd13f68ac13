# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A torque that a controller makes of the motion says nothing of the arm, and is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose
from armid_ros.errors import IdentificationError
from armid_ros.identification import identify
from armid_ros.identification.rows.checks import laws_of_controllers
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

from benchmarks.real_changes import hand_guided, payload
from tests.identification.conftest import multisine, recorded


def commanded(arm, law, joints=slice(None), noise=1e-4):
    """Return a recording in which joints have the torque of a law of the motion."""
    motion = multisine(arm.robot.joints, 20.0, 200.0, seed=4, base_hz=0.3)
    recording = recorded(arm, motion, torque_noise=noise)
    tau = recording.tau.copy()
    wanted = law(arm.robot, motion)
    wanted += noise * np.random.default_rng(0).standard_normal(tau.shape)
    tau[:, joints] = wanted[:, joints]
    return replace(recording, tau=tau)


def held(robot, motion):
    still = np.zeros_like(motion.q)
    return 1.2 * inverse_dynamics(robot, replace(motion, dq=still, ddq=still))


def test_an_arm_that_is_guided_while_its_weight_is_held_is_refused_by_both(arm, structure):
    bad = commanded(arm, held)
    with pytest.raises(IdentificationError, match='depends only on position'):
        identify(structure, [bad], rng=np.random.default_rng(0))
    found = diagnose(arm, [bad], rng=np.random.default_rng(0))
    assert found.verdict == 'bad_data'
    assert 'depends only on position' in found.summary


def test_one_joint_whose_inertia_a_model_has_not_learned_is_no_law(arm, structure):
    identify(structure, [commanded(arm, held, joints=1)], rng=np.random.default_rng(0))


def test_a_joint_says_nothing_of_a_controller_where_the_others_cannot_be_asked(arm):
    robot = arm.robot
    motion = multisine(robot.joints, 20.0, 200.0, seed=4, base_hz=0.3)
    motion = motion.with_torque(held(robot, motion))
    every = np.ones(motion.q.shape, dtype=bool)
    assert len(laws_of_controllers(robot, motion, every)) == robot.n_joints
    resting = every.copy()
    resting[10:, 1:] = False
    assert laws_of_controllers(robot, motion, resting) == ()


def test_a_stretch_of_three_rows_obeys_no_law(arm):
    motion = multisine(arm.robot.joints, 10.0, 100.0, seed=1)
    few = motion.with_torque(arm.torque(motion)).select(np.arange(3))
    assert laws_of_controllers(arm.robot, few, np.ones((3, 6), dtype=bool)) == ()


@pytest.mark.parametrize('heavier', [0.2, 5.0])
def test_an_arm_that_follows_a_trajectory_obeys_no_law(arm, structure, heavier):
    robot = arm.robot
    real = arm.with_theta(
        np.r_[heavier * robot.rigid_parameters, arm.theta[10 * robot.n_joints :]]
    )
    good = recorded(real, multisine(robot.joints, 20.0, 200.0, seed=4), torque_noise=0.01)
    found = identify(structure, [good], rng=np.random.default_rng(0))
    assert np.all(np.isfinite(found.arm.theta))


@pytest.mark.real_data
@pytest.mark.parametrize('days', [hand_guided, payload])
def test_a_guided_pendulum_and_one_that_is_switched_are_refused(real_data, tmp_path, days):
    asked = days(Path(real_data), tmp_path)
    arm = ArmModel(asked.robot)
    identify(arm, asked.day_1, rng=np.random.default_rng(0))
    with pytest.raises(IdentificationError, match='Joint_1 depends only on position'):
        identify(arm, asked.day_2, rng=np.random.default_rng(0))
