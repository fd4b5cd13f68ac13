# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No message ends a node: after each it says what it left out, and works on."""

from armid_ros.nodes.base import ArmidNode
from armid_ros.nodes.online_identifier import OnlineIdentifierNode
from armid_ros.nodes.qos import LATCHED
from armid_ros.nodes.simulated_arm import SimulatedArmNode
from armid_ros.papers.exo.nodes.interaction_identifier import InteractionIdentifierNode
from builtin_interfaces.msg import Duration, Time
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NUMBERS = (1e7, 1e100, 1e154, 1.7e308, -1e154, float('inf'), float('nan'))
STAMPS = (
    Time(sec=-1), Time(sec=-(2**31)), Time(sec=2**31 - 1), Time(sec=1, nanosec=2**32 - 1), Time()
)  # fmt: skip


def states(names, k, **fields):
    """Return the joint state of a slow motion, with something in it that should not be."""
    values = [0.01 * k + 0.1 * j for j in range(len(names))]
    stamp = Time(sec=100 + k // 100, nanosec=k % 100 * 10_000_000)
    message = JointState(name=list(names), position=values, velocity=values, effort=values)
    message.header.stamp = fields.pop('stamp', stamp)
    for name, number in fields.items():
        setattr(message, name, [number, *values[1:]])
    return message


def hostile(names):
    """Return joint states that nobody should send."""
    k = 50
    for number in NUMBERS:
        for name in ('position', 'velocity', 'effort'):
            yield states(names, k := k + 1, **{name: number})
    for stamp in STAMPS:
        yield states(names, k := k + 1, stamp=stamp)
    yield JointState()
    yield JointState(name=list(names))
    yield JointState(name=list(names), position=[1.0])
    yield JointState(name=list(names[:-1]), position=[0.0] * (len(names) - 1))
    yield JointState(name=[names[0]] * 3, position=[0.0] * 3, effort=[0.0] * 3)
    yield JointState(name=['\x1b[31m', '\n' * 100], position=[0.0, 0.0], effort=[0.0, 0.0])


def sent(bench, node, publisher, batch, received):
    """Publish one after the other, so that each has its effect alone."""
    for message in batch:
        count = received()
        publisher.publish(message)
        bench.spin_until(lambda count=count: received() > count, 'a message')


def test_an_identifier_survives_every_joint_state(bench):
    node = bench.add(OnlineIdentifierNode, robot='humanoid_arm')
    names = node.identifier.arm.robot.joints
    publisher = bench.matched_publisher(JointState, 'joint_states')
    good = [states(names, k) for k in range(50)]
    sent(bench, node, publisher, [*good, *hostile(names)], lambda: node.received)
    node.publish_diagnostics()
    node.publish_estimate()
    left_out = sum(node.complaints.counts.values()) + sum(node.identifier.rejected.values())
    assert left_out >= 20
    assert node.complaints.defects == 0


@pytest.mark.parametrize('topic', ['exo/joint_states', 'human/joint_states'])
def test_an_interaction_identifier_survives_every_joint_state(bench, topic):
    node = bench.add(InteractionIdentifierNode)
    machines = node.identifier.machines
    names = (machines.robot if topic.startswith('exo') else machines.other).joints
    publisher = bench.matched_publisher(JointState, topic)
    sent(bench, node, publisher, hostile(names), lambda: node.received)
    node.publish_diagnostics()
    assert sum(node.complaints.counts.values()) >= 10
    assert node.complaints.defects == 0


def trajectories(names):
    """Return trajectories that nobody should send."""

    def trajectory(**fields):
        point = {'positions': [0.0] * len(names), 'time_from_start': Duration(sec=1)}
        message = JointTrajectory(joint_names=list(names))
        message.header.stamp = fields.pop('stamp', Time())
        message.points = [JointTrajectoryPoint(**{**point, **fields})]
        return message

    for number in NUMBERS:
        for name in ('positions', 'velocities', 'accelerations', 'effort'):
            yield trajectory(**{name: [number] * len(names)})
    for stamp in STAMPS[:4]:
        yield trajectory(stamp=stamp)
    for duration in (Duration(sec=-1), Duration(sec=2**31 - 1), Duration(nanosec=2**32 - 1)):
        yield trajectory(time_from_start=duration)
    yield JointTrajectory()
    yield JointTrajectory(joint_names=['x'], points=[JointTrajectoryPoint(positions=[0.0])])


def test_a_simulated_arm_survives_every_trajectory(bench):
    node = bench.add(SimulatedArmNode, real_time_factor=0.0, rate=100.0)
    publisher = bench.matched_publisher(JointTrajectory, 'joint_trajectory', LATCHED)
    found = bench.listen(JointState, 'joint_states')
    bench.spin_until(lambda: node.readers)
    for message in trajectories(node._arm.joints):
        publisher.publish(message)
        bench.settle()
        node.step()
    bench.spin_until(lambda: len(found) >= 20, 'joint states')
    assert all(abs(x) < 10.0 for m in found for x in m.position)
    assert node.complaints.counts['trajectory'] >= 20
    assert node.complaints.defects == 0


def test_a_clock_from_elsewhere_stops_no_arm(bench):
    node = bench.add(SimulatedArmNode, use_sim_time=True, rate=100.0)
    clock = bench.matched_publisher(Clock, '/clock')
    for stamp in (Time(sec=5), *STAMPS, Time(sec=2**31 - 10), Time(sec=7)):
        clock.publish(Clock(clock=stamp))
        bench.settle()
        node.follow()
    bench.tick(8_000_000_000)
    node.follow()
    assert node.stamp_ns == 8_000_000_000
    assert node.complaints.counts['/clock'] == 2  # rclpy refuses times before 1970
    node.complaints.defects = 0


class Frail(ArmidNode):
    """A node whose callbacks fail."""

    table = ()

    def __init__(self, **kwargs):
        super().__init__('frail', **kwargs)
        self.heard = 0
        self.create_subscription(String, 'text', self.fail, 10)

    def fail(self, message):
        self.heard += 1
        raise ValueError(message.data)

    def condition(self):
        return '', {}


def test_what_nobody_had_foreseen_is_said_once_and_counted(bench):
    rosout, node = bench.rosout(), bench.add(Frail)
    publisher = bench.matched_publisher(String, 'text')
    for _ in range(3):
        publisher.publish(String(data='odd'))
    bench.spin_until(lambda: node.heard == 3, 'the messages')
    assert node.complaints.counts['text'] == 3
    bench.spin_until(lambda: rosout, 'the complaint')
    assert sum('ValueError: odd' in m.msg for m in rosout) == 1
    node.complaints.defects = 0  # that is what this node is for
