# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The small drawing of an arm."""

from armid_ros.report.arm_drawing import draw_arm
from armid_ros.robots import robot_from_urdf
import numpy as np

from tests.serial_arm import serial_arm

ENDLESS = serial_arm(
    'turn continuous 0,0,1 0,0,0.2', 'lift revolute 0,1,0 0.3,0,0', centre='0 0 0'
)
ENDLESS = ENDLESS.replace('lower="-2"', 'lower="-1"')


def test_a_joint_without_end_is_drawn_at_zero_and_others_in_the_middle_of_their_range():
    robot = robot_from_urdf(ENDLESS)
    drawn = draw_arm(robot, ['turn'])
    assert drawn == draw_arm(robot, ['turn'], np.array([[0.0, 0.5]]))
    assert {name for *_, name in drawn.dots} == {'turn', 'lift'}


def test_an_arm_on_a_ceiling_hangs():
    """What the base carries is at the bottom; without gravity it is drawn as described."""
    below = {}
    for up in (-9.81, 9.81, 0.0):
        drawn = draw_arm(robot_from_urdf(ENDLESS, gravity=(0.0, 0.0, up)), [])
        corners = [float(p.split(',')[1]) for body, _ in drawn.bodies for p in body.split()]
        below[up] = max(corners) - next(y for _, y, _, name in drawn.dots if name == 'lift')
        assert drawn.gravity == bool(up)
    assert 0.0 < below[9.81] < 0.2 * below[-9.81]
    assert below[0.0] == below[-9.81]
