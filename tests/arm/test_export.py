# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.arm.export import arm_mjcf, arm_urdf, torque_check
from armid_ros.effects import make_effect
from armid_ros.robots import load_robot, robot_from_urdf
import mujoco
import numpy as np
import pinocchio as pin
import pytest

EFFECTS = (
    'viscous_friction:viscous_coefficient=0.3',
    'coulomb_friction:coulomb_torque=0.2',
    'rotor_inertia:rotor_inertia=0.01',
    'torque_offset:torque_offset=0.05',
)


@pytest.fixture
def arm(robot):
    """Return an arm with friction, rotors and offsets."""
    return ArmModel.of(robot, effects=EFFECTS)


def test_what_has_no_place_is_listed_and_said_in_the_file(arm):
    exported = arm_urdf(arm)
    kinds = {line.split(':')[0] for line in exported.without_place}
    assert kinds == {'rotor_inertia', 'torque_offset'}
    assert re.search(r'rotor_inertia of elbow_pitch = 0\.01', exported.text)


def test_mujoco_has_a_place_for_rotor_inertia_and_dry_friction_acts_in_slow_motion(arm):
    exported = arm_mjcf(arm)
    model = mujoco.MjModel.from_xml_string(exported.text)
    np.testing.assert_array_equal(model.dof_armature, 0.01)
    np.testing.assert_array_equal(model.dof_damping, 0.3)
    np.testing.assert_array_equal(model.dof_frictionloss, 0.2)
    np.testing.assert_array_equal(model.opt.gravity, arm.robot.gravity)
    assert {line.split(':')[0] for line in exported.without_place} == {'torque_offset'}
    data = mujoco.MjData(model)
    data.qvel[:] = 0.5
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_constraint, -0.2, rtol=1e-3)


def test_a_payload_is_part_of_its_link(arm):
    payload = np.concatenate([0.5 * np.array([1.0, 0.0, 0.0, 0.03]), [1e-3, 0, 1e-3, 0, 0, 1e-3]])
    loaded = arm.with_effect(make_effect('payload', arm.robot), payload)
    bare, full = (robot_from_urdf(arm_urdf(a).text).rigid_parameters for a in (arm, loaded))
    assert abs(full[50] - bare[50] - 0.5) < 1e-12


CONTROL = (
    '<ros2_control name="arm"><hardware><param name="password">secret</param></hardware>'
    '</ros2_control>'
)


@pytest.mark.parametrize('export', [arm_urdf, arm_mjcf])
@pytest.mark.parametrize('joints', [None, ('shoulder_pitch', 'elbow_pitch')])
def test_the_torque_in_mujoco_is_that_of_the_arm(export, joints):
    arm = ArmModel.of('humanoid_arm', effects=EFFECTS, joints=joints)
    exported = export(arm)
    check = torque_check(exported, arm)
    assert check['states'] == 50
    assert check['share'] < 1e-9
    heavier = replace(exported, text=exported.text.replace('mass="', 'mass="1'))
    heavier = replace(heavier, text=heavier.text.replace('<mass value="', '<mass value="1'))
    assert torque_check(heavier, arm)['share'] > 1e-3
    broken = replace(exported, text=exported.text[:-20])
    assert 'MuJoCo' in torque_check(broken, arm)['not_checked']


CORNERS = [(x, y, z) for x in (0, 2) for y in (0, 1) for z in (0, 1)]
FACES = '1 2 4|1 4 3|5 7 8|5 8 6|1 5 6|1 6 2|3 4 8|3 8 7|1 3 7|1 7 5|2 6 8|2 8 4'
LINK = (
    '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
    'iyz="0"/></inertial>{}</link>'
)
JOINT = (
    '<joint name="j{}" type="continuous"><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/>'
    '<origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/></joint>'
)


