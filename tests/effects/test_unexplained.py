# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where a search for the order of a ripple starts."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.effects.base import Unexplained
from armid_ros.motion import Motion
from armid_ros.robots import robot_from_urdf
import numpy as np
import pytest

from tests.serial_arm import serial_arm


@pytest.mark.parametrize(
    ('kind', 'order', 'reach'), [('revolute', 27.0, 1.5), ('prismatic', 628.0, 0.3)]
)
def test_the_search_begins_at_the_order_of_a_ripple(kind, order, reach):
    """The screw of a sliding joint has a turn every 10 mm."""
    robot = robot_from_urdf(serial_arm(f'axis {kind} 0,0,1 0,0,0'), gravity='earth')
    t = np.linspace(0.0, 20.0, 2001)
    q = (reach * np.sin(1.3 * t))[:, np.newaxis]
    rest = 0.4 * np.sin(order * q + 0.7) + np.random.default_rng(0).normal(size=q.shape)
    motion = Motion(robot.joints, t, q, 0.0 * q, 0.0 * q, rest)
    left = Unexplained(motion, q, rest, np.ones_like(q), np.empty((len(t), 1, 0)))
    (starts,) = make_effect('torque_ripple', robot).shape_starts(left, ArmModel(robot))
    assert np.min(np.abs(starts / order - 1.0)) < 0.01
