# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated arm, rigid or elastic, moves as it is told, and refuses the rest."""

import re

from armid_ros.errors import ArmidError
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.robots import load_robot
from builtin_interfaces.msg import Duration, Time
import numpy as np
import pytest
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from .conftest import busy

SECOND = 10**9
ROBOT = load_robot('humanoid_arm')
HOME = (ROBOT.lower + ROBOT.upper) / 2.0


def trajectory(goal, seconds=1, joints=ROBOT.joints, stamp=None):
    n = len(joints)
    point = JointTrajectoryPoint(
        positions=[float(q) for q in goal],
        velocities=[0.0] * n,
        accelerations=[0.0] * n,
        time_from_start=Duration(sec=seconds),
    )
    message = JointTrajectory(joint_names=list(joints), points=[point])
    if stamp is not None:
        message.header.stamp = Time(sec=stamp)
    return message


def still_arm(bench, **parameters):
    """Make an arm that moves only when the test steps it, from a stamp of 100 s on."""
    parameters = {'rate': 100.0, 'real_time_factor': 0.0, **parameters}
    arm = bench.add(lambda **kw: SimulatedArmNode(start_ns=100 * SECOND, **kw), **parameters)
    if arm._timer is not None:
        arm._timer.cancel()
    return arm


def send(bench, message):
    publisher = bench.matched_publisher(JointTrajectory, 'joint_trajectory', LATCHED)
    publisher.publish(message)
    bench.settle()


def stamps(states):
    return [s.header.stamp.sec * SECOND + s.header.stamp.nanosec for s in states]


def step_to_rest(bench, arm, states, limit=1000):
    for _ in range(limit):
        stamp = arm.step()
        if not arm.moving:
            bench.spin_until(lambda last=stamp: stamps(states)[-1:] == [last])
            return states[-1]
    pytest.fail('the arm never came to rest')


