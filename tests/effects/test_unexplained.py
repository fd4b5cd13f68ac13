# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where a search for the order of a ripple starts."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.effects.base import Unexplained
from armid_ros.effects.drive import wave_gains
from armid_ros.motion import Motion
from armid_ros.robots import robot_from_urdf
import numpy as np
import pytest


def test_gains_are_those_of_least_squares():
    rng = np.random.default_rng(0)
    angle, rest, weight = rng.uniform(-1.0, 1.0, 300), rng.normal(size=300), rng.uniform(size=300)
    columns = weight[:, np.newaxis] * np.column_stack([np.cos(7.0 * angle), np.sin(7.0 * angle)])
    fit = columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]
    assert wave_gains(angle, rest, weight, np.array([7.0]))[0] == pytest.approx(np.sum(fit**2))


@pytest.mark.parametrize(
    ('kind', 'order', 'reach'), [('revolute', 27.0, 1.5), ('prismatic', 628.0, 0.3)]
)
def test_the_search_begins_at_the_order_of_a_ripple(kind, order, reach):
    """The screw of a sliding joint has a turn every 10 mm."""
    robot = robot_from_urdf(
        '<robot name="one"><link name="base"/><link name="moved"><inertial><mass value="1"/>'
        '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>'
        f'<joint name="axis" type="{kind}"><parent link="base"/><child link="moved"/>'
        '<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="9" velocity="9"/></joint></robot>',
        gravity='earth',
    )
    t = np.linspace(0.0, 20.0, 2001)
    q = (reach * np.sin(1.3 * t))[:, np.newaxis]
    rest = 0.4 * np.sin(order * q + 0.7) + np.random.default_rng(0).normal(size=q.shape)
    motion = Motion(robot.joints, t, q, 0.0 * q, 0.0 * q, rest)
    left = Unexplained(motion, q, rest, np.ones_like(q), np.empty((len(t), 1, 0)))
    (starts,) = make_effect('torque_ripple', robot).shape_starts(left, ArmModel(robot))
    assert np.min(np.abs(starts / order - 1.0)) < 0.01
