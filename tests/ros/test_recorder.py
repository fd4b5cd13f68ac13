# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recorder keeps what is published, as it is published, and says what it cannot keep."""

from __future__ import annotations

from armid_ros.nodes.recorder import RecorderNode
from armid_ros.recording import iter_raw, read_recording, topics
from builtin_interfaces.msg import Time
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

SECOND = 10**9
JOINTS = ('a', 'b')


def joint_state(k: int) -> JointState:
    message = JointState(name=['a', 'b'], position=[0.1 * k, 1.0], velocity=[0.0, 0.0])
    message.effort = [2.0, float(k)]
    message.header.stamp = Time(sec=100, nanosec=k * 10**6)
    return message


def record(bench, recorder, publisher, count):
    before = recorder.message_count
    for k in range(count):
        publisher.publish(joint_state(k))
    bench.spin_until(lambda: recorder.message_count >= before + count, 'the messages')


@pytest.mark.parametrize('reliability', list(ReliabilityPolicy)[1:3])
@pytest.mark.parametrize('durability', list(DurabilityPolicy)[1:3])
def test_every_message_is_in_the_bag_with_its_stamp(bench, tmp_path, reliability, durability):
    qos = QoSProfile(depth=1000, reliability=reliability, durability=durability)
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'])
    publisher = bench.matched_publisher(JointState, 'joint_states', qos)
    record(bench, recorder, publisher, 500)
    recorder.close()
    recording = read_recording(tmp_path / 'bag', joints=JOINTS)
    assert recording.report.clean and len(recording) == 500
    assert recording.tau[499, 1] == 499.0
    (topic,) = topics(tmp_path / 'bag')
    assert topic.qos[0].durability == durability.name.lower()
    first = next(iter_raw(tmp_path / 'bag'))
    assert first.publish_time_ns == 100 * SECOND
    assert deserialize_message(first.cdr, JointState) == joint_state(0)


def test_without_names_all_topics_are_recorded_those_that_come_later_too(bench, tmp_path):
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'))
    states = bench.matched_publisher(JointState, 'joint_states')
    texts = bench.matched_publisher(String, 'namespace/text')
    states.publish(joint_state(1))
    texts.publish(String(data='late'))
    bench.settle()
    recorder.close()
    found = {topic.name: topic.count for topic in topics(tmp_path / 'bag')}
    assert found['/joint_states'] == 1 and found['/namespace/text'] == 1
    assert '/rosout' in found


def test_start_and_stop_make_one_bag_each_time(bench, tmp_path):
    recorder = bench.add(
        RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'], record=False
    )
    publisher = bench.probe.create_publisher(JointState, 'joint_states', 1000)
    assert not recorder.recording
    refused = bench.call('recorder/stop')
    assert not refused.success and 'nothing' in refused.message
    for _ in range(2):
        assert bench.call('recorder/start').success
        bench.spin_until(lambda: publisher.get_subscription_count() == 1)
        record(bench, recorder, publisher, 10)
        stopped = bench.call('recorder/stop')
        assert stopped.success and '10 messages' in stopped.message
    for name in ('bag', 'bag_1'):
        assert len(read_recording(tmp_path / name, joints=JOINTS)) == 10


def test_in_simulated_time_messages_are_logged_at_it(bench, tmp_path):
    recorder = bench.add(
        RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'], use_sim_time=True
    )
    publisher = bench.matched_publisher(JointState, 'joint_states')
    publisher.publish(joint_state(0))  # before /clock begins: kept until it does
    bench.settle()
    bench.tick(150 * SECOND)
    publisher.publish(joint_state(1))
    bench.spin_until(lambda: recorder.message_count == 2)
    recorder.close()
    assert [m.log_time_ns for m in iter_raw(tmp_path / 'bag')] == [150 * SECOND] * 2


def test_in_simulated_time_nothing_is_logged_before_it_was_sent(bench, tmp_path):
    recorder = bench.add(
        RecorderNode, bag=str(tmp_path / 'bag'), topics=['joint_states'], use_sim_time=True
    )
    publisher = bench.matched_publisher(JointState, 'joint_states')
    bench.tick(50 * SECOND)
    record(bench, recorder, publisher, 3)
    recorder.close()
    logged = [m.log_time_ns for m in iter_raw(tmp_path / 'bag')]
    assert logged == [100 * SECOND + k * 10**6 for k in range(3)]


def test_an_existing_directory_is_not_touched(bench, tmp_path):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(Exception, match='exists already'):
        bench.add(RecorderNode, bag=str(tmp_path / 'bag'))


def test_a_wanted_topic_that_nobody_publishes_is_reported(bench, tmp_path):
    diagnostics = bench.diagnostics()
    recorder = bench.add(RecorderNode, bag=str(tmp_path / 'bag'), topics=['nothing'])
    status = bench.diagnose(recorder, diagnostics)
    assert status.message == 'nobody publishes /nothing'