@pytest.mark.parametrize(
    ('shape', 'size', 'middle'),
    [
        ('box size="0.1 0.2 0.3"', [0.05, 0.1, 0.15], [0.0, 0.0, 0.0]),
        ('sphere radius="0.1"', [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ('cylinder radius="0.1" length="0.6"', [0.1, 0.3, 0.0], [0.0, 0.0, 0.0]),
        ('capsule radius="0.1" length="0.6"', [0.1, 0.3, 0.0], [0.0, 0.0, 0.0]),
        ('mesh filename="box.obj" scale="0.1 0.1 0.1"', None, [0.1, 0.05, 0.05]),
    ],
)
def test_an_exported_mjcf_has_base_and_shapes_in_their_places(tmp_path, shape, size, middle):
    faces = ''.join(f'f {face}\n' for face in FACES.split('|'))
    (tmp_path / 'box.obj').write_text(''.join(f'v {x} {y} {z}\n' for x, y, z in CORNERS) + faces)
    place = '<origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>'
    body = f'<collision>{place}<geometry><{shape}/></geometry></collision>'
    picture = '<visual><geometry><mesh filename="shape.dae"/></geometry></visual>'
    links = LINK.format('base', body) + LINK.format('a', body + picture) + LINK.format('b', body)
    joints = JOINT.format(1, 'base', 'a') + JOINT.format(2, 'a', 'b')
    (tmp_path / 'arm.urdf').write_text(f'<robot name="r">{links}{joints}</robot>')
    robot = load_robot(tmp_path / 'arm.urdf')
    exported = arm_mjcf(ArmModel(robot))
    assert 'shape.dae' in exported.left_out[0]
    check = torque_check(exported, ArmModel(robot))
    assert check['share'] < 1e-9 and 'shapes' not in check

    model = mujoco.MjModel.from_xml_string(exported.text)
    data, pose = mujoco.MjData(model), robot.model.createData()
    data.qpos[:] = q = np.array([0.3, -0.8])
    mujoco.mj_kinematics(model, data)
    pin.framesForwardKinematics(robot.model, pose, q)
    origin = pin.SE3(pin.rpy.rpyToMatrix(0.4, 0.5, 0.6), np.array([0.1, 0.2, 0.3]))
    for geom, link in enumerate(('base', 'a', 'b')):
        wanted = pose.oMf[robot.model.getFrameId(link)] * origin
        np.testing.assert_allclose(data.geom_xpos[geom], wanted.act(np.array(middle)), atol=1e-9)
        if size is not None:
            np.testing.assert_allclose(model.geom_size[geom], size, atol=1e-12)
            np.testing.assert_allclose(
                data.geom_xmat[geom].reshape(3, 3), wanted.rotation, atol=1e-9
            )
    gone = replace(exported, text=exported.text.replace('box.obj', 'gone.obj'))
    assert ('shapes' in torque_check(gone, ArmModel(robot))) == (size is None)


def test_damping_that_is_not_identified_stays_as_described():
    text = load_robot('humanoid_arm').urdf.replace('</joint>', '<dynamics damping="2"/></joint>')
    arm = ArmModel(robot_from_urdf(text))
    assert torque_check(arm_urdf(arm), arm)['share'] < 1e-9


def test_an_exported_urdf_has_its_meshes_and_no_password(tmp_path):
    (tmp_path / 'shape.stl').write_bytes(b'')
    text = load_robot('humanoid_arm').urdf
    visual = '<visual><geometry><mesh filename="shape.stl"/></geometry></visual>'
    text = text.replace('</link>', f'{visual}</link>', 1)
    (tmp_path / 'arm.urdf').write_text(text.replace('</robot>', f'{CONTROL}</robot>'))
    exported = arm_urdf(ArmModel(load_robot(tmp_path / 'arm.urdf')))
    assert 'secret' not in exported.text
    assert exported.left_out == ('ros2_control',)
    assert f'"file://{tmp_path}/shape.stl"' in exported.text