def test_it_holds_its_pose_follows_a_trajectory_to_its_end_and_is_put_back(bench):
    arm = still_arm(bench)
    states = bench.listen(JointState, 'joint_states')
    description = bench.listen(String, 'robot_description', LATCHED)
    bench.settle()
    stepped = [arm.step() for _ in range(20)]
    bench.spin_until(lambda: len(states) == 20 and description)
    assert load_robot(description[0].data).joints == ROBOT.joints == tuple(states[-1].name)
    assert stepped == [100 * SECOND + k * SECOND // 100 for k in range(1, 21)] == stamps(states)
    np.testing.assert_allclose(states[-1].position, HOME, atol=1e-9)
    goal = HOME + 0.02 * np.arange(6)
    send(bench, trajectory(goal[::-1], joints=ROBOT.joints[::-1]))  # matched by name
    last = step_to_rest(bench, arm, states)
    np.testing.assert_allclose(last.position, goal, atol=1e-4)
    for _ in range(20):
        arm.step()
    bench.settle()
    np.testing.assert_allclose(states[-1].position, goal, atol=1e-4)
    np.testing.assert_allclose(states[-1].velocity, 0.0, atol=1e-3)
    before = arm.stamp_ns
    assert bench.call('simulated_arm/reset').success
    assert arm.step() == before + SECOND // 100
    bench.settle()
    np.testing.assert_allclose(states[-1].position, HOME, atol=1e-6)


def test_a_stamped_trajectory_begins_at_its_stamp(bench):
    arm = still_arm(bench)
    states = bench.listen(JointState, 'joint_states')
    send(bench, trajectory(HOME + 0.1, stamp=101))
    for _ in range(100):
        arm.step()
    bench.settle()
    np.testing.assert_allclose(states[-1].position, HOME, atol=1e-9)
    assert arm.moving
    last = step_to_rest(bench, arm, states)
    assert last.header.stamp.sec == 102


def spoil(what):
    message = trajectory(HOME + 0.1)
    if what == 'unknown joint':
        message.joint_names[0] = 'tail'
    elif what == 'velocity limit':
        message.points[0].time_from_start = Duration(nanosec=10_000_000)
    elif what == 'another time':
        message.header.stamp = Time(sec=7)
    return message


def test_a_bad_trajectory_is_refused_with_the_reason_and_the_arm_takes_the_next_one(bench):
    arm = still_arm(bench)
    states = bench.listen(JointState, 'joint_states')
    publisher = bench.matched_publisher(JointTrajectory, 'joint_trajectory', LATCHED)
    reasons = {'unknown joint': "'tail'", 'velocity limit': 'velocity', 'another time': '93 s'}
    for what, reason in reasons.items():
        publisher.publish(spoil(what))
        bench.settle()
        arm.step()
        assert reason in arm.complaints.latest and not arm.moving
    assert arm.complaints.counts['trajectory'] == len(reasons)
    publisher.publish(trajectory(HOME + 0.1))
    bench.settle()
    last = step_to_rest(bench, arm, states)
    np.testing.assert_allclose(last.position, HOME + 0.1, atol=1e-4)


def test_with_simulated_time_it_moves_exactly_as_far_as_the_clock(bench):
    states = bench.listen(JointState, 'joint_states')
    bench.add(SimulatedArmNode, rate=100.0, use_sim_time=True)
    bench.tick(50 * SECOND)
    bench.settle()
    for clock, samples in ((50.01, 1), (50.03, 3), (50.035, 3), (50.5, 50)):
        bench.tick(round(clock * SECOND))
        bench.spin_until(lambda samples=samples: len(states) >= samples, 'joint states')
        bench.settle()
        assert len(states) == samples
        assert states[-1].header.stamp.nanosec == samples * SECOND // 100 or samples == 50


@pytest.mark.parametrize('factor', [1.0, 10.0])
def test_it_publishes_the_clock_where_that_is_not_real_time(bench, factor):
    clock, states = bench.listen(Clock, '/clock'), bench.listen(JointState, 'joint_states')
    bench.add(SimulatedArmNode, rate=20.0, real_time_factor=factor)
    bench.spin_until(lambda: len(states) >= 20 and (clock or factor == 1.0))
    np.testing.assert_array_equal(np.diff(stamps(states)), SECOND // 20)
    assert bool(clock) is (factor > 1.0)


def test_an_arm_in_motion_skips_real_time_only_once_it_rests(bench, monkeypatch):
    arm = still_arm(bench, real_time_factor=1.0)
    send(bench, trajectory(HOME + 0.1))
    arm.step()
    before = arm.stamp_ns
    busy(arm.real_time, monkeypatch)
    arm.catch_up()
    assert arm.moving and arm.stamp_ns - before < SECOND
    while arm.moving:
        arm.step()
    arm.catch_up()
    assert arm.stamp_ns - before > 9 * SECOND


@pytest.mark.parametrize('factor', [1.0, 2.0])
def test_an_arm_that_falls_behind_real_time_reports_it(bench, factor, monkeypatch):
    arm = still_arm(bench, real_time_factor=factor)
    assert not arm.condition()[0]
    before = arm.stamp_ns
    busy(arm.real_time, monkeypatch)
    arm.catch_up()
    said = arm.condition()[0]
    if factor != 1.0:  # everybody goes by its clock
        assert not said
        assert arm.stamp_ns - before < SECOND
        return
    assert arm.stamp_ns - before > 9 * SECOND
    found = re.match(r'(\d+\.\d) s .*real_time_factor', said)
    assert found and float(found[1]) > 9.0
    before = arm.stamp_ns
    assert arm.set_parameters([Parameter('rate', value=50.0)])[0].successful
    assert not arm.condition()[0]
    assert arm.stamp_ns == before


def test_gravity_and_effects_are_parameters(bench):
    def effort(**parameters):
        arm = still_arm(bench, **parameters)
        states = bench.listen(JointState, 'joint_states')
        arm.step()
        bench.spin_until(lambda: states)
        bench.executor.remove_node(arm)
        arm.destroy_node()
        return np.array(states[-1].effort)

    earth, moon = effort(gravity='earth'), effort(gravity='moon')
    np.testing.assert_allclose(moon, earth * 1.62 / 9.81, atol=1e-3)
    shifted = effort(gravity='earth', effects=['torque_offset:torque_offset=0.5'])
    np.testing.assert_allclose(shifted, earth + 0.5, atol=1e-6)


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({'effects': ['stickiness']}, 'stickiness'),
        ({'torque_noise': [0.1, 0.2]}, 'torque_noise.* 6 '),
        ({'start': '0.1,x'}, 'start.*x'),
        ({'rate': 300.0}, '300'),
        ({'model': '/nowhere/model.yaml'}, 'model.yaml'),
    ],
)
def test_an_arm_that_cannot_be_made_is_refused_with_the_reason(bench, parameters, words):
    with pytest.raises(ArmidError, match=words):
        bench.add(SimulatedArmNode, **parameters)


def test_stamps_in_real_time_are_never_in_the_future(bench):
    arm = bench.add(SimulatedArmNode, rate=1000.0)
    ahead = []
    for _ in range(300):
        arm.catch_up()
        ahead.append(arm.stamp_ns - arm.get_clock().now().nanoseconds)
    assert arm.stamp_ns > 0
    assert max(ahead) <= 0


#: Topics of an arm with elastic joints, of both sides of its springs.
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
    assert [m.header.frame_id for m in imus] == list(load_robot('two_link_elastic').links)
    up = imus[1].linear_acceleration
    np.testing.assert_allclose([up.x, up.y, up.z], [0.0, 0.0, 9.81], atol=1e-9)


def test_springs_without_rotors_are_said_and_twist_under_load(bench):
    rosout = bench.rosout()
    arm = still_arm(bench, rate=100.0, effects=['joint_elasticity:compliance=0.0005'])
    states = bench.listen(JointState, 'joint_states')
    arm.step()
    bench.spin_until(lambda: states and any('add rotor_inertia' in m.msg for m in rosout))
    assert bench.probe.count_publishers('link/joint_states') == 0
