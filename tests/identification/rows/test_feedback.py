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
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest

from benchmarks.real_days import hand_guided, payload
from tests.identification.conftest import multisine, recorded

JOINT = 1


def commanded(arm, law, noise=0.01):
    """Return a recording in which one joint has the torque of a law of the motion."""
    motion = multisine(arm.robot.joints, 20.0, 200.0, seed=4, base_hz=0.3)
    recording = recorded(arm, motion, torque_noise=noise)
    tau = recording.tau.copy()
    tau[:, JOINT] = law(arm.robot, motion)[:, JOINT]
    tau[:, JOINT] += noise * np.random.default_rng(0).standard_normal(len(tau))
    return replace(recording, tau=tau)


def held(robot, motion):
    still = np.zeros_like(motion.q)
    return 1.2 * inverse_dynamics(robot, replace(motion, dq=still, ddq=still))


def along(robot, motion):
    return 10.0 * np.sign(motion.dq)


def held_and_along(robot, motion):
    return held(robot, motion) + along(robot, motion)


@pytest.mark.parametrize('law', [held, along, held_and_along])
def test_a_law_of_a_controller_is_refused_by_both(arm, structure, law):
    bad = commanded(arm, law)
    name = arm.robot.joints[JOINT]
    with pytest.raises(IdentificationError, match=f'bag: the torque of {name} is a law'):
        identify(structure, [bad], rng=np.random.default_rng(0))
    found = diagnose(arm, [bad], rng=np.random.default_rng(0))
    assert found.verdict == 'bad_data'
    assert f'the torque of {name} is a law of position' in found.summary


@pytest.mark.parametrize('heavier', [0.2, 1.0, 5.0])
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
    with pytest.raises(IdentificationError, match='Joint_1 is a law of position and direction'):
        identify(arm, asked.day_2, rng=np.random.default_rng(0))
