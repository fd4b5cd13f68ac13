# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The bag player publishes what a bag holds, when it was recorded."""

from armid_ros.errors import ArmidError
from armid_ros.motion import Motion
from armid_ros.nodes.bag_player import BagPlayerNode
from armid_ros.nodes.qos import LATCHED, STREAM
from armid_ros.recording import write_joint_trajectory, write_recording
from armid_ros.recording.bag import Bag
from armid_ros.recording.writer import BagWriter
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

SECOND = 10**9
JOINTS = ('a', 'b')
STATES = ['joint_states']


@pytest.fixture
def bag(tmp_path):
    t = np.arange(100) * 0.01
    q = np.column_stack([t, -t])
    motion = Motion(JOINTS, t, q, np.ones_like(q), np.zeros_like(q), 2.0 * q)
    write_recording(
        tmp_path / 'bag', motion, start_ns=7 * SECOND, robot_description='<robot name="r"/>'
    )
    return str(tmp_path / 'bag')


def stamps(messages):
    return [m.header.stamp.sec * SECOND + m.header.stamp.nanosec for m in messages]


def test_all_messages_come_in_order(bench, bag):
    states = bench.listen(JointState, 'joint_states')
    descriptions = bench.listen(String, 'robot_description', LATCHED)
    player = bench.add(BagPlayerNode, bag=bag, rate=100.0)
    bench.spin_until(lambda: len(states) == 100 and descriptions)
    assert stamps(states) == [7 * SECOND + k * SECOND // 100 for k in range(100)]
    assert player.finished and player.published.total() == 101
    assert states[50].effort[0] == pytest.approx(1.0)


def test_in_lock_step_what_is_due_depends_on_the_clock_alone(bench, bag):
    states = bench.listen(JointState, 'joint_states')
    player = bench.add(
        BagPlayerNode, bag=bag, topics=STATES, use_sim_time=True, subscriber_timeout=20.0
    )
    for clock, due in ((1000.0, 1), (1000.1, 11), (1000.105, 11), (1000.5, 51), (1010.0, 100)):
        bench.tick(round(clock * SECOND))
        bench.spin_until(lambda due=due: len(states) >= due)
        bench.settle()
        assert len(states) == player.published['/joint_states'] == due


@pytest.mark.parametrize('loop', [False, True])
def test_it_begins_again_in_a_loop(bench, bag, loop):
    states = bench.listen(JointState, 'joint_states')
    player = bench.add(BagPlayerNode, bag=bag, topics=STATES, rate=10.0, loop=loop)
    bench.spin_until(lambda: len(states) >= (200 if loop else 100))
    bench.spin_until(lambda: player.finished is not loop)
    assert stamps(states)[100:101] == [7 * SECOND] * loop


def test_bag_time_is_published_as_the_clock(bench, bag):
    clock = bench.listen(Clock, '/clock')
    bench.listen(JointState, 'joint_states')
    player = bench.add(BagPlayerNode, bag=bag, topics=STATES, rate=10.0, clock_rate=100.0)
    bench.spin_until(lambda: player.finished)
    times = [c.clock.sec + 1e-9 * c.clock.nanosec for c in clock]
    assert times[0] >= 7.0 and np.all(np.diff(times) > 0.0)


@pytest.mark.parametrize(
    ('parameters', 'message'),
    [
        ({}, 'bag'),
        ({'bag': '/nowhere/bag'}, '/nowhere/bag'),
        ({'topics': ['effort']}, '/effort.*/joint_states, /robot_description'),
        ({'clock_rate': 10.0, 'use_sim_time': True}, '/clock'),
    ],
)
def test_what_cannot_be_played_is_refused(bench, bag, parameters, message):
    if parameters and 'bag' not in parameters:
        parameters = {'bag': bag, **parameters}
    with pytest.raises(ArmidError, match=message):
        bench.add(BagPlayerNode, **parameters)


@pytest.fixture
def plan(tmp_path):
    """Write a trajectory that begins at rest at (0.1, -0.2), and moves a joint by 1 rad."""
    t = np.arange(101) * 0.02
    x = t / t[-1]
    q = np.column_stack([0.1 + x**3 * (10.0 - 15.0 * x + 6.0 * x**2), -0.2 + 0.0 * x])
    dq = np.gradient(q, t, axis=0)
    write_joint_trajectory(tmp_path / 'plan', Motion(JOINTS, t, q, dq, 0.0 * dq))
    return str(tmp_path / 'plan')


def played(bench, plan, states, **parameters):
    """Play a plan to an arm that reports some states, and return the player and what was sent."""
    heard = bench.listen(JointTrajectory, 'joint_trajectory', STREAM)
    player = bench.add(BagPlayerNode, bag=plan, **{'subscriber_timeout': 0.5, **parameters})
    drivers = bench.probe.create_publisher(JointState, 'joint_states', 10)
    bench.spin_until(drivers.get_subscription_count, 'joint_states')
    for names, positions in states:
        drivers.publish(JointState(name=names, position=positions))
    bench.spin_until(lambda: player.finished)
    bench.settle()
    return player, heard


def test_a_trajectory_is_sent_to_an_arm_that_is_where_it_begins(bench, plan):
    player, heard = played(bench, plan, [(['b', 'a'], [-0.2, 0.1])], subscriber_timeout=60.0)
    assert len(heard) == 1 and not player.failure
    late = bench.listen(JointTrajectory, 'joint_trajectory', LATCHED)
    bench.settle()
    assert not late


def test_a_trajectory_that_nobody_takes_is_a_failure(bench, plan):
    player = bench.add(BagPlayerNode, bag=plan, subscriber_timeout=0.0)
    bench.spin_until(lambda: player.finished)
    assert '/joint_trajectory' in player.failure and not player.published['/joint_trajectory']


@pytest.mark.parametrize(
    ('states', 'words'),
    [
        ([(['a', 'b'], [0.1, 0.3])], ("'b'", '0.3', '-0.2')),
        ([(['a'], [0.1])], ("'b'",)),
        ([], ("'a'",)),
    ],
    ids=['a jump', 'a joint unknown', 'no arm'],
)
def test_a_trajectory_that_would_make_an_arm_jump_is_refused(bench, plan, states, words):
    player, heard = played(bench, plan, states)
    assert not heard and all(word in player.failure for word in words)
    assert player.complaints.counts['trajectory'] == 1


def test_the_trajectory_of_a_recording_is_kept_from_another_arm(bench, bag, plan, tmp_path):
    """A bag with joint states of its own was recorded with an arm that is not this one."""
    topics = ('joint_states', 'joint_trajectory')
    whole = tmp_path / 'whole'
    with BagWriter(whole) as writer:
        for source in (bag, plan):
            with Bag(source) as read:
                for topic in read.topics():
                    if topic.name.lstrip('/') in topics:
                        writer.add_topic(topic.name, topic.type_name, qos=topic.qos)
                        for message in read.messages():
                            if message.topic == topic.name:
                                writer.write(topic.name, message.cdr, 7 * SECOND)
    heard = bench.listen(JointTrajectory, 'joint_trajectory', STREAM)
    bench.probe.create_publisher(JointState, 'joint_states', 10)
    player = bench.add(BagPlayerNode, bag=str(whole), subscriber_timeout=0.0, rate=100.0)
    bench.spin_until(lambda: player.finished)
    bench.settle()
    assert not heard and '/joint_states' in player.failure
    assert player.published['/joint_states'] == 100
