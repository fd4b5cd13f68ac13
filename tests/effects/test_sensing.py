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


def test_one_gain_for_all_joints_is_all_masses_and_friction_scaled(robot, motion):
    def arm(robot, coulomb):
        return ArmModel(robot).with_effect(make_effect('coulomb_friction', robot), coulomb)

    gained = arm(robot, np.full(6, 0.2)).with_effect(
        make_effect('torque_gain', robot), np.full(6, 0.07)
    )
    scaled = arm(robot.with_inertias(1.07 * robot.rigid_parameters), np.full(6, 1.07 * 0.2))
    np.testing.assert_allclose(gained.torque(motion), scaled.torque(motion), atol=1e-12)


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


def test_crosstalk_reads_the_torque_of_another_joint(robot, motion, with_values):
    tau = inverse_dynamics(robot, motion)
    read = with_values('torque_crosstalk@elbow_pitch+shoulder_pitch', 0.02).torque(motion)
    np.testing.assert_allclose(read[:, 3], tau[:, 3] + 0.02 * tau[:, 0], atol=1e-12)
    np.testing.assert_array_equal(np.delete(read, 3, axis=1), np.delete(tau, 3, axis=1))


def test_drift_depends_on_time_alone(sines, added):
    motion = sines(20.0, 50.0)
    drift = added(motion, 'torque_drift', 0.3, [5.0])
    np.testing.assert_allclose(drift, 0.3 * (1 - np.exp(-motion.t / 5.0))[:, None] * np.ones(6))


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


def test_lateness_needs_more_than_one_sample(robot, motion):
    with pytest.raises(ModelError, match='two samples'):
        ArmModel(robot).columns_of(make_effect('time_delay', robot), motion.select(slice(0, 1)))


def test_an_encoder_offset_is_what_has_to_be_added_to_the_reading(robot, motion, with_values):
    offset = np.array([0.01, -0.02, 0.0, 0.03, 0.0, 0.01])
    true = Motion(robot.joints, motion.t, motion.q + offset, motion.dq, motion.ddq)
    read = with_values('encoder_offset', offset).torque(motion)
    np.testing.assert_allclose(read, inverse_dynamics(robot, true), atol=1e-12)


def test_a_hard_limit_shows_in_what_the_drives_report(robot, motion, with_values):
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


def test_a_report_that_ends_is_clipped(robot, motion, with_values):
    read = with_values('actuator_saturation', [0.0, 1.0], [2.0]).torque(motion)
    tau = inverse_dynamics(robot, motion)
    np.testing.assert_allclose(read, np.clip(tau, -2.0, 2.0), atol=1e-12)
    assert np.abs(tau).max() > 3.0
