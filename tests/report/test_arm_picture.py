# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The small drawing of an arm."""

from armid_ros.report.arm_drawing import draw_arm
from armid_ros.robots import robot_from_urdf
import numpy as np

ENDLESS = """
<robot name="wheel">
  <link name="base"/>
  <link name="hub"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="arm"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="hub"/>
    <origin xyz="0 0 0.2"/><axis xyz="0 0 1"/></joint>
  <joint name="lift" type="revolute"><parent link="hub"/><child link="arm"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" velocity="1" effort="1"/></joint>
</robot>
"""


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
