# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A rehearsal remembers the worst, in memory that does not grow."""

from armid_ros.arm import ArmModel
from armid_ros.excitation import Excitation, FourierTrajectory
from armid_ros.excitation.supervision import Rehearsal
from armid_ros.robots import load_robot
import numpy as np
import pytest


@pytest.fixture(scope='module')
def arm():
    return ArmModel(load_robot('humanoid_arm'))


@pytest.fixture(scope='module')
def run(arm):
    robot = arm.robot
    a = np.full((6, 1), 0.1)
    middle = (robot.lower + robot.upper) / 2.0
    return Excitation(FourierTrajectory(robot.joints, 5.0, middle, a, 0.0 * a), 1, 1.0)


def rehearsed(arm, run, off=0.0, factor=1.0, count=500):
    rehearsal = Rehearsal(run, arm)
    for t in np.linspace(0.0, run.duration, count):
        motion = run.at([t])
        rehearsal.add(t, motion.q[0] + off, factor * arm.joint_torque(motion)[0])
    return rehearsal


def test_an_arm_as_described_surprises_nobody(arm, run):
    rehearsal = rehearsed(arm, run)
    assert rehearsal.report()[1] == ()
    np.testing.assert_allclose(rehearsal.torque, rehearsal.predicted(), rtol=2e-5)
    np.testing.assert_allclose(rehearsal.tracking, 0.0, atol=1e-12)


def test_the_largest_distance_is_reported(arm, run):
    rehearsal = rehearsed(arm, run, off=0.02)
    np.testing.assert_allclose(rehearsal.tracking, 0.02, atol=1e-12)
    assert '0.02' in rehearsal.report()[0]


def test_ten_times_the_torque_is_a_surprise(arm, run):
    assert rehearsed(arm, run, factor=10.0).report()[1]


def test_without_joint_states_it_is_said(arm, run):
    text, surprises = Rehearsal(run, arm).report()
    assert surprises == (text,) and 'joint state' in text
