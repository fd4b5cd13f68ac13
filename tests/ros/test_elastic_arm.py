# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm with elastic joints, live: both sides on topics, recorded, identified from the bag."""

from armid_ros.robots import load_robot
import numpy as np
from sensor_msgs.msg import Imu, JointState

from tests.ros.test_simulated_arm import SECOND, still_arm

ROBOT = load_robot('two_link_elastic')
SIDES = ('joint_states', 'link/joint_states', 'reference/joint_states', 'link1/imu', 'link2/imu')


def test_both_sides_are_published_with_one_stamp(bench):
    arm = still_arm(bench, robot='two_link_elastic', rate=100.0, start='0.3,-0.4')
    kinds = (JointState, JointState, JointState, Imu, Imu)
    heard = [bench.listen(kind, topic) for kind, topic in zip(kinds, SIDES, strict=True)]
    bench.settle()
    stamp = arm.step()
    bench.spin_until(lambda: all(heard), 'all topics')
    stamps = {m[0].header.stamp.sec * SECOND + m[0].header.stamp.nanosec for m in heard}
    assert stamps == {stamp}
    motor, link, reference, *imus = (messages[0] for messages in heard)
    for message in (motor, link, reference):
        np.testing.assert_allclose(message.position, [0.3, -0.4], atol=1e-12)
    assert [m.header.frame_id for m in imus] == list(ROBOT.links)
    up = imus[1].linear_acceleration
    np.testing.assert_allclose([up.x, up.y, up.z], [0.0, 0.0, 9.81], atol=1e-9)


def test_springs_without_rotors_are_said_and_twist_under_load(bench):
    rosout = bench.rosout()
    arm = still_arm(bench, rate=100.0, effects=['joint_elasticity:compliance=0.0005'])
    states = bench.listen(JointState, 'joint_states')
    arm.step()
    bench.spin_until(lambda: states and any('add rotor_inertia' in m.msg for m in rosout))
    assert bench.probe.count_publishers('link/joint_states') == 0
