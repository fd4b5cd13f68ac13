# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The small drawing of an arm."""

from armid_ros.report.arm_picture import draw_arm
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
    assert {dot.name for dot in drawn.dots} == {'turn', 'lift'}
