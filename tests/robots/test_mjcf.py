# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""MJCF as a robot: its torque is that of MuJoCo, and what has no place is said."""

import sys

from armid_ros.arm import ArmModel
from armid_ros.errors import RobotError
from armid_ros.motion import Motion
from armid_ros.robots import collision_model, load_robot
import mujoco
import numpy as np
import pytest

from tests.clearance import path_clearance

from .mjcf_arms import ARMS

G = (0.0, 0.0, -9.81)


@pytest.fixture
def written(tmp_path):
    """Return what writes a file beside no other and returns its path."""

    def write(text):
        (tmp_path / 'arm.xml').write_text(text)
        return tmp_path / 'arm.xml'

    return write


def number(model, joint):
    found = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    return found if found >= 0 else int(joint.removeprefix('joint_'))


@pytest.mark.parametrize('name', ARMS)
def test_torque_is_that_of_mujoco(written, name):
    path = written(f'<?xml version="1.0"?>\n<!-- as published -->\n{ARMS[name]}')
    model = mujoco.MjModel.from_xml_path(str(path))
    robot = load_robot(path, gravity=G)
    joints = [number(model, joint) for joint in robot.joints]
    dofs, places = model.jnt_dofadr[joints], model.jnt_qposadr[joints]
    rng = np.random.default_rng(0)
    q, dq, ddq = (rng.uniform(-2.0, 2.0, (20, robot.n_joints)) for _ in range(3))

    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    wanted = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[places], data.qvel[dofs], data.qacc[dofs] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(model, data)
        wanted[k] = data.qfrc_inverse[dofs]

    motion = Motion(robot.joints, np.arange(20.0), q, dq, ddq)
    rotors = ddq * model.dof_armature[dofs]  # not part of the description
    found = ArmModel(robot).torque(motion) + rotors + dq * robot.urdf_damping
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_array_equal(robot.urdf_damping, model.dof_damping[dofs])
    np.testing.assert_array_equal(robot.urdf_friction, model.dof_frictionloss[dofs])
    limited = np.flatnonzero(model.jnt_limited[joints])
    assert list(np.flatnonzero(np.isfinite(robot.lower))) == list(limited)
    limits = np.stack([robot.lower, robot.upper], axis=1)
    np.testing.assert_array_equal(limits[limited], model.jnt_range[joints][limited])


def test_the_text_of_a_loaded_arm_is_the_same_arm(written):
    """A bag and a simulated arm hold it as a URDF."""
    robot = load_robot(written(ARMS['defaults of defaults']))
    again = load_robot(robot.urdf)
    np.testing.assert_array_equal(again.rigid_parameters, robot.rigid_parameters)
    assert again.description.joints == robot.description.joints


@pytest.mark.parametrize(
    ('joint', 'actuator', 'limit'),
    [
        ('actuatorfrcrange="-50 50"', '<motor joint="j"/>', 50.0),
        ('', '<position joint="j" kp="2000" forcerange="-87 87" gear="2"/>', 174.0),
        ('', '<motor joint="j" gear="100" ctrlrange="-1 1"/>', 100.0),
        ('actuatorfrcrange="-9 9"', '<general joint="j" forcerange="-12 12"/>', 9.0),
        ('', '<position joint="j" ctrlrange="-3 3"/>', np.inf),
    ],
)
def test_the_torque_limit_is_that_of_joint_or_actuator(written, joint, actuator, limit):
    path = written(
        f'<mujoco><worldbody><body name="a"><joint name="j" {joint}/><geom size="0.1"/></body>'
        f'</worldbody><actuator>{actuator}</actuator></mujoco>'
    )
    assert load_robot(path).torque_limit[0] == limit


def test_a_gripper_with_an_equality_is_not_driven(written):
    robot = load_robot(written(ARMS['a gripper with an equality']))
    assert robot.joints == ('j1',)
    assert robot.description.by_name['finger_joint2'].mimic.joint == 'finger_joint1'


