# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Columns of long motions, made in parts: the same as made at once."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.rows.regression import filtered_columns
from armid_ros.identification.rows.signals import Conditioning, decimate
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np
import pytest

from ..conftest import multisine

URDF = """
<robot name="swing"><link name="base"/>
  <link name="bar"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="revolute"><parent link="base"/><child link="bar"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="100" effort="100"/></joint>
</robot>"""


@pytest.fixture(scope='module')
def robot():
    return load_robot(URDF)


@pytest.fixture(scope='module')
def long_motion(robot):
    """45 s at 1 kHz: three parts."""
    t = np.arange(45_000) * 1e-3
    w = 2.0 * np.pi * 0.7
    q = np.sin(w * t)[:, None]
    return Motion(robot.joints, t, q, w * np.cos(w * t)[:, None], -(w**2) * q)


@pytest.mark.parametrize(
    'values',
    [
        {'viscous_friction': 0.1, 'presliding_hysteresis': 0.3, 'time_delay': 0.0},
        {'torque_lag': 0.004, 'time_delay': 0.003, 'torque_drift': 0.2},
        {'joint_elasticity': 1e-3, 'torque_gain': 0.1},
    ],
    ids=['history', 'late', 'elastic'],
)
def test_columns_made_in_parts_are_those_made_at_once(robot, long_motion, values):
    arm = ArmModel(robot)
    for name, value in values.items():
        arm = arm.with_effect(make_effect(name, robot), [value])
    used = Conditioning(1000.0, 50.0, 20)
    chosen = np.array([9 + len(values), 3, 9, 10])
    parts = filtered_columns(arm, chosen, long_motion, used)
    whole = decimate(arm.columns(long_motion)[:, :, chosen], used)
    np.testing.assert_allclose(parts, whole, atol=2e-5 * np.abs(whole).max())


def test_the_rigid_body_needs_no_more_samples_than_it_has_content(arm):
    """Every tenth sample of a motion below 1 Hz gives the same columns after the filter."""
    rate, used = 1000.0, Conditioning(1000.0, 20.0, 20)
    assert used.smooth_stride == 10
    motion = multisine(arm.robot.joints, 30.0, rate, seed=3)
    rigid = np.arange(len(arm.robot.rigid_parameters))
    strided = filtered_columns(arm, rigid, motion, used)
    whole = decimate(arm.columns(motion)[:, :, rigid], used)
    scale = np.abs(whole).max(axis=(0, 1))
    np.testing.assert_array_less(np.abs(strided - whole).max(axis=(0, 1)), 3e-3 * scale + 1e-12)
