# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
import re
from xml.etree import ElementTree

from armid_ros.arm import ArmModel
from armid_ros.arm.export import arm_mjcf, arm_urdf, torque_check
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics, random_motion
from armid_ros.model.mjcf_export import export_mjcf
from armid_ros.model.pseudo_inertia import link_parameters, pseudo_inertia
from armid_ros.model.urdf_export import export_urdf
from armid_ros.robots import load_robot, robot_from_urdf
import mujoco
import numpy as np
import pytest

from benchmarks.real_recordings import EMPS_URDF, example_robot

ARM = """<?xml version="1.0"?>
<!-- a hand-made arm -->
<robot name="häkchen">
  <link name="base"/>
  <link name='upper'>
    <inertial>  <!-- from the drawing -->
      <mass   value = '2.0' />
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="lower"/>
  <link name="flange"><inertial><origin xyz="0 0 0.1"/><mass value="0.4"/>
    <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>
  <link name="finger_link"><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="9" velocity="3"/>
    <dynamics friction='0.5'/> <!-- a guess -->
  </joint>
  <joint name="elbow" type="revolute">
    <origin xyz="0 0 0.3"/><parent link="upper"/><child link="lower"/><axis xyz="0 1 0.2"/>
    <limit lower="-2" upper="2" effort="9" velocity="3"/>
  </joint>
  <joint name="mount" type="fixed">
    <origin xyz="0 0.1 0.2" rpy="0.3 0 0"/><parent link="lower"/><child link="flange"/>
  </joint>
  <joint name="finger" type="prismatic">
    <origin xyz="0 0 0.1"/><parent link="flange"/><child link="finger_link"/><axis xyz="1 0 0"/>
    <limit lower="0.01" upper="0.04" effort="9" velocity="3"/>
  </joint>
</robot>
"""


def other_bodies(robot, seed=0, spread=0.2):
    """Return the robot with other bodies: every frame stretched, and no link without mass."""
    rng = np.random.default_rng(seed)
    matrices = pseudo_inertia(robot.rigid_parameters.reshape(-1, 10))
    matrices += 1e-3 * np.diag([0.01, 0.01, 0.01, 1.0])
    stretch = np.exp(spread * rng.normal(size=(len(matrices), 4)))
    matrices = stretch[:, :, np.newaxis] * matrices * stretch[:, np.newaxis, :]
    return robot.with_inertias(link_parameters(matrices).ravel())


def read(text, robot):
    return robot_from_urdf(text, joints=robot.joints)


@pytest.fixture(
    params=[
        'humanoid_arm',
        'panda_description/urdf/panda.urdf',
        'ur_description/urdf/ur10_robot.urdf',
        EMPS_URDF,
        ARM,
    ],
    ids=['humanoid_arm', 'panda', 'ur10', 'emps', 'hand-made'],
)
def robot(request):
    path = request.param.endswith('.urdf')
    source = str(example_robot(request.param)) if path else request.param
    return other_bodies(load_robot(source))


def test_description_read_again_has_the_parameters(robot):
    found = read(export_urdf(robot, {}), robot).rigid_parameters
    scale = np.abs(robot.rigid_parameters).max()
    np.testing.assert_allclose(found, robot.rigid_parameters, rtol=0, atol=1e-13 * scale)


def test_pinocchio_and_mujoco_agree_with_the_model_friction_and_rotors_included(robot):
    effects = ('viscous_friction:viscous_coefficient=0.3', 'rotor_inertia:rotor_inertia=0.02')
    arm = ArmModel.of(robot, effects=effects)
    motion = random_motion(robot, np.random.default_rng(1), 30)
    without_rotors = arm.torque(motion) - 0.02 * motion.ddq
    assert torque_check(arm_mjcf(arm), arm)['share'] < 1e-9
    urdf = arm_urdf(arm)
    assert torque_check(urdf, arm)['share'] < 1e-9
    again = read(urdf.text, robot)
    in_pinocchio = inverse_dynamics(again, motion) + again.urdf_damping * motion.dq
    bound = 1e-9 * np.abs(without_rotors).max()
    np.testing.assert_allclose(in_pinocchio, without_rotors, atol=bound)


def rest(urdf):
    """Return a description without inertials, dynamics and the remarks at its end."""
    for pattern in (r'<inertial>.*?</inertial>', r'<dynamics[^>]*/>', r'<!--\s*a - - b\s*-->'):
        urdf = re.sub(pattern, '', urdf, flags=re.DOTALL)
    return ElementTree.canonicalize(urdf, with_comments=True, strip_text=True)


def test_only_inertials_and_dynamics_change(robot):
    damping = dict.fromkeys(robot.joints, 0.25)
    friction = dict.fromkeys(robot.joints, 0.125)
    text = export_urdf(robot, {'damping': damping, 'friction': friction}, ('a -- b',))
    assert rest(text) == rest(robot.urdf)
    again = read(text, robot)
    np.testing.assert_array_equal(again.urdf_damping, 0.25)
    np.testing.assert_array_equal(again.urdf_friction, 0.125)


def test_links_that_leave_no_body_for_the_driven_one_are_scaled():
    """The identified body is lighter than the flange was said to be."""
    robot = load_robot(ARM)
    pi = robot.rigid_parameters.copy()
    pi[10:] *= 0.1
    robot = robot.with_inertias(pi)
    text = export_urdf(robot, {})
    np.testing.assert_allclose(read(text, robot).rigid_parameters, pi, atol=1e-15)
    assert mujoco.MjModel.from_xml_string(text).nv == 3


def test_what_no_body_has_is_refused():
    robot = load_robot('humanoid_arm')
    pi = robot.rigid_parameters.copy()
    pi[4] = -1.0
    robot = robot.with_inertias(pi)
    for export in (export_urdf, export_mjcf):
        with pytest.raises(ModelError, match=f"link '{robot.links[0]}'"):
            export(robot, {})
