# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Zeros, gains, gravity and tool of arms at rest, from readings computed with pinocchio alone."""

from dataclasses import replace

from armid_ros.robots import robot_from_urdf
from armid_ros.zero.fit import fit_rests
import numpy as np
import pytest

from tests.serial_arm import serial_arm
from tests.zero.machine import rests_of, Secret

#: A vertical slide and two vertical axes.
SCARA = serial_arm(
    'j0 revolute 0,0,1 0.3,0,0',
    'j1 revolute 0,0,1 0.3,0,0',
    'j2 prismatic 0,0,1 0.3,0,0',
    centre='0.2 0 0',
)


@pytest.fixture(scope='module')
def secret(robot):
    return Secret.draw(robot, np.random.default_rng(5))


def test_intervals_hold_the_truth_as_often_as_they_say(robot, secret):
    inside, count = 0, 0
    for seed in range(12):
        rests = rests_of(robot, secret, 16, np.random.default_rng(seed))
        found = fit_rests([rests], [robot])
        for (name, joint), truth in secret.truth(robot).items():
            one = found.of(name, joint)
            count += 1
            inside += abs(one.value - truth) <= one.half_width
    assert 0.91 < inside / count < 0.985


def test_a_wrong_reading_is_left_out(robot, secret):
    rests = rests_of(robot, secret, 16, np.random.default_rng(0))
    plain = fit_rests([rests], [robot])
    touched = rests.tau.copy()
    touched[3, 1] += 5.0
    found = fit_rests([rests.with_torque(touched)], [robot])
    assert (plain.outliers, found.outliers) == (0, 1)
    zeros = plain.of('zero', robot.joints[1]), found.of('zero', robot.joints[1])
    assert abs(zeros[1].value - zeros[0].value) < zeros[0].half_width


def test_two_poses_determine_no_zero(robot, secret):
    rests = rests_of(robot, secret, 2, np.random.default_rng(0))
    found = fit_rests([rests], [robot])
    reasons = [found.of('zero', joint).reason for joint in robot.joints]
    assert all('2 poses are too few' in one and 'armid zero plan' in one for one in reasons)


def test_a_known_gain_gives_the_size_of_gravity(robot, secret):
    honest = replace(secret, gain=np.ones(robot.n_joints))
    rests = rests_of(robot, honest, 16, np.random.default_rng(0))
    moon = robot.with_gravity(np.array(robot.gravity) * 0.95)
    size = fit_rests([rests], [moon], ['gain']).of('gravity')
    assert abs(size.value - np.linalg.norm(robot.gravity)) < size.half_width < 0.1
    assert fit_rests([rests], [robot]).of('gravity').half_width < 1e-6


def test_links_that_are_not_trusted_widen_gains_and_not_zeros(robot, secret):
    rests = rests_of(robot, secret, 24, np.random.default_rng(0))
    joint = robot.joints[1]
    trusted, doubted = (fit_rests([rests], [robot], (), share) for share in (0.0, 0.05))
    assert doubted.of('gain', joint).half_width > 5 * trusted.of('gain', joint).half_width
    assert doubted.of('zero', joint).half_width < 3 * trusted.of('zero', joint).half_width


def test_vertical_axes_show_their_zeros_and_no_gains():
    robot = robot_from_urdf(SCARA, source='scara')
    secret = Secret(
        np.array([0.3, -0.2, 1.0]), np.ones(3), np.full(3, 0.1), np.zeros(2), 0.0, np.zeros(3)
    )
    rests = rests_of(robot, secret, 16, np.random.default_rng(0))
    found = fit_rests([rests], [robot], ['tilt'])
    for joint, zero in (('j0', 0.3), ('j1', -0.2)):
        assert found.of('zero', joint).value == pytest.approx(zero, abs=0.02)
        assert not found.of('zero', joint).reason
        assert 'weight torque is too small' in found.of('gain', joint).reason
    # weight of slide and tool, zero and gain are one constant force
    assert 'not separable' in found.of('zero', 'j2').reason
    assert '--payload' in found.of('mass').reason
    told = fit_rests([rests], [robot], ['tilt', 'tool', 'gain'])
    assert told.of('zero', 'j2').value == pytest.approx(1.0, abs=0.02)