def test_shapes_are_collision_bodies_of_their_size(written):
    robot = load_robot(written(ARMS['inertia of shapes']))
    assert len(collision_model(robot).geometry.geometryObjects) == 7  # a capsule is three
    two = (
        '<mujoco><worldbody><body name="a"><joint axis="0 0 1"/><geom type="capsule" '
        'size="0.1 0.3"/></body><body name="b" pos="0 0 2"><joint axis="0 0 1"/><geom type="box" '
        'size="1 1 0.5"/></body></worldbody></mujoco>'
    )
    clearance = path_clearance(collision_model(load_robot(written(two))), np.zeros((1, 2)))
    assert clearance == pytest.approx(1.1)


def test_meshes_are_found_and_those_that_are_not_are_said(written, tmp_path):
    corners = [(x, y, z) for x in (0, 2) for y in (0, 1) for z in (0, 1)]
    (tmp_path / 'assets').mkdir()
    (tmp_path / 'assets' / 'box.obj').write_text(
        ''.join(f'v {x} {y} {z}\n' for x, y, z in corners)
        + 'f 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\n'
        'f 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\nf 2 6 8\nf 2 8 4\n'
    )
    text = (
        '<mujoco><compiler meshdir="assets"/><asset><mesh file="box.obj" scale="0.1 0.1 0.1"/>'
        '<mesh name="gone" file="gone.obj"/><texture name="t" type="2d" file="t.png"/>'
        '<material name="m" texture="t"/></asset><worldbody><body name="a"><joint/>{inertial}'
        '<geom type="mesh" mesh="box" pos="0 0 1" euler="0 90 0" material="m"/>'
        '<geom type="mesh" mesh="gone"/></body></worldbody></mujoco>'
    )
    robot = load_robot(
        written(text.format(inertial='<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'))
    )
    assert any("'a'" in note and 'gone.obj' in note for note in robot.notes)
    model = collision_model(robot)
    assert model.left_out == ()
    (body,) = model.geometry.geometryObjects
    corners = np.array([body.placement.act(point) for point in body.geometry.points()])
    np.testing.assert_allclose(corners.min(axis=0), [0.0, 0.0, 0.8], atol=1e-12)
    np.testing.assert_allclose(corners.max(axis=0), [0.1, 0.1, 1.0], atol=1e-12)
    with pytest.raises(RobotError, match=r"'a'.*gone\.obj"):
        load_robot(written(text.format(inertial='')))


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('<joint type="ball" name="b"/>', "joint 'b'"),
        ('<freejoint/><body><joint/><geom size="1"/></body>', "body 'a' floats"),
        ('<joint type="hing"/>', 'MuJoCo: .*hing'),
        ('<geom type="mesh" mesh="none"/>', 'MuJoCo: .*none'),
    ],
)
def test_what_is_no_arm_is_refused_with_its_name(written, text, said):
    path = written(
        f'<mujoco><worldbody><body name="a"><geom size="1"/>{text}</body></worldbody></mujoco>'
    )
    with pytest.raises(RobotError, match=said) as refused:
        load_robot(path)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('<worldbody><body name="cube"><freejoint/><geom size="1"/></body></worldbody>', 'cube'),
        ('<option gravity="0 0 -1.62"/>', '--gravity=0,0,-1.62'),
        ('<equality><connect body1="a" anchor="0 0 0"/></equality>', 'connect'),
        ('<tendon><fixed><joint joint="j" coef="1"/></fixed></tendon>', '1 tendons'),
        ('<default><joint stiffness="3"/></default>', 'stiffness'),
        ('<default><joint damping="1 2"/></default>', 'polynomial'),
    ],
)
def test_what_has_no_place_in_a_urdf_is_said(written, text, said):
    arm = '<body name="a"><joint name="j"/><geom size="0.1"/></body>'
    path = written(f'<mujoco>{text}<worldbody>{arm}</worldbody></mujoco>')
    assert any(said in note for note in load_robot(path).notes)


def test_a_long_urdf_is_told_from_an_mjcf_at_once(written):
    robot = load_robot('humanoid_arm')
    comments = '<!-- <mujoco> -->\n' * 5000
    urdf = robot.urdf.replace('<robot', comments + '<robot', 1)
    assert load_robot(written(urdf)).joints == robot.joints
    assert load_robot(written(comments + ARMS['full inertia'])).joints == ('j1', 'j2')


def test_without_mujoco_the_package_to_install_is_named(written, monkeypatch):
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    with pytest.raises(RobotError, match=r'armid_ros\[mujoco\]'):
        load_robot(written(ARMS['full inertia']))
