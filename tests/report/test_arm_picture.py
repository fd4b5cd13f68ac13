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


def test_a_joint_that_slides_leaves_no_hole():
    """Every joint but the first lies at the end of a line that begins further in."""
    slide = ENDLESS.replace('type="continuous"', 'type="prismatic"').replace(
        '<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><limit lower="0" upper="1" velocity="1"/>'
    )
    drawn = draw_arm(robot_from_urdf(slide), ['turn'], np.array([[0.8, 0.5]]))
    ends = {(stick.x2, stick.y2) for stick in drawn.sticks}
    begins = {(stick.x1, stick.y1) for stick in drawn.sticks}
    assert {(dot.x, dot.y) for dot in drawn.dots} <= ends
    assert drawn.base in begins
    (way,) = [stick for stick in drawn.sticks if stick.marked and stick.x1 == stick.x2]
    assert abs(way.y1 - way.y2) > 10.0


def test_names_above_each_other_stay_inside_the_drawing():
    chain = ''.join(
        f'<link name="l{k}"><inertial><mass value="1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        f'<joint name="j{k}" type="revolute"><parent link="{f"l{k - 1}" if k else "base"}"/>'
        f'<child link="l{k}"/><origin xyz="0 0 {0.02 if k else 1.0}"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
        for k in range(6)
    )
    robot = robot_from_urdf(f'<robot name="chain"><link name="base"/>{chain}</robot>')
    drawn = draw_arm(robot, robot.joints)
    assert min(dot.label_y for dot in drawn.dots) < 0.0
    assert min(dot.label_y for dot in drawn.dots) + drawn.above >= 14.0


def test_names_are_not_printed_over_one_another():
    """A name that begins at its joint reaches the one that is centred at the next."""
    places = {'shoulder_lift': '0 0 0.2', 'elbow_flex': '0.35 0 0', 'wrist_pitch': '0.55 0 0'}
    parent, links = 'base', '<link name="base"/>'
    for name, place in places.items():
        links += (
            f'<link name="{name}_link"><inertial><mass value="1"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}_link"/><origin xyz="{place}"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
        )
        parent = f'{name}_link'
    robot = robot_from_urdf(f'<robot name="three">{links}</robot>')
    boxes = []
    for dot in draw_arm(robot, robot.joints).dots:
        length = 7.0 * len(dot.name)
        left = dot.label_x - {'start': 0.0, 'middle': 0.5, 'end': 1.0}[dot.anchor] * length
        boxes.append((left, left + length, dot.label_y))
    for k, (left, right, y) in enumerate(boxes):
        for start, end, other in boxes[k + 1 :]:
            assert right <= start or end <= left or abs(y - other) >= 14.0


def test_a_name_is_not_written_over_the_link_above_its_joint():
    """The column of a lift goes up from its joint: the name is beside it."""
    upright = ENDLESS.replace('0.3 0 0', '0 0 0.6')
    drawn = draw_arm(robot_from_urdf(upright), ['turn'])
    (dot,) = [one for one in drawn.dots if one.marked]
    above = [one for one in drawn.sticks if min(one.y1, one.y2) < dot.y - 30.0]
    assert above
    left = dot.label_x - (8.5 * len(dot.name) if dot.anchor == 'end' else 0.0)
    assert dot.anchor != 'middle'
    assert all(not left < one.x1 < left + 8.5 * len(dot.name) for one in above)
