# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from armid_ros.arm import ArmModel
from armid_ros.errors import ModelError
from armid_ros.robots import robot_from_urdf
from armid_ros.simulation import Plant
import pytest

MASSLESS = """<robot name="r"><link name="base"/><link name="hand"/>
<joint name="wrist" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def test_a_joint_that_moves_nothing_cannot_be_simulated():
    arm = ArmModel(robot_from_urdf(MASSLESS))
    with pytest.raises(ModelError, match=r"wrist'.* 'hand'"):
        Plant(arm)
