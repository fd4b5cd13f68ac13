# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Points of links against Pinocchio, one configuration at a time."""

from armid_ros.model import points_motion
from armid_ros.robots import load_robot
import numpy as np
import pinocchio as pin
import pytest

SLIDER = """
<robot name="slider"><link name="base"/>
  <link name="car"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="car"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><axis xyz="0.6 0 0.8"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="turn" type="revolute"><parent link="car"/><child link="arm"/>
    <origin xyz="0.3 0 0.1" rpy="0.1 -0.5 0.2"/><axis xyz="0 0.6 -0.8"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
</robot>"""


@pytest.mark.parametrize('joints', [None, ('turn',), ('slide', 'turn')])
def test_points_are_where_pinocchio_has_them(joints):
    robot = load_robot('humanoid_arm' if joints is None else SLIDER, joints=joints)
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, (5, robot.n_joints))
    offsets = rng.normal(size=(robot.n_joints, 3))
    positions, jacobians = points_motion(robot, robot.joints, offsets, q)
    data = robot.model.createData()
    for k, configuration in enumerate(q):
        pin.computeJointJacobians(robot.model, data, configuration)
        for i, offset in enumerate(offsets):
            place = data.oMi[i + 1]
            np.testing.assert_allclose(positions[k, i], place.act(offset), atol=1e-12)
            frame = pin.SE3(np.eye(3), place.rotation @ offset)
            moved = pin.getJointJacobian(
                robot.model, data, i + 1, pin.LOCAL_WORLD_ALIGNED
            ).reshape(6, -1)
            at_point = frame.actionInverse @ moved
            np.testing.assert_allclose(jacobians[k, i], at_point[:3], atol=1e-12)
