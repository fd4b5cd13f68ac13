# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small arms and problems for the excitation tests."""

from armid_ros.arm import ArmModel
from armid_ros.excitation import DesignSettings
from armid_ros.robots import collision_model, robot_from_urdf
import pytest

#: Joints of an arm of two links, as `urdf` takes them.
TWO_LINKS = (
    ('shoulder', 'revolute', 'base', 'upper', '0 0 0.5', '0 1 0', -2.5, 2.5, 60),
    ('elbow', 'revolute', 'upper', 'lower', '0 0 0.4', '1 0 0', -2.5, 2.5, 30),
)


def urdf(*joints, name='small'):
    """Write a URDF of (name, kind, parent, child, xyz, axis, lower, upper, effort) joints."""
    parts = ['<link name="base"/>']
    for joint, kind, parent, child, xyz, axis, lower, upper, effort in joints:
        parts.append(
            f'<link name="{child}"><inertial><origin xyz="0.05 0.02 0.1"/><mass value="1.5"/>'
            '<inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0.002" izz="0.01"/>'
            '</inertial><collision><origin xyz="0 0 0.15"/><geometry>'
            '<cylinder radius="0.04" length="0.3"/></geometry></collision></link>'
            f'<joint name="{joint}" type="{kind}"><origin xyz="{xyz}" rpy="0.1 0.3 0"/>'
            f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
            f'<limit lower="{lower}" upper="{upper}" velocity="2" effort="{effort}"/></joint>'
        )
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def with_effects(robot, *names):
    """Return an arm with effects, without their values."""
    return ArmModel.of(robot, effects=names)


@pytest.fixture(scope='session')
def tree():
    """Return a robot with a slide that carries two chains of revolute joints."""
    return robot_from_urdf(
        urdf(
            ('slide', 'prismatic', 'base', 'cart', '0 0 0.5', '0 1 0', -0.5, 0.5, 200),
            ('left', 'revolute', 'cart', 'left_arm', '0 0.3 0', '1 0 0', -2, 2, 40),
            ('left_elbow', 'revolute', 'left_arm', 'left_hand', '0 0 0.4', '0 1 1', -2, 2, 30),
            ('right', 'revolute', 'cart', 'right_arm', '0 -0.3 0', '0.3 1 0', -2, 2, 40),
        )
    )


@pytest.fixture(scope='session')
def two_link():
    """Return a robot with two joints."""
    return robot_from_urdf(urdf(*TWO_LINKS))


@pytest.fixture(scope='session')
def two_link_arm(two_link):
    """Return the two-link arm with friction."""
    return with_effects(two_link, 'viscous_friction', 'coulomb_friction')


@pytest.fixture(scope='session')
def humanoid_collision(humanoid):
    """Return the collision bodies of the humanoid arm."""
    return collision_model(humanoid)


@pytest.fixture(scope='session')
def quick():
    """Return settings of a design that takes a second."""
    return DesignSettings(
        period=6.0,
        harmonics=3,
        starts=2,
        candidates=3,
        iterations=30,
    )
