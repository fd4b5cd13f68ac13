# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that moved, or stood elsewhere, while the model holds them."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.identification import grade, identify
from armid_ros.identification.assess.sensor_faults import held_elsewhere
from armid_ros.model import inverse_dynamics
from armid_ros.recording import Recording
from armid_ros.recording.recording import PositionRange
from armid_ros.robots import described_at, held_joints, load_robot, robot_from_urdf
import numpy as np
import pytest

from ..conftest import multisine

RATE = 100.0
GRIPPER = """<robot name="with_a_gripper">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="4"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="left"><inertial><origin xyz="0 0 0.02"/><mass value="0.03"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
  <link name="right"><inertial><origin xyz="0 0 0.02"/><mass value="0.03"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="3" effort="90"/></joint>
  <joint name="jaw" type="prismatic"><parent link="arm"/><child link="left"/>
    <origin xyz="0.6 0 0"/><axis xyz="0 1 0"/>
    <limit lower="0.01" upper="0.05" velocity="1" effort="9"/></joint>
  <joint name="other_jaw" type="prismatic"><parent link="arm"/><child link="right"/>
    <origin xyz="0.6 0 0"/><axis xyz="0 -1 0"/><mimic joint="jaw" multiplier="2" offset="0.01"/>
    <limit lower="0" upper="0.2" velocity="1" effort="9"/></joint>
</robot>"""


@pytest.fixture(scope='module')
def whole():
    return load_robot('humanoid_arm')


def without(whole, joint):
    driven = tuple(name for name in whole.joints if name != joint)
    return load_robot('humanoid_arm', joints=driven)


def run(whole, joint, positions, seed=1, source='run'):
    """Record all but one joint of an arm, which is at given positions, shape (N,) or ()."""
    motion = multisine(whole.joints, 20.0, RATE, seed=seed, base_hz=0.12)
    own = whole.index(joint)
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    q[:, own], dq[:, own], ddq[:, own] = positions(motion, own)
    arm = ArmModel(whole)
    tau = arm.torque(replace(motion, q=q, dq=dq, ddq=ddq))
    tau += 0.01 * np.random.default_rng(seed).normal(size=tau.shape)
    rest = [k for k in range(whole.n_joints) if k != own]
    return Recording(
        joints=tuple(whole.joints[k] for k in rest),
        t=motion.t,
        q=q[:, rest],
        tau=tau[:, rest],
        source=source,
        others=(PositionRange(joint, float(q[:, own].min()), float(q[:, own].max())),),
    )


def moving(motion, own):
    return motion.q[:, own], motion.dq[:, own], motion.ddq[:, own]


def standing(position):
    return lambda motion, own: (position, 0.0, 0.0)


def felt(robot):
    motion = multisine(robot.joints, 5.0, RATE, seed=2)
    return motion.with_torque(inverse_dynamics(robot, motion))


def graded(robot, recordings):
    structure = ArmModel(robot)
    result = identify(structure, recordings, rng=np.random.default_rng(0))
    return grade(result, structure, recordings, {})


@pytest.mark.parametrize('position', [0.0, 1.1])
def test_the_described_arm_with_a_joint_held_is_the_whole_arm_with_it_there(whole, position):
    joint = whole.joints[3]
    motion = multisine(whole.joints, 2.0, RATE, seed=3)
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    q[:, 3], dq[:, 3], ddq[:, 3] = position, 0.0, 0.0
    rest = [0, 1, 2, 4, 5]
    expected = inverse_dynamics(whole, replace(motion, q=q, dq=dq, ddq=ddq))
    held = described_at(without(whole, joint).with_gravity([0.3, 0.1, -9.0]), {joint: position})
    np.testing.assert_allclose(held.gravity, [0.3, 0.1, -9.0])
    held = held.with_gravity(whole.gravity)
    subset = type(motion)(held.joints, motion.t, q[:, rest], dq[:, rest], ddq[:, rest])
    np.testing.assert_allclose(inverse_dynamics(held, subset), expected[:, rest], atol=1e-9)


def test_a_joint_that_mimics_one_that_is_held_follows_it():
    robot = robot_from_urdf(GRIPPER)
    assert [joint.position for joint in held_joints(robot)] == pytest.approx([0.01, 0.03])
    named = described_at(robot, {'jaw': 0.04, 'other_jaw': 0.09}).rigid_parameters
    np.testing.assert_allclose(described_at(robot, {'jaw': 0.04}).rigid_parameters, named)
    np.testing.assert_allclose(described_at(robot, {}).rigid_parameters, robot.rigid_parameters)


@pytest.mark.parametrize('index', [1, 4])
def test_a_joint_that_moves_without_being_driven_is_never_passed_over(whole, index):
    joint = whole.joints[index]
    found = graded(without(whole, joint), [run(whole, joint, moving)])
    (reason,) = (text for text in found.reasons if joint in text and 'not driven' in text)
    assert '--joints' in reason
    assert found.word != 'good'


@pytest.mark.parametrize(
    ('joint', 'place', 'matters'), [(1, 0.9, True), (1, 0.0, False), (5, 0.9, False)]
)
def test_a_joint_that_carries_others_and_stands_elsewhere_is_named(whole, joint, place, matters):
    """A last joint is a part of the body, wherever it stands."""
    joint = whole.joints[joint]
    robot = without(whole, joint)
    found = list(held_elsewhere(robot, [run(whole, joint, standing(place))], [felt(robot)]))
    assert len(found) == matters
    assert all(joint in one.text and '0.9 rad' in one.text for one in found)


def test_a_joint_that_stands_elsewhere_in_each_recording_has_moved(whole):
    joint = whole.joints[4]
    robot = without(whole, joint)
    recordings = [
        run(whole, joint, standing(place), seed, f'run_{seed}')
        for seed, place in ((1, -1.2), (2, 1.2))
    ]
    (found,) = held_elsewhere(robot, recordings, [felt(robot)])
    assert joint in found.text and '-1.2' in found.text
