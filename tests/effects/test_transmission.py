# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Elastic joints and backlash, read at the motors."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.effects.transmission import place_in_gap
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np
import pytest

from tests.serial_arm import serial_arm

INERTIA = 0.3
TURNTABLE = serial_arm('turn revolute 0,0,1 0,0,0', moments=(0.1, 0.1, INERTIA))


def link_sine(omega, rate=2000.0):
    """Turn a link in a sine, 0.2 rad, long enough for the edges not to matter."""
    t = np.arange(0.0, 1.0, 1.0 / rate)[:, None]
    return t[:, 0], 0.2 * np.array([1.0, omega, omega**2]), omega * t


@pytest.mark.parametrize('frequency', [1.0, 3.0])
def test_a_soft_joint_lets_the_motor_run_ahead_as_the_closed_form_says(frequency):
    """
    A link I behind a spring K, torque from the motor's position.

    tau = -I w^2 q_motor / (1 - I w^2 / K), of which the first order in 1/K is right to
    (I w^2 / K)^2.
    """
    robot = load_robot(TURNTABLE)
    omega, stiffness = 2.0 * np.pi * frequency, 3000.0
    t, scale, phase = link_sine(omega)
    ratio = INERTIA * omega**2 / stiffness
    motor = (1.0 - ratio) * scale
    motion = Motion(
        ('turn',),
        t,
        motor[0] * np.sin(phase),
        motor[1] * np.cos(phase),
        -motor[2] * np.sin(phase),
    )
    arm = ArmModel(robot).with_effect(make_effect('joint_elasticity', robot), [1.0 / stiffness])
    true = -INERTIA * scale[2] * np.sin(phase)
    inner = slice(20, -20)
    error = np.abs(arm.torque(motion) - true)[inner].max()
    assert error < 1.2 * ratio**2 * np.abs(true).max()
    rigid = np.abs(ArmModel(robot).torque(motion) - true)[inner].max()
    assert rigid > 0.9 * ratio * np.abs(true).max()


def test_rotors_turn_with_the_motors_and_links_with_the_links():
    robot = load_robot(TURNTABLE)
    t, scale, phase = link_sine(2.0 * np.pi * 3.0)
    motion = Motion(
        ('turn',), t, scale[0] * np.sin(phase), scale[1] * np.cos(phase), -scale[2] * np.sin(phase)
    )
    arm = ArmModel(robot).with_effect(make_effect('joint_elasticity', robot), [1e-3])
    rotor = arm.with_effect(make_effect('rotor_inertia', robot), [0.2])
    np.testing.assert_allclose(
        rotor.torque(motion) - arm.torque(motion), 0.2 * motion.ddq, atol=1e-9
    )


def test_backlash_moves_the_link_to_the_flank_that_carries_the_load(robot, sines, with_values):
    """Where the weight decides and the gap is crossed at once: half the play to either side."""
    fine = sines(1.0, 500.0).at_rest()
    arm = with_values('backlash', 0.01, [1e-6])
    load = inverse_dynamics(robot, fine)
    link = arm.link_motion(fine)
    loaded = np.abs(load) > 0.1
    np.testing.assert_allclose(
        (fine.q - link.q)[loaded], (0.005 * np.sign(load))[loaded], atol=1e-9
    )


def test_a_gap_is_crossed_in_the_time_that_the_load_takes():
    """A load that turns round at a steady rate j flies x = j t^3 / 6 to the other flank."""
    t, rate, width = np.linspace(-0.5, 0.5, 4001), 40.0, 1e-3
    place = place_in_gap(t, rate * t, width)
    flown = np.where(t > 0.0, rate * t**3 / 6.0, 0.0)
    np.testing.assert_allclose(place, np.minimum(flown - 0.5 * width, 0.5 * width), atol=1e-6)
