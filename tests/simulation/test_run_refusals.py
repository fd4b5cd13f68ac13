# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What cannot be simulated is refused with its name, and arms of one joint are arms."""

import re

from armid_ros.arm import ArmModel
from armid_ros.effects import parse_effect
from armid_ros.errors import ModelError
from armid_ros.motion import Motion
from armid_ros.robots import load_robot, robot_from_urdf
from armid_ros.simulation import Elasticity, MotorControl, Plant, simulate, SimulatedArm
from armid_ros.simulation.controller import Controller
import numpy as np
import pytest

ONE_JOINT = """
<robot name="one"><link name="base"/>
  <link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="{mass}"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hinge" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="20"/></joint>
</robot>
"""


def one_joint(kind='revolute', mass=1.0):
    return robot_from_urdf(ONE_JOINT.format(kind=kind, mass=mass), source='one.urdf')


def sine(joints):
    t = np.arange(300) / 100.0
    angle = 2.0 * t[:, np.newaxis] + np.arange(len(joints))
    return Motion(joints, t, 0.1 * np.sin(angle), 0.2 * np.cos(angle), -0.4 * np.sin(angle))


@pytest.mark.parametrize('kind', ['revolute', 'continuous'])
def test_an_arm_of_one_joint_follows(kind):
    """Without a range there is no middle of it, and no warning either."""
    robot = one_joint(kind)
    run = simulate(ArmModel(robot), sine(robot.joints), rng=np.random.default_rng(0))
    assert np.abs(run.truth.q - run.reference.q).max() < 1e-3


def test_a_link_of_negative_mass_is_named():
    robot = load_robot('humanoid_arm')
    bodies = robot.rigid_parameters.reshape(-1, 10).copy()
    bodies[2] *= -1.0
    arm = ArmModel(robot.with_inertias(bodies.ravel()))
    with pytest.raises(ModelError, match=f"'{robot.links[2]}'.*-"):
        simulate(arm, sine(robot.joints), rng=np.random.default_rng(0))


def test_a_joint_that_moves_nothing_cannot_be_simulated():
    text = ONE_JOINT.format(kind='revolute', mass=1)
    text = re.sub('<inertial>.*</inertial>', '', text, flags=re.DOTALL)
    with pytest.raises(ModelError, match=r"hinge'.* 'arm'"):
        Plant(ArmModel(robot_from_urdf(text)))


class Pushing(Controller):
    """Always more of what there is."""

    def feedforward(self, desired):
        """Return no torque."""
        return np.zeros_like(desired.q)

    def torque(self, q, dq, desired, feedforward):
        """Return torque along the velocity."""
        return 1e3 * dq + 1.0


def test_an_arm_that_flies_away_does_not_follow_and_warns_of_nothing():
    robot = robot_from_urdf(
        ONE_JOINT.format(kind='continuous', mass=1.0).replace('effort="20"', 'effort="1e300"'),
        source='one.urdf',
    )
    with pytest.raises(ModelError, match='hinge'):
        simulate(
            ArmModel(robot),
            sine(robot.joints),
            rng=np.random.default_rng(0),
            controller=Pushing(),
        )


def test_what_needs_springs_or_has_none_is_told_so():
    robot = load_robot('two_link_elastic')
    springs, rotors = (
        parse_effect(text, robot)
        for text in ('joint_elasticity:compliance=0.001', 'rotor_inertia:rotor_inertia=0.1')
    )
    arm = ArmModel(robot).with_effect(*springs).with_effect(*rotors)
    plant = Plant(arm, elasticity=Elasticity())
    with pytest.raises(ModelError, match='effects'):
        SimulatedArm(plant, rng=np.random.default_rng(0)).become(ArmModel(robot))
    with pytest.raises(ModelError, match='ComputedTorque'):
        MotorControl.of(Plant(arm))
