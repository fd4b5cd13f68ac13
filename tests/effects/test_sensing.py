# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What sensors make of torque and position: gain, crosstalk, drift, delay, offset, clipping."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
import numpy as np
import pytest


def test_gain_scales_all_that_the_joint_takes(robot, motion):
    """Whatever the order in which the effects were named."""
    gain = (make_effect('torque_gain', robot), np.full(6, -0.1))
    offset = (make_effect('torque_offset', robot), np.full(6, 0.5))
    arms = [
        ArmModel(robot).with_effect(*a).with_effect(*b)
        for a, b in [(gain, offset), (offset, gain)]
    ]
    expected = 0.9 * (inverse_dynamics(robot, motion) + 0.5)
    for arm in arms:
        np.testing.assert_allclose(arm.torque(motion), expected, atol=1e-12)


def test_a_delay_shifts_the_torque_of_each_joint_by_its_own(robot, sines, with_values):
    fine = sines(2.0, 1000.0)
    tau = inverse_dynamics(robot, fine)
    read = with_values('time_delay@elbow_pitch+wrist_pitch', [0.003, -0.002]).torque(fine)
    np.testing.assert_allclose(read[3:, 3], tau[:-3, 3], atol=1e-9)
    np.testing.assert_allclose(read[:-2, 5], tau[2:, 5], atol=1e-9)
    np.testing.assert_array_equal(read[:, :3], tau[:, :3])


@pytest.mark.parametrize('lag', [0.0003, 0.002, 0.05])
@pytest.mark.parametrize('rate', [200.0, 1000.0])
def test_a_lag_attenuates_and_turns_as_a_low_pass_does(robot, with_values, lag, rate):
    t = np.arange(0.0, 8.0, 1.0 / rate)
    omega = 2.0 * np.pi * 3.0
    zero = np.zeros((len(t), 6))
    motion = Motion(robot.joints, t, zero, zero, zero)
    effect = with_values('torque_lag', lag).effects[0]
    tau = np.tile(np.sin(omega * t)[:, None], 6)
    read = effect.read(np.full(6, lag), motion, tau)
    response = 1.0 / (1.0 + 1j * omega * lag)
    steady = np.imag(response * np.exp(1j * omega * t))[:, None] * np.ones(6)
    settled = t > 20.0 * lag
    np.testing.assert_allclose(read[settled][:-1], steady[settled][:-1], atol=3e-3)


def test_delay_and_lag_are_the_same_to_first_order(robot, sines):
    fine, arm = sines(2.0, 1000.0), ArmModel(robot)
    delay = arm.columns_of(make_effect('time_delay', robot), fine)[:, :, 0]
    lag = arm.columns_of(make_effect('torque_lag', robot), fine).sum(axis=2)
    np.testing.assert_allclose(delay, lag, atol=1e-12)
    with pytest.raises(ModelError, match='two samples'):
        arm.columns_of(make_effect('time_delay', robot), fine.select(slice(0, 1)))


def test_a_hard_limit_shows_in_what_the_drives_report_or_clips_the_report(
    robot, motion, with_values
):
    """Reported and given torque differ where the report is beyond the level."""
    arm = with_values('actuator_saturation', [1.0, 0.0], [2.0])
    given = np.clip(inverse_dynamics(robot, motion), -2.0, 2.0)
    excess = np.maximum(np.sin(40.0 * motion.t), 0.0)[:, None]
    reported = given + np.where(np.abs(given) == 2.0, np.sign(given) * excess, 0.0)
    drive = arm.action().drive
    np.testing.assert_allclose(drive(reported), given, atol=1e-12)
    effect = arm.effects[0]
    read = effect.read(arm.values[0], motion.with_torque(reported), given)
    np.testing.assert_allclose(read, reported, atol=1e-12)
    clipped = with_values('actuator_saturation', [0.0, 1.0], [2.0]).torque(motion)
    np.testing.assert_allclose(clipped, given, atol=1e-12)
